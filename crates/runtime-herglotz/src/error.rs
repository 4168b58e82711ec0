//! What can be wrong with a request.

use assembled_herglotz::AssemblyError;
use contact_geom::GeometryError;
use discrete_herglotz::{CheckpointError, EnsembleError, InputError, StepError};
use formula_lagrangian::FormulaError;
use thiserror::Error;

/// Bad input to a system that is known when the program runs.
#[derive(Debug, Error)]
pub enum RuntimeError {
    /// A formula, a column or the function of an event.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// The start, the span, the integrator or the steps.
    #[error(transparent)]
    Input(#[from] InputError),
    /// What holds for all members of an ensemble, or for one of them.
    #[error(transparent)]
    Ensemble(#[from] EnsembleError),
    /// A point at which the geometry is not defined.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A step of a map that is looked at could not be taken.
    #[error("a step could not be taken: {0}")]
    Step(#[from] StepError),
    /// A checkpoint.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The system has no room for a thread.
    #[error("a thread could not be started: {0}; end other programs and try again")]
    Thread(#[from] std::io::Error),
    /// A vector has not as many entries as there are coordinates.
    #[error("`{what}` has {found} numbers, where the system has {expected} coordinates")]
    Length {
        /// Which vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of coordinates.
        expected: usize,
    },
    /// A vector or number is not finite.
    #[error("`{what}` is {value}, where a finite number is needed")]
    NotFinite {
        /// Which one.
        what: String,
        /// Its value.
        value: f64,
    },
    /// L does not depend on the square, or any curved function, of some velocities.
    #[error(
        "the Lagrangian is not regular at the start: it is linear in {velocities}, so that no acceleration follows; add a kinetic term"
    )]
    NotRegular {
        /// The velocities, by name.
        velocities: String,
    },
    /// A system of many coordinates, or its integrator.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
    /// The formula of a part of a system.
    #[error("`{part}`: {error}")]
    Part {
        /// Which part.
        part: &'static str,
        /// What is wrong with it.
        error: FormulaError,
    },
    /// An argument of a system of many coordinates.
    #[error("`{argument}` {why}")]
    Argument {
        /// Its name.
        argument: &'static str,
        /// What is wrong with it, and what is needed.
        why: String,
    },
    /// There is no system of this name in the catalogue.
    #[error("there is no system {name:?} in the catalogue{}; there are {known}", nearest.as_ref().map(|n| format!(", did you mean {n:?}?")).unwrap_or_default())]
    UnknownSystem {
        /// The name.
        name: String,
        /// The nearest known one.
        nearest: Option<String>,
        /// All known.
        known: String,
    },
}
