//! The parts of a step that ends parts at zeros of switching functions and at breaks.

use crate::integration::{Motion, WholeStep};
use crate::{Components, Point, State, StepError, Vector};

/// A part of a step with its solved stages, and what happened at its end: all that its tangent needs. See
/// [`StepDetails::solved_parts`](crate::StepDetails::solved_parts).
#[derive(Clone, Debug)]
pub struct SolvedPart {
    /// `None` for a part of length zero, between two passages at one point.
    pub(crate) step: Option<WholeStep>,
    pub(crate) from: PartPoint,
    /// The end, before anything happens there.
    pub(crate) to: PartPoint,
    /// The point from which the motion continues.
    pub(crate) next: PartPoint,
    pub(crate) end: PartEnd,
}

impl SolvedPart {
    /// The times of the start and of the end.
    pub fn span(&self) -> (f64, f64) {
        (self.from.t, self.to.t)
    }

    /// The reason why the part ends.
    pub fn end(&self) -> PartEnd {
        self.end
    }
}

/// The reason why a part of a step ends, which determines how its end depends on the variables of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PartEnd {
    /// It is the end of the step.
    Step,
    /// A named time of a kink or a jump ([`breaks`](contact_geom::Lagrangian::breaks)), which may depend on parameters.
    Break,
    /// The step is divided there. The end stays at this fraction of the step: which parts are taken is not
    /// differentiated, as the choice of steps is not.
    Division {
        /// The fraction of the step before the end.
        fraction: f64,
    },
    /// A zero of a [switching function](contact_geom::Lagrangian::switching_functions), whose time depends on the motion.
    Switch {
        /// The index of the function.
        index: usize,
        /// Whether it increases.
        rising: bool,
        /// What happens to the motion.
        passage: Passage,
    },
}

/// What happens to a motion at a zero of a switching function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Passage {
    /// Its state is continuous.
    Continuous,
    /// Its state is replaced.
    Reset,
    /// Its state is replaced at a corner of the surface, as where `min(x, y)` is zero in both: by the law of one of the parts
    /// that meet there. Others of them may follow at the same point.
    Corner,
    /// It crosses a jump of L with another momentum.
    Refraction,
    /// It is reflected at a jump of L.
    Reflection,
    /// Its state is replaced at the limit of a sequence of resets.
    Accumulation,
}

/// A time, a state and its velocity.
#[derive(Clone, Debug)]
pub(crate) struct PartPoint {
    pub t: f64,
    pub state: State,
    pub v: Vector,
}

impl PartPoint {
    pub fn point(&self) -> Point {
        Point { q: self.state.q.clone(), v: self.v.clone(), z: self.state.z }
    }

    /// The time derivatives of the state, as a vector, at this time or at another one.
    pub fn rates(&self, t: f64, motion: &impl Motion) -> Result<Components, StepError> {
        let State { q, p, z } = motion.rates(t, &self.state, Some(&self.v))?;
        Ok(Components { x: q, y: p, z })
    }
}
