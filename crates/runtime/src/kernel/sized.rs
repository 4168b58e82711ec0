//! A system compiled for a number of coordinates.

use super::constrained::check_projection;
use super::formula_system::FormulaSystem;
use crate::{InitialVelocity, Motion, RuntimeError, Start};
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, VelocityPoint};
use discrete_herglotz::{InputError, Problem, StepError};

/// A system compiled for N coordinates, at least as many as its formula has. The additional coordinates are at rest and
/// are not visible from outside.
pub(super) struct Sized<L, const N: usize>(pub L);

/// The first n coordinates of a vector.
pub(super) fn coordinates<const N: usize>(x: &SVector<f64, N>, n: usize) -> &[f64] {
    x.as_slice().get(..n).unwrap_or(&[])
}

impl<L: FormulaSystem<N>, const N: usize> Sized<L, N> {
    /// A vector with one finite number per coordinate.
    pub fn vector(&self, what: &'static str, numbers: &[f64]) -> Result<SVector<f64, N>, RuntimeError> {
        let expected = self.0.formula().dimension();
        if numbers.len() != expected {
            return Err(RuntimeError::Length { what, found: numbers.len(), expected });
        }
        match numbers.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            Some((i, value)) => Err(RuntimeError::NotFinite { what: format!("{what}[{i}]"), value: *value }),
            None => Ok(SVector::from_fn(|i, _| numbers.get(i).copied().unwrap_or(0.0))),
        }
    }

    /// The start of a motion, validated.
    pub fn start(&self, start: &Start) -> Result<discrete_herglotz::Start<N>, RuntimeError> {
        for (what, value) in [("t", start.t), ("z", start.z)] {
            if !value.is_finite() {
                return Err(RuntimeError::NotFinite { what: what.into(), value });
            }
        }
        let q = self.vector("q", &start.q)?;
        Ok(match &start.velocity {
            InitialVelocity::Velocity(v) => VelocityPoint { q, v: self.vector("v", v)?, z: start.z }.into(),
            InitialVelocity::MomentumNear { p, v } => discrete_herglotz::Start::Momentum(
                PhasePoint { q, p: self.vector("p", p)?, z: start.z },
                self.vector("v", v)?,
            ),
            InitialVelocity::Momentum(p) => PhasePoint { q, p: self.vector("p", p)?, z: start.z }.into(),
        })
    }

    /// The problem of a start, validated.
    pub fn problem(&self, start: &Start) -> Result<Problem<'_, L, N>, RuntimeError> {
        let at = self.start(start)?;
        let problem = Problem::new(&self.0, start.t, at).map_err(|error| self.explained(error, start.t, &at))?;
        let force = self.0.applied_force(start.t, problem.start());
        let names = self.0.formula().coordinates();
        match names.into_iter().zip(force.iter().copied()).find(|(_, value)| !value.is_finite()) {
            Some((coordinate, value)) => Err(RuntimeError::ForceUndefined { coordinate, value }),
            None => Ok(problem),
        }
    }

    /// The problem of a motion, with the interrupt of the motion for its trial runs.
    pub fn problem_of<'m>(&'m self, motion: &'m Motion) -> Result<Problem<'m, L, N>, RuntimeError> {
        check_projection(self.0.formula(), motion)?;
        let problem = self.problem(&motion.start)?;
        let problem = match motion.project {
            true => Problem::new(&self.0, motion.start.t, self.0.projected(motion.start.t, *problem.start())?)?,
            false => problem,
        };
        Ok(match &motion.interrupt {
            Some(interrupt) => problem.with_interrupt(interrupt.for_integrators()),
            None => problem,
        })
    }

    /// Replaces the error of a singular start by one that names the velocities in which L is linear, if there are any.
    fn explained(&self, error: InputError, t: f64, at: &discrete_herglotz::Start<N>) -> RuntimeError {
        if let (InputError::FirstStep(StepError::Singular { .. }), discrete_herglotz::Start::Velocity(x)) = (&error, at)
            && const { !L::HINTS.hamiltonian }
        {
            let w = self.0.closed_hessian(t, x).map(|h| h.vv);
            let names = self.0.formula().coordinates();
            let flat = |i: &usize| w.is_some_and(|w| w.row(*i).iter().all(|e| *e == 0.0));
            let flat: Vec<String> = (0..names.len()).filter(flat).map(|i| crate::velocity_name(&names[i])).collect();
            if !flat.is_empty() {
                return RuntimeError::NotRegular { velocities: flat.join(", ") };
            }
        }
        match error {
            InputError::Undefined if const { L::HINTS.hamiltonian } => RuntimeError::HamiltonianUndefined,
            error => error.into(),
        }
    }
}
