//! Resets: replacements of the state within a step.

use crate::integration::Passage;
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

/// A part of a step that is divided: at resets, kinks and jumps, or where the motion is fast. Within a piece the motion is
/// smooth.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The time and the state at its start, after what happens there.
    pub from: (f64, State),
    /// The time and the state at its end, before anything happens there.
    pub to: (f64, State),
    /// The logarithms of the conformal factor from the start of the step to its start and to its end.
    pub log_factors: [f64; 2],
    /// Its dense output, if the integrator provides it.
    pub dense: Option<DenseStep>,
    /// What happens at its start.
    pub start: PieceStart,
}

/// What happens to a motion at the start of a [`Piece`]; of several passages at one point the last in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PieceStart {
    /// Nothing: it is the start of the step, a [named time](contact_geom::Lagrangian::breaks), or a point at which a fast
    /// motion is divided. A motion that starts there is the same.
    Regular,
    /// It crosses the zero of a switching function with a continuous state.
    Zero,
    /// Its momentum jumps with L.
    Jump,
    /// Its state is replaced.
    Reset,
}

impl From<Passage> for PieceStart {
    fn from(passage: Passage) -> Self {
        match passage {
            Passage::Continuous => PieceStart::Zero,
            Passage::Refraction | Passage::Reflection => PieceStart::Jump,
            Passage::Reset | Passage::Corner | Passage::Accumulation => PieceStart::Reset,
        }
    }
}
