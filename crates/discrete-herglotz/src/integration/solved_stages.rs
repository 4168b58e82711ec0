//! The solved stages of a step.

use crate::numbers::registers::Stages;
use contact_geom::PhasePoint;

/// The solved stages of a step of contact Gauss collocation: all that its tangent needs. See
/// [`Stepper::solved_stages`](crate::Stepper::solved_stages).
#[derive(Clone, Debug)]
pub struct SolvedStages<const N: usize> {
    pub(crate) s: usize,
    /// The time at the start, and the length of the step.
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) start: PhasePoint<N>,
    /// V, `rho (L_q + f)`, `rho L_z` and L, with padding of any values.
    pub(crate) v: [Stages; N],
    pub(crate) force: [Stages; N],
    pub(crate) rate: Stages,
    pub(crate) l: Stages,
    /// Whether L is known; otherwise its values are 0.
    pub(crate) knows_l: bool,
}

impl<const N: usize> SolvedStages<N> {
    /// The times of the start and of the end.
    pub fn span(&self) -> (f64, f64) {
        (self.t, self.t + self.h)
    }

    /// The state at the start.
    pub fn start(&self) -> &PhasePoint<N> {
        &self.start
    }

    /// The number of stages.
    pub fn stages(&self) -> usize {
        self.s
    }
}
