//! Models of motions that can be computed in pieces.

use crate::{Model, ModelFailure};
use nalgebra::DMatrix;

/// A [`Model`] of values of a motion that can be computed in pieces, each from a state of the motion, as
/// [multiple shooting](crate::MultipleShooting) requires. [`MotionModel`](crate::MotionModel) is one.
///
/// The numbers of a state are positions, velocities and action, in any order.
pub trait PiecewiseModel: Model {
    /// The names of the numbers of a state.
    fn state_names(&self) -> Vec<String>;

    /// The time of the start.
    fn start_time(&self) -> f64;

    /// The state at the start for these values of the unknowns; it sets the size of its numbers.
    fn start_state(&self, theta: &[f64]) -> Vec<f64>;

    /// When each value of the model is observed, and what it is.
    fn observations(&self) -> Vec<Observation>;

    /// The values of a piece of the motion.
    ///
    /// # Errors
    /// As [`Model::evaluate`].
    fn piece(&self, theta: &[f64], piece: &Piece<'_>) -> Result<PieceValues, ModelFailure>;
}

/// When a value is observed, and whether it is a number of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The time.
    pub t: f64,
    /// The place of the value among the numbers of a state, if it is one of them.
    pub number: Option<usize>,
    /// The place of its derivative with respect to time among the numbers of a state, if that is one of them.
    pub rate: Option<usize>,
}

/// A piece of a motion, with what is computed of it.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'p> {
    /// The time and the state at its start; `None` for the start of the motion.
    pub from: Option<(f64, &'p [f64])>,
    /// The time of its end, if the state there is wanted.
    pub to: Option<f64>,
    /// The values of the model within the piece, by their indices.
    pub values: &'p [usize],
    /// Whether derivatives are wanted.
    pub is_differentiated: bool,
}

/// The values of a piece, then the numbers of the state at its end, if they are wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct PieceValues {
    /// The values.
    pub values: Vec<f64>,
    /// The derivatives of each of them in a row: with respect to the unknowns of the model, then to the numbers of the
    /// state at the start of the piece, unless that is the start of the motion. Without rows where none are wanted.
    pub derivatives: DMatrix<f64>,
}

impl PieceValues {
    /// Values that are NaN, and derivatives that are zero, to be written by [`PiecewiseModel::piece`].
    pub fn new(model: &(impl PiecewiseModel + ?Sized), piece: &Piece<'_>) -> Self {
        let size = if piece.to.is_some() || piece.from.is_some() { model.state_names().len() } else { 0 };
        let rows = piece.values.len() + if piece.to.is_some() { size } else { 0 };
        let columns = model.parameter_names().len() + if piece.from.is_some() { size } else { 0 };
        let derivatives = DMatrix::zeros(if piece.is_differentiated { rows } else { 0 }, columns);
        PieceValues { values: vec![f64::NAN; rows], derivatives }
    }

    /// Sets a value, and its derivatives at these places.
    pub fn set(&mut self, row: usize, value: f64, derivatives: impl IntoIterator<Item = (usize, f64)>) {
        self.values[row] = value;
        for (place, derivative) in derivatives {
            self.derivatives[(row, place)] = derivative;
        }
    }
}
