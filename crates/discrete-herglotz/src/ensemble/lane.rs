//! Members in SIMD lanes.

use crate::{Row, State};

/// The requests for members in lanes, in addition to their final states.
#[derive(Clone, Copy)]
pub struct LaneOptions {
    /// The number of steps from one row to the next, if rows are recorded.
    pub rows: Option<usize>,
    /// Whether members are flagged whose steps may not resolve the motion.
    pub check_resolution: bool,
}

/// Whether the state of a lane is the result of its member.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaneStatus {
    /// It is, if it is finite.
    Valid,
    /// The equations of a step could not be solved.
    Failed,
    /// The steps were interrupted.
    Interrupted,
    /// Its distance from the result with twice as many steps exceeds the requested error.
    Inaccurate,
}

/// A member in a lane.
#[derive(Clone, Debug)]
pub struct Lane {
    /// The current state.
    pub state: State,
    /// The rows, if they are recorded.
    pub rows: Option<Vec<Row>>,
    /// Whether a step may not have resolved the motion.
    pub suspect: bool,
    /// Whether the state is the result. If it is not, the member has a run of its own.
    pub status: LaneStatus,
    /// Whether the rows include the action.
    action: bool,
}

impl Lane {
    /// A member at its start, with capacity for `rows` rows if they are recorded.
    pub fn new(t0: f64, state: State, rows: Option<usize>, action: bool) -> Self {
        let rows = rows.map(|most| {
            let mut rows = Vec::with_capacity(most);
            rows.push(row(t0, &state, action));
            rows
        });
        Lane { state, rows, suspect: false, status: LaneStatus::Valid, action }
    }

    /// Updates the state, and records a row if rows are recorded. Not inlined: it is called for rows and at the end.
    #[inline(never)]
    pub fn record(&mut self, t: f64, state: State) {
        if let Some(rows) = &mut self.rows {
            rows.push(row(t, &state, self.action));
        }
        self.state = state;
    }
}

fn row(t: f64, State { q, p, z }: &State, action: bool) -> Row {
    let z = action.then_some(*z);
    Row { t, q: q.clone(), v: None, p: p.clone(), z, energy: None, log_factor: None, columns: Vec::new() }
}

/// Flags members as interrupted: each then has a run of its own, which reports how far it came.
#[inline(never)]
pub(crate) fn interrupt(members: &mut [Lane]) {
    members.iter_mut().for_each(|lane| lane.status = LaneStatus::Interrupted);
}
