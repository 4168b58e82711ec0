//! The integrators of systems of many coordinates, behind one type.

use super::system::SiteSystem;
use crate::RuntimeError;
use discrete_herglotz::{AnyIntegrator, StepError, StepFailure, UnresolvedStep, rules::Method};
use sparse_herglotz::{SparseGauss, SparseMidpoint, SparseSplitting, State};

/// An integrator of a motion, including its action.
pub(super) enum Stepper<'a> {
    Splitting(Box<SparseSplitting<'a>>, u64),
    Midpoint(Box<SparseMidpoint<'a>>),
    Gauss(Box<SparseGauss<'a>>, u64),
}

/// A state of a motion, in the order of the sparse system.
#[derive(Clone, Debug)]
pub(super) struct OwnedState {
    pub t: f64,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub z: f64,
}

impl OwnedState {
    fn borrowed(&self) -> State<'_> {
        State { t: self.t, q: &self.q, v: &self.v, z: Some(self.z) }
    }
}

impl<'a> Stepper<'a> {
    /// An integrator with steps h from a start.
    pub fn new(of: &'a SiteSystem, by: AnyIntegrator, h: f64, start: &OwnedState) -> Result<Self, RuntimeError> {
        let (system, start) = (&of.system, start.borrowed());
        Ok(match by {
            AnyIntegrator::Splitting(scheme) => {
                let splitting = SparseSplitting::new(system, &scheme, h, start)?;
                Stepper::Splitting(Box::new(splitting), scheme.stages() as u64)
            }
            AnyIntegrator::Discrete(Method::Midpoint) if of.full => {
                Stepper::Midpoint(Box::new(SparseMidpoint::matrix_free(system, h, start)?))
            }
            AnyIntegrator::Discrete(Method::Midpoint) => {
                Stepper::Midpoint(Box::new(SparseMidpoint::new(system, h, start, None)?))
            }
            AnyIntegrator::Gauss { stages: stages @ 1..=2 } => {
                Stepper::Gauss(Box::new(SparseGauss::new(system, stages, h, start, None)?), stages as u64)
            }
            other => {
                let why = format!(
                    "is {:?}, which is for up to 16 coordinates; choose a splitting such as \"strang\" or \
                     \"blanes_moan_6\", or \"midpoint\", \"gauss_1\" or \"gauss_2\"",
                    other.to_string()
                );
                return Err(RuntimeError::argument("integrator", why));
            }
        })
    }

    /// Takes a number of steps.
    pub fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        match self {
            Stepper::Splitting(stepper, _) => stepper.advance(steps),
            Stepper::Midpoint(stepper) => stepper.advance(steps),
            Stepper::Gauss(stepper, _) => stepper.advance(steps),
        }
    }

    /// The current state. The caller replaces its time by one that follows from the number of steps.
    pub fn state(&mut self) -> Result<OwnedState, StepError> {
        let State { t, q, v, z } = match self {
            Stepper::Splitting(stepper, _) => stepper.state(),
            Stepper::Midpoint(stepper) => stepper.state(),
            Stepper::Gauss(stepper, _) => stepper.state()?,
        };
        // The action is known, since the stepper was started with one.
        let z = z.unwrap_or(f64::NAN);
        if q.iter().chain(v).chain([&z]).all(|x| x.is_finite()) {
            return Ok(OwnedState { t, q: q.to_vec(), v: v.to_vec(), z });
        }
        Err(StepError::NonFinite)
    }

    /// The first check at which the steps were found not to resolve the motion.
    pub fn unresolved(&mut self) -> Option<UnresolvedStep> {
        match self {
            Stepper::Splitting(stepper, _) => stepper.unresolved(),
            Stepper::Midpoint(stepper) => stepper.unresolved(),
            Stepper::Gauss(stepper, _) => stepper.unresolved(),
        }
    }

    /// `sigma_d` of the last step.
    pub fn sigma(&self) -> f64 {
        match self {
            Stepper::Splitting(stepper, _) => stepper.sigma(),
            Stepper::Midpoint(stepper) => stepper.sigma(),
            Stepper::Gauss(stepper, _) => stepper.sigma(),
        }
    }

    /// The number of evaluations of forces in a number of steps.
    pub fn evaluations(&self, steps: usize) -> u64 {
        match self {
            Stepper::Splitting(_, stages) => stages.saturating_mul(steps as u64),
            Stepper::Midpoint(stepper) => stepper.iterations(),
            Stepper::Gauss(stepper, stages) => stages.saturating_mul(stepper.iterations()),
        }
    }
}

impl SiteSystem {
    /// The momenta `m v` of velocities.
    pub(super) fn momenta(&self, v: &[f64]) -> Vec<f64> {
        self.masses.iter().zip(v).map(|(m, v)| m * v).collect()
    }

    /// The energy of a state.
    pub(super) fn energy(&self, at: &OwnedState) -> Result<f64, StepError> {
        // Other errors of a state have been excluded before.
        self.system.energy(at.borrowed()).map_err(|_| StepError::NonFinite)
    }
}
