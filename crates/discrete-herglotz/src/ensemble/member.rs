//! The result of a member of an ensemble.

use crate::{InputError, Outcome, Row, State, Status, UnresolvedStep};

/// One motion of an ensemble, with its result.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// The index of the member, counted from 0.
    pub index: usize,
    /// The result of the motion; an error if it could not start, as in a single run.
    pub ending: Result<Ending, InputError>,
    /// The recorded states, if [rows](crate::Ensemble::rows_every) are requested.
    pub rows: Vec<Row>,
}

/// The result of the motion of a member: the final state, or the last state that was computed if the run ended early.
#[derive(Clone, Debug, PartialEq)]
pub struct Ending {
    /// How the run ended.
    pub status: Status,
    /// The first unresolved step that was detected, if steps were monitored.
    pub unresolved: Option<UnresolvedStep>,
    /// The number of steps taken.
    pub steps: usize,
    /// The final time.
    pub t: f64,
    /// The state `(q, p, z)`; z is the initial action if the action was not requested.
    pub state: State,
}

impl From<Outcome> for Ending {
    fn from(outcome: Outcome) -> Self {
        let Outcome { status, unresolved, steps, t, .. } = outcome;
        Ending { status, unresolved, steps, t, state: outcome.state() }
    }
}

/// The numbers of members by the way in which they ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// The members with which the fold was called.
    pub members: usize,
    /// The members that reached the end.
    pub completed: usize,
    /// The members that an observer ended.
    pub stopped: usize,
    /// The members whose run failed or could not start.
    pub failed: usize,
    /// The members with an unresolved step.
    pub unresolved: usize,
    /// The members that were computed in lanes; the others had a run of their own.
    pub batch_kernel: usize,
    /// The members that have steps of their own, selected by trial runs for an accuracy: those that were not computed in
    /// lanes.
    pub own_plans: usize,
    /// The index of the first member that failed.
    pub first_failed: Option<usize>,
}

impl Tally {
    pub(crate) fn add(&mut self, member: &Member) {
        self.members += 1;
        self.unresolved += usize::from(member.ending.as_ref().is_ok_and(|ending| ending.unresolved.is_some()));
        match member.ending.as_ref().map(|ending| ending.status) {
            Ok(Status::Completed) => self.completed += 1,
            Ok(Status::Stopped { .. }) => self.stopped += 1,
            _ => {
                self.failed += 1;
                self.first_failed = self.first_failed.or(Some(member.index));
            }
        }
    }
}
