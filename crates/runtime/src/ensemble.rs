//! Many motions of one formula.

use crate::{Column, Crossing, Event, Interrupt, OutputTimes, Start, StepControl};
use discrete_herglotz::{InputError, Status, UnresolvedStep};
use std::ops::ControlFlow;

/// Parameter values as functions of a member's index.
pub struct Varied<'a> {
    /// The parameters, by name.
    pub names: &'a [&'a str],
    /// Their values for a member, as many as there are names.
    pub values: &'a (dyn Fn(usize) -> Vec<f64> + Sync),
}

/// Many motions of one formula, run on several threads: starts and parameters are functions of the index. Members
/// without rows and events that have the same parameters are advanced together in SIMD lanes.
pub struct Ensemble<'a> {
    /// The number of members.
    pub count: usize,
    /// The start of each member; all start at the same time.
    pub start: &'a (dyn Fn(usize) -> Start + Sync),
    /// The time of all starts.
    pub t0: f64,
    /// The parameters that differ among members.
    pub varied: Option<Varied<'a>>,
    /// The final time.
    pub end: f64,
    /// How the motions are advanced.
    pub step_control: StepControl,
    /// The times at which rows are recorded.
    pub rows: Option<OutputTimes>,
    /// The columns of a row, which are also evaluated at the end.
    pub columns: &'a [Column],
    /// The events that are located in each motion; a terminal event ends the motion of its member only.
    pub events: &'a [Event],
    /// The number of threads; the number of processors where it is `None`.
    pub threads: Option<usize>,
}

/// The result of a member of an ensemble.
#[derive(Clone, Debug)]
pub struct MemberEnd {
    /// The index of the member, counted from 0.
    pub index: usize,
    /// The final state; an error where the motion could not start.
    pub ending: Result<Ending, InputError>,
    /// The recorded rows.
    pub rows: Vec<Vec<f64>>,
    /// The sign changes of events that were found, in order of occurrence.
    pub crossings: Vec<Crossing>,
}

/// The final state of a member's motion.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Ending {
    /// How it ended.
    pub status: Status,
    /// The first step that was found not to resolve the motion.
    pub unresolved: Option<UnresolvedStep>,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The position there.
    pub q: Vec<f64>,
    /// The velocity; NaN where no velocity corresponds to the momentum.
    pub v: Vec<f64>,
    /// The momentum.
    pub p: Vec<f64>,
    /// The action.
    pub z: f64,
    /// The columns at the end.
    pub columns: Vec<f64>,
}

/// Receives the members in the order of their index.
pub trait EnsembleMonitor {
    /// A member that has ended; `Break` ends the ensemble after the members that are running.
    fn member(&mut self, member: MemberEnd) -> ControlFlow<()>;

    /// A condition that ends the running members. It is evaluated on the threads of the runs, whereas
    /// [`poll`](Self::poll) is called only after they have ended.
    fn interrupt(&self) -> Option<Interrupt> {
        None
    }

    /// Called every few thousand members; more often where members have rows, events or parameters of their own, or
    /// where they take long.
    fn poll(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl<F: FnMut(MemberEnd) -> ControlFlow<()>> EnsembleMonitor for F {
    fn member(&mut self, member: MemberEnd) -> ControlFlow<()> {
        self(member)
    }
}
