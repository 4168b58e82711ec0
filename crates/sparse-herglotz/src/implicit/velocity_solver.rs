//! The velocity of a state of a system with general terms, from its momentum `p = L_v`.

use super::lu::LuFactors;
use super::max_norm::max_norm;
use super::newton_convergence::{NewtonConvergence, NewtonDecision};
use super::stage_jacobian::StageJacobian;
use crate::SparseError;
use crate::derivatives::{EvaluationPoint, FirstDerivatives};
use crate::system::{LagrangianValue, SparseSystem};
use discrete_herglotz::{StepError, solve::ITERATION_LIMIT};

/// Newton's method for the inverse of the Legendre transformation, with the factors of `L_vv`.
pub(super) struct VelocitySolver {
    factors: LuFactors,
    /// L and its first derivatives at the point of the last evaluation, and the velocity there, padded.
    derivatives: FirstDerivatives,
    v: Vec<f64>,
    correction: Vec<f64>,
}

impl VelocitySolver {
    /// The solver for a system, which checks that `L_vv` is regular at the start.
    ///
    /// # Errors
    /// [`SparseError::Memory`], [`SparseError::Mass`] if an unknown has no mass, [`SparseError::SingularMass`].
    pub fn new(
        system: &SparseSystem,
        jacobian: &mut StageJacobian,
        start: EvaluationPoint,
        limit: usize,
    ) -> Result<Self, SparseError> {
        let (column_starts, rows) = jacobian.pattern.blocks(1)?;
        let mut factors = LuFactors::new(column_starts, rows, limit)?;
        jacobian.mass_matrix(system, start, &mut factors.entries);
        if let Some((unknown, _)) =
            jacobian.pattern.columns().find(|(_, range)| factors.entries[range.clone()].iter().all(|m| *m == 0.0))
        {
            return Err(SparseError::Mass { unknown, mass: 0.0 });
        }
        let n = system.unknowns();
        // The frequency and the constant make the right-hand side not orthogonal to the typical kernels of a singular
        // `L_vv`, which are constant, alternating or zero except at a few unknowns.
        let b: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * (1.7 * i as f64).sin()).collect();
        let mut x = b.clone();
        let regular = factors.factorise().and_then(|()| factors.solve(&mut x)).and_then(|()| factors.check(&x, &b));
        regular.map_err(|_| SparseError::SingularMass)?;
        Ok(VelocitySolver {
            factors,
            derivatives: FirstDerivatives::zeros(n),
            v: start.v.to_vec(),
            correction: vec![0.0; n],
        })
    }

    /// Solves `L_v = p` at `(t, q, z)` for the velocity, starting from the given one, which is overwritten with the
    /// solution. Increases `factorisations` by the number of factorisations, also if it fails.
    ///
    /// # Errors
    /// [`StepError`] if no velocity is found.
    pub fn solve(
        &mut self,
        system: &SparseSystem,
        jacobian: &mut StageJacobian,
        (t, q, z): (f64, &[f64], f64),
        p: &[f64],
        velocity: &mut [f64],
        factorisations: &mut u64,
    ) -> Result<(), StepError> {
        let VelocitySolver { factors, derivatives, v, correction } = self;
        let mut convergence = NewtonConvergence::new();
        let mut residual = f64::INFINITY;
        factors.discard();
        for _ in 0..ITERATION_LIMIT {
            v[1..=velocity.len()].copy_from_slice(velocity);
            let at = EvaluationPoint { t, q, v, z };
            system.first_derivatives(at, LagrangianValue::Needed, derivatives);
            if !factors.is_current() {
                jacobian.mass_matrix(system, at, &mut factors.entries);
                factors.factorise()?;
                *factorisations += 1;
                convergence.restart();
            }
            for (correction, (l_v, p)) in correction.iter_mut().zip(derivatives.v.iter().zip(p)) {
                *correction = l_v - p;
            }
            residual = max_norm(correction);
            factors.solve(correction)?;
            velocity.iter_mut().zip(&*correction).for_each(|(v, correction)| *v -= correction);
            let (size, speed) = (max_norm(correction), max_norm(velocity));
            match convergence.decide(size, f64::EPSILON * speed) {
                NewtonDecision::Converged => return Ok(()),
                NewtonDecision::Continue => {}
                NewtonDecision::Refactorise => factors.discard(),
            }
        }
        Err(StepError::NotConverged { residual, iterations: ITERATION_LIMIT })
    }

    /// L and its first derivatives at `(t, q, v, z)`, with a velocity that is not padded.
    pub fn evaluate(
        &mut self,
        system: &SparseSystem,
        (t, q, z): (f64, &[f64], f64),
        velocity: &[f64],
    ) -> &FirstDerivatives {
        self.v[1..=velocity.len()].copy_from_slice(velocity);
        system.first_derivatives(
            EvaluationPoint { t, q, v: &self.v, z },
            LagrangianValue::Needed,
            &mut self.derivatives,
        );
        &self.derivatives
    }
}
