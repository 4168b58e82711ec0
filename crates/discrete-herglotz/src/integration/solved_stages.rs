//! The solved stages of a step.

use crate::State;
use crate::numbers::registers::Stages;
use smallvec::SmallVec;

/// The values at the stages of each coordinate; without an allocation for up to four.
pub(crate) type StageVectors = SmallVec<[Stages; 4]>;

/// The solved stages of a step of contact Gauss collocation: all that its tangent needs. See
/// [`StepDetails::solved_stages`](crate::StepDetails::solved_stages).
#[derive(Clone, Debug)]
pub struct SolvedStages {
    pub(crate) s: usize,
    /// The time at the start, and the length of the step.
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) start: State,
    /// V, `rho (L_q + f)`, `rho L_z` and L, with padding of any values.
    pub(crate) v: StageVectors,
    pub(crate) force: StageVectors,
    pub(crate) rate: Stages,
    pub(crate) l: Stages,
    /// Whether L is known; otherwise its values are 0.
    pub(crate) knows_l: bool,
}

impl SolvedStages {
    /// The times of the start and of the end.
    pub fn span(&self) -> (f64, f64) {
        (self.t, self.t + self.h)
    }

    /// The state at the start.
    pub fn start(&self) -> &State {
        &self.start
    }

    /// The number of stages.
    pub fn stages(&self) -> usize {
        self.s
    }
}
