//! Errors of derivatives of runs.

use crate::sensitivity::Variable;
use crate::{InputError, StepError};
use contact_geom::UnknownParameter;
use std::borrow::Cow;
use thiserror::Error;

/// The reason why a run cannot be differentiated.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SensitivityError {
    /// The input of the run is invalid.
    #[error(transparent)]
    Input(#[from] InputError),
    /// There is no parameter of this name.
    #[error(transparent)]
    Parameter(#[from] UnknownParameter),
    /// The integrator has no tangent.
    #[error(
        "derivatives of runs by `{method}`{case} are not implemented; choose `GaussCollocation`, or for Lagrangians \
         without switching functions a splitting, a quadrature rule or a composition of them"
    )]
    NoTangent {
        /// The name of the method.
        method: Cow<'static, str>,
        /// In which case, if not always.
        case: &'static str,
    },
    /// Derivatives under constraints that are not implemented.
    #[error(
        "{what} of runs by `{method}` are not implemented, and integrators without its constraints compute another motion; \
         take differences of runs from nearby starts that satisfy the constraints"
    )]
    UnderConstraints {
        /// The name of the method.
        method: Cow<'static, str>,
        /// What is not implemented.
        what: &'static str,
    },
    /// The steps can be differentiated with respect to the start alone.
    #[error(
        "runs by `{method}` are differentiable in the position, the velocity or momentum and the action of the start, \
         but not in {variable}, because the dependence of its discrete Lagrangian on it is not known; choose \
         `GaussCollocation`"
    )]
    OnlyInStart {
        /// The name of the method.
        method: Cow<'static, str>,
        /// The variable.
        variable: Variable,
    },
    /// A variable that the start of the problem does not have.
    #[error(
        "the start of the problem was given by its {given}, not by its {other}; differentiate with respect to the {given}"
    )]
    Start {
        /// What was given.
        given: &'static str,
        /// What was requested.
        other: &'static str,
    },
    /// A coordinate that does not exist.
    #[error("there is no coordinate {index}; the coordinates are counted from 0 to {}", .count - 1)]
    Coordinate {
        /// The index.
        index: usize,
        /// The number of coordinates.
        count: usize,
    },
    /// The loss or its derivative is not finite.
    #[error("the loss is {value}, or its derivative is not finite; use a loss that is defined at the end of the run")]
    Loss {
        /// The value of the loss.
        value: f64,
    },
    /// The motion meets a surface tangentially, up to round-off: the time at which it does has no derivative.
    #[error(
        "the motion meets a surface tangentially at t = {t}: the rate {rate} of the function there is round-off, and the \
         time has no derivative; differentiate a run that ends before, or with another start"
    )]
    Grazing {
        /// The time.
        t: f64,
        /// The time derivative of the function whose zero is the surface.
        rate: f64,
    },
    /// The passage of the motion through the zero of a switching function has no derivative.
    #[error(
        "the derivative of the passage through the zero of switching function {index} at t = {t} is not known: {cause}"
    )]
    Passage {
        /// The time.
        t: f64,
        /// The index of the function.
        index: usize,
        /// The cause.
        cause: &'static str,
    },
    /// The derivative of a time of kinks and jumps in a parameter is not known.
    #[error(
        "the derivative of the time t = {t} of a kink or a jump in parameter {parameter} is not known, since for nearby \
         values there are more or fewer such times; choose another value of the parameter, or state the derivatives by \
         `break_rates`"
    )]
    TimeJump {
        /// The time.
        t: f64,
        /// The index of the parameter.
        parameter: usize,
    },
    /// The tangent of a step cannot be computed.
    #[error("the derivative of step {step} cannot be computed: {cause}")]
    Step {
        /// The step, counted from 0.
        step: usize,
        /// The cause.
        cause: StepError,
    },
}
