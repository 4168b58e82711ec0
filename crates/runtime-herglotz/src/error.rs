//! What can be wrong with a request.

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
    /// An event has the conformal factor of a motion whose rate is not one number.
    #[error(
        "an event has `sigma` or `log_factor`, which are known between the ends of steps where L_z is constant alone; take a column, or an event of time and state"
    )]
    FactorInEvent,
    /// A parameter is in no formula.
    #[error("the parameter `{name}` is not in the Lagrangian, nor in an event or a column: {hint}")]
    UnusedParameter {
        /// The parameter.
        name: String,
        /// The nearest one that is used, or all.
        hint: String,
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
