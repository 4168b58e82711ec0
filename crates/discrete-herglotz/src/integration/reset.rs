//! Resets: replacements of the state within a step.

use crate::{DenseStep, State};

/// A replacement of the state at the zero of a switching function; see
/// [`Lagrangian::at_switch`](contact_geom::Lagrangian::at_switch).
#[derive(Clone, Debug, PartialEq)]
pub struct Reset {
    /// The time.
    pub t: f64,
    /// The index of the switching function.
    pub index: usize,
    /// The state before it, on the surface.
    pub before: State,
    /// The state after it.
    pub after: State,
}

/// The part of a step between two resets, or between a reset and an end of the step.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The time and the state at its start, after the reset.
    pub from: (f64, State),
    /// The time and the state at its end, before the reset.
    pub to: (f64, State),
    /// Its dense output, if the integrator provides it and the piece is a single step of it.
    pub dense: Option<DenseStep>,
}
