//! Members on their way in lanes.

use crate::Row;
use contact_geom::PhasePoint;

/// What is wanted of members in lanes beside their ends.
#[derive(Clone, Copy)]
pub(crate) struct LaneOptions {
    /// A row after each so many steps.
    pub rows: Option<usize>,
    /// Marks where steps do not resolve the motion.
    pub watched: bool,
}

/// A member on its way in a lane.
#[derive(Clone, Debug)]
pub(crate) struct Lane<const N: usize> {
    /// How far it has come.
    pub state: PhasePoint<N>,
    /// Its rows, where they are recorded.
    pub rows: Option<Vec<Row<N>>>,
    /// Whether a step may not have resolved its motion.
    pub doubtful: bool,
    /// Whether its rows have the action.
    action: bool,
}

impl<const N: usize> Lane<N> {
    /// At its start, with room for so many rows where they are recorded.
    pub fn new(t0: f64, state: PhasePoint<N>, rows: Option<usize>, action: bool) -> Self {
        let rows = rows.map(|most| {
            let mut rows = Vec::with_capacity(most);
            rows.push(row(t0, state, action));
            rows
        });
        Lane { state, rows, doubtful: false, action }
    }

    /// Takes in a state of which a row is recorded, where any are.
    pub fn reach(&mut self, t: f64, state: PhasePoint<N>) {
        self.state = state;
        if let Some(rows) = &mut self.rows {
            rows.push(row(t, state, self.action));
        }
    }
}

fn row<const N: usize>(t: f64, PhasePoint { q, p, z }: PhasePoint<N>, action: bool) -> Row<N> {
    Row { t, q, v: None, p, z: action.then_some(z), energy: None, log_factor: None, columns: Vec::new() }
}

/// Marks members as not finished: each then has a run of its own, which says how far it has come.
pub(crate) fn interrupted<const N: usize>(some: &mut [Lane<N>]) {
    some.iter_mut().for_each(|lane| lane.state.z = f64::NAN);
}
