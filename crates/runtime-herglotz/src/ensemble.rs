//! Many motions of one formula.

use crate::{Column, Crossing, Event, Interrupt, OutputTimes, RuntimeError, Start, StepControl, System};
use discrete_herglotz::{InputError, Status, Tally, UnresolvedStep};
use std::ops::ControlFlow;

/// The values of parameters as functions of a member's index.
pub struct Varied<'a> {
    /// The parameters, by name.
    pub names: &'a [&'a str],
    /// Their values for a member, as many as there are names.
    pub values: &'a (dyn Fn(usize) -> Vec<f64> + Sync),
}

/// Many motions of one formula, over threads: their starts, and parameters, are functions of the index. Members without rows and
/// events whose parameters are the same are advanced together in the lanes of vector registers.
pub struct Ensemble<'a> {
    /// How many.
    pub count: usize,
    /// The start of each; all at one time.
    pub start: &'a (dyn Fn(usize) -> Start + Sync),
    /// The time of all starts.
    pub t0: f64,
    /// The parameters that differ among members.
    pub varied: Option<Varied<'a>>,
    /// The time at which they end.
    pub end: f64,
    /// How they are advanced.
    pub way: StepControl,
    /// The states that are recorded.
    pub rows: Option<OutputTimes>,
    /// What a row has, and what is told of the end.
    pub columns: &'a [Column],
    /// The changes of sign that are to be found in each; a terminal one ends its member alone.
    pub events: &'a [Event],
    /// As many as there are processors where it is `None`.
    pub threads: Option<usize>,
}

/// A member of an ensemble at its end.
#[derive(Clone, Debug)]
pub struct MemberEnd {
    /// Which one, counted from 0.
    pub index: usize,
    /// Where it has led to; an error where it could not begin.
    pub ending: Result<Ending, InputError>,
    /// The recorded rows.
    pub rows: Vec<Vec<f64>>,
    /// The events that were found, in their order.
    pub crossings: Vec<Crossing>,
}

/// Where the motion of a member has led to.
#[derive(Clone, Debug, PartialEq)]
pub struct Ending {
    /// How it ended.
    pub status: Status,
    /// The first step that was seen not to have resolved the motion.
    pub unresolved: Option<UnresolvedStep>,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The position there.
    pub q: Vec<f64>,
    /// The velocity; not a number where none belongs to the momentum.
    pub v: Vec<f64>,
    /// The momentum.
    pub p: Vec<f64>,
    /// The action.
    pub z: f64,
    /// The columns at the end.
    pub columns: Vec<f64>,
}

/// What is handed the members in the order of their index.
pub trait EnsembleMonitor {
    /// A member at its end; `Break` ends the ensemble after the members under way.
    fn member(&mut self, member: MemberEnd) -> ControlFlow<()>;

    /// Whether the members under way are to end: asked on the threads of their runs, where [`poll`](Self::poll) waits for them.
    fn interrupt(&self) -> Option<Interrupt> {
        None
    }

    /// Is called every few thousand members, or fewer where each has rows, events or parameters of its own, or where they take long.
    fn poll(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl<F: FnMut(MemberEnd) -> ControlFlow<()>> EnsembleMonitor for F {
    fn member(&mut self, member: MemberEnd) -> ControlFlow<()> {
        self(member)
    }
}

impl System {
    /// Runs an ensemble; a member that cannot begin, or fails, is handed on with the cause, and the others go on. The result of a member does
    /// not depend on the number of threads.
    ///
    /// # Errors
    /// What holds for all members.
    pub fn ensemble(&self, ensemble: &Ensemble<'_>, watch: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError> {
        self.kernel.ensemble(ensemble, watch)
    }
}
