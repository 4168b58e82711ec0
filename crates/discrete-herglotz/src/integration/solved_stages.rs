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

    /// The number of numbers in the stages of n coordinates.
    pub(crate) fn size(s: usize, n: usize) -> usize {
        3 + 2 * n + 2 * (n + 1) * s
    }

    /// Appends all numbers that steps of one kind do not have in common.
    pub(crate) fn append_to(&self, to: &mut Vec<f64>) {
        let SolvedStages { s, t, h, start, v, force, rate, l, .. } = self;
        to.extend([*t, *h, start.z]);
        to.extend_from_slice(&start.q);
        to.extend_from_slice(&start.p);
        for of in v.iter().chain(force).chain([rate, l]) {
            to.extend_from_slice(&of.0[..*s]);
        }
    }

    /// Takes numbers that [`append_to`](Self::append_to) has appended, of a step of the same kind.
    pub(crate) fn set(&mut self, from: &[f64]) {
        let SolvedStages { s, t, h, start, v, force, rate, l, .. } = self;
        let mut numbers = from;
        let mut next = |to: &mut [f64]| {
            if let Some((first, rest)) = numbers.split_at_checked(to.len()) {
                to.copy_from_slice(first);
                numbers = rest;
            }
        };
        [t, h, &mut start.z].into_iter().for_each(|to| next(std::slice::from_mut(to)));
        next(&mut start.q);
        next(&mut start.p);
        v.iter_mut().chain(force).chain([rate, l]).for_each(|of| next(&mut of.0[..*s]));
    }
}
