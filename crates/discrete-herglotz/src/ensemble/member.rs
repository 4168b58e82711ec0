//! What becomes of a member of an ensemble.

use crate::{InputError, Outcome, Row, Status, UnresolvedStep};
use contact_geom::PhasePoint;

/// One motion of an ensemble, at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Member<const N: usize> {
    /// Which one, counted from 0.
    pub index: usize,
    /// Where its motion has led to; an error where it could not begin, as that of a single run.
    pub ending: Result<Ending<N>, InputError>,
    /// Its states on the way, where [rows](crate::Ensemble::rows_every) are recorded.
    pub rows: Vec<Row<N>>,
}

/// Where the motion of a member has led to. Where it was ended before its time, that is what was computed before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ending<const N: usize> {
    /// How it ended.
    pub status: Status,
    /// The first step that was seen not to have resolved the motion, where it was watched.
    pub unresolved: Option<UnresolvedStep>,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The state `(q, p, z)`; the action is the start's where it was not asked for.
    pub state: PhasePoint<N>,
}

impl<const N: usize> From<Outcome<N>> for Ending<N> {
    fn from(outcome: Outcome<N>) -> Self {
        let Outcome { status, unresolved, steps, t, .. } = outcome;
        Ending { status, unresolved, steps, t, state: outcome.state() }
    }
}

/// How many members have ended in which way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Those that were handed to the fold.
    pub members: usize,
    /// Those that took all of their steps.
    pub completed: usize,
    /// Those that an observer has ended.
    pub stopped: usize,
    /// Those whose run failed, or that could not begin.
    pub failed: usize,
    /// Those with an unresolved step.
    pub unresolved: usize,
    /// Those that were advanced in lanes; the others had a run of their own.
    pub batch_kernel: usize,
    /// The first that failed.
    pub first_failed: Option<usize>,
}

impl Tally {
    pub(crate) fn add<const N: usize>(&mut self, member: &Member<N>) {
        self.members += 1;
        self.unresolved += usize::from(member.ending.is_ok_and(|ending| ending.unresolved.is_some()));
        match member.ending.map(|ending| ending.status) {
            Ok(Status::Completed) => self.completed += 1,
            Ok(Status::Stopped { .. }) => self.stopped += 1,
            _ => {
                self.failed += 1;
                self.first_failed = self.first_failed.or(Some(member.index));
            }
        }
    }
}
