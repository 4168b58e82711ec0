//! Members in SIMD lanes.

use crate::Row;
use contact_geom::PhasePoint;

/// The requests for members in lanes, in addition to their final states.
#[derive(Clone, Copy)]
pub(crate) struct LaneOptions {
    /// The number of steps from one row to the next, if rows are recorded.
    pub rows: Option<usize>,
    /// Whether members are flagged whose steps may not resolve the motion.
    pub check_resolution: bool,
}

/// Whether the state of a lane is the result of its member.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LaneStatus {
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
pub(crate) struct Lane<const N: usize> {
    /// The current state.
    pub state: PhasePoint<N>,
    /// The rows, if they are recorded.
    pub rows: Option<Vec<Row>>,
    /// Whether a step may not have resolved the motion.
    pub suspect: bool,
    /// Whether the state is the result. If it is not, the member has a run of its own.
    pub status: LaneStatus,
    /// Whether the rows include the action.
    action: bool,
}

impl<const N: usize> Lane<N> {
    /// A member at its start, with capacity for `rows` rows if they are recorded.
    pub fn new(t0: f64, state: PhasePoint<N>, rows: Option<usize>, action: bool) -> Self {
        let rows = rows.map(|most| {
            let mut rows = Vec::with_capacity(most);
            rows.push(row(t0, state, action));
            rows
        });
        Lane { state, rows, suspect: false, status: LaneStatus::Valid, action }
    }

    /// Updates the state, and records a row if rows are recorded.
    pub fn record(&mut self, t: f64, state: PhasePoint<N>) {
        self.state = state;
        if let Some(rows) = &mut self.rows {
            rows.push(row(t, state, self.action));
        }
    }
}

fn row<const N: usize>(t: f64, PhasePoint { q, p, z }: PhasePoint<N>, action: bool) -> Row {
    let z = action.then_some(z);
    Row { t, q: q.into(), v: None, p: p.into(), z, energy: None, log_factor: None, columns: Vec::new() }
}

/// Flags members as interrupted: each then has a run of its own, which reports how far it came.
#[inline(never)]
pub(crate) fn interrupt<const N: usize>(members: &mut [Lane<N>]) {
    members.iter_mut().for_each(|lane| lane.status = LaneStatus::Interrupted);
}
