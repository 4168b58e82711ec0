//! The multipliers of RATTLE: positions on the constraints, and velocities tangent to them.

use super::gram::GramMatrix;
use crate::SparseError;
use crate::constraints::jacobian::{ConstraintList, JacobianPattern, curvatures, gradients, values};
use crate::implicit::{NewtonConvergence, NewtonDecision, max_norm};
use crate::memory::memory_limit;
use crate::system::SparseSystem;
use discrete_herglotz::{StepError, solve::ITERATION_LIMIT};

/// All constraints of a system, with their Jacobian `G = c_q` at the position of the last linearisation.
pub(super) struct ConstraintSolver<'a> {
    pub lists: &'a [Box<dyn ConstraintList>],
    pub pattern: JacobianPattern,
    pub gram: GramMatrix,
    /// The inverse masses, padded with 0.
    pub inverse_masses: Vec<f64>,
    /// The entries of G, and of `G M^-1`.
    pub g: Vec<f64>,
    pub weighted: Vec<f64>,
    /// The entries of the Jacobian at a trial position.
    trial_g: Vec<f64>,
    /// A number for each constraint: a residual, and then the multipliers.
    pub y: Vec<f64>,
    /// A change of positions or velocities, padded.
    pub change: Vec<f64>,
    pub iterations: u64,
    pub factorisations: u64,
}

impl<'a> ConstraintSolver<'a> {
    /// The solver of a system whose masses have been checked.
    ///
    /// # Errors
    /// [`SparseError::Unconstrained`], [`SparseError::Memory`].
    pub fn new(system: &'a SparseSystem) -> Result<Self, SparseError> {
        let (lists, n) = (system.constraints.as_slice(), system.unknowns());
        let pattern = JacobianPattern::new(lists);
        if pattern.constraints() == 0 {
            return Err(SparseError::Unconstrained);
        }
        let gram = GramMatrix::new(&pattern, n, memory_limit(None))?;
        let mut inverse_masses = vec![0.0; n + 2];
        (0..n).for_each(|i| inverse_masses[i + 1] = 1.0 / system.mass(i));
        let zeros = vec![0.0; pattern.columns.len()];
        let y = vec![0.0; pattern.constraints()];
        Ok(ConstraintSolver {
            lists,
            pattern,
            gram,
            inverse_masses,
            g: zeros.clone(),
            weighted: zeros.clone(),
            trial_g: zeros,
            y,
            change: vec![0.0; n + 2],
            iterations: 0,
            factorisations: 0,
        })
    }

    /// Evaluates the Jacobian at a position.
    pub fn evaluate(&mut self, q: &[f64]) {
        gradients(self.lists, q, &mut self.g);
        for ((weighted, g), i) in self.weighted.iter_mut().zip(&self.g).zip(&self.pattern.columns) {
            *weighted = g * self.inverse_masses[*i as usize];
        }
    }

    /// Evaluates the Jacobian at a position, and factorises `G M^-1 G^T` there.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the constraints are dependent, [`StepError::NonFinite`].
    pub fn linearise(&mut self, q: &[f64]) -> Result<(), StepError> {
        self.evaluate(q);
        self.factorisations += 1;
        self.gram.factorise(&self.g, &self.weighted)
    }

    /// Evaluates the constraints at a position, into `y`.
    pub fn residual(&mut self, q: &[f64]) {
        values(self.lists, q, &mut self.y);
    }

    /// Computes the change `-M^-1 G^T y`.
    pub fn respond(&mut self) {
        self.change.fill(0.0);
        self.pattern.add_transposed(&self.weighted, &self.y, -1.0, &mut self.change);
    }

    /// Solves `c(q) = 0`, `q = q0 + h v` for an impulse `v += M^-1 G(q0)^T Y`, which is added to the given one. The
    /// solver must be linearised at q0.
    ///
    /// Newton's method begins with the factors of `G(q0) M^-1 G(q0)^T`, with which it converges at a rate of the size of
    /// h. Only if this is too slow it factorises `G(q) M^-1 G(q0)^T`.
    ///
    /// # Errors
    /// [`StepError`] if no position is found.
    pub fn constrain(
        &mut self,
        h: f64,
        q0: &[f64],
        (q, v): (&mut [f64], &mut [f64]),
        impulse: &mut [f64],
    ) -> Result<(), StepError> {
        let mut convergence = NewtonConvergence::expecting(MAX_EXPECTED_ITERATIONS);
        let (mut current, mut frozen, mut residual) = (true, true, f64::INFINITY);
        let mut scale = max_norm(q0);
        for iteration in 0..ITERATION_LIMIT {
            for ((q, q0), v) in q.iter_mut().zip(q0).zip(&*v) {
                *q = q0 + h * v;
            }
            if iteration == 0 {
                scale += max_norm(q);
            }
            self.residual(q);
            residual = max_norm(&self.y);
            if !(residual.is_finite() && scale.is_finite()) {
                return Err(StepError::NonFinite);
            }
            if !current {
                gradients(self.lists, q, &mut self.trial_g);
                self.gram.factorise_unsymmetric(&self.trial_g, &self.weighted)?;
                self.factorisations += 1;
                convergence.restart();
                (current, frozen) = (true, false);
            }
            self.y.iter_mut().for_each(|y| *y /= h);
            if frozen {
                self.gram.solve(&mut self.y)?
            } else {
                self.gram.solve_unsymmetric(&mut self.y)?
            }
            self.respond();
            for (v, change) in v.iter_mut().zip(&self.change) {
                *v += change;
            }
            impulse.iter_mut().zip(&self.y).for_each(|(impulse, y)| *impulse -= y);
            self.iterations += 1;
            let moved = h.abs() * max_norm(&self.change);
            if !moved.is_finite() {
                return Err(StepError::NonFinite);
            }
            match convergence.decide(moved, 0.5 * f64::EPSILON * scale) {
                NewtonDecision::Converged => {
                    for ((q, q0), v) in q.iter_mut().zip(q0).zip(&*v) {
                        *q = q0 + h * v;
                    }
                    return Ok(());
                }
                NewtonDecision::Continue => {}
                NewtonDecision::Refactorise => current = false,
            }
        }
        Err(StepError::NotConverged { residual, iterations: ITERATION_LIMIT })
    }

    /// Projects a velocity to `G v = 0`, orthogonally in the metric M, by an impulse that is added to the given one. The
    /// second pass removes the round-off of the first.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the constraints are dependent.
    pub fn project(&mut self, v: &mut [f64], impulse: &mut [f64]) -> Result<(), StepError> {
        for _ in 0..2 {
            self.pattern.product(&self.g, v, &mut self.y);
            self.gram.solve(&mut self.y)?;
            self.pattern.add_transposed(&self.weighted, &self.y, -1.0, v);
            impulse.iter_mut().zip(&self.y).for_each(|(impulse, y)| *impulse -= y);
        }
        Ok(())
    }

    /// The multipliers of the motion with the given acceleration without constraints, into `y`: those with which
    /// `c_q (a + M^-1 G^T y) + v.c_qq v = 0`.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the constraints are dependent.
    pub fn multipliers(&mut self, q: &[f64], v: &[f64]) -> Result<(), StepError> {
        curvatures(self.lists, q, v, &mut self.y);
        for (y, row) in self.y.iter_mut().zip(self.pattern.rows(&self.g)) {
            *y = -(*y + row.map(|(i, g)| g * self.change[i]).sum::<f64>());
        }
        self.gram.solve(&mut self.y)
    }
}

/// The number of further iterations up to which Newton's method keeps the factors within a step. An iteration costs about
/// a tenth of a factorisation of an unsymmetric matrix.
const MAX_EXPECTED_ITERATIONS: f64 = 12.0;
