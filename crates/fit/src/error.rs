//! Errors of fits.

use crate::{ModelFailure, NullSpace};
use contact_geom::UnknownParameter;
use discrete_herglotz::InputError;
use thiserror::Error;

/// Invalid input to a fit, or a model that cannot be evaluated.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FitError {
    /// The model has no parameters.
    #[error("the model has no parameters; there is nothing to fit")]
    NoParameters,
    /// Two parameters of one name.
    #[error("two parameters have the name `{name}`; give each its own name")]
    NameTwice {
        /// The name.
        name: String,
    },
    /// A name that is not that of a parameter.
    #[error(transparent)]
    UnknownParameter(#[from] UnknownParameter),
    /// A list whose length is wrong.
    #[error("{what}: there are {found}, but there must be {expected}")]
    Count {
        /// What the list contains.
        what: &'static str,
        /// The length.
        found: usize,
        /// The right length.
        expected: usize,
    },
    /// A measured value is not finite.
    #[error("the measured value {index} is {value}; values must be finite, or have the weight 0")]
    Datum {
        /// Its index, counted from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A weight is negative or not finite.
    #[error("the weight of the measured value {index} is {value}; weights must be finite and at least 0")]
    Weight {
        /// The index of the value, counted from 0.
        index: usize,
        /// The weight.
        value: f64,
    },
    /// A standard deviation is not positive.
    #[error(
        "the standard deviation of the measured value {index} is {value}; standard deviations must be positive \
         (infinite for a value that is to be ignored)"
    )]
    StandardDeviation {
        /// The index of the value, counted from 0.
        index: usize,
        /// The standard deviation.
        value: f64,
    },
    /// The bounds of a parameter are not an interval.
    #[error(
        "the bounds of `{name}` are {lower} and {upper}; the lower bound must not exceed the upper one (infinite where \
         there is none)"
    )]
    Bounds {
        /// The parameter.
        name: String,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A start is not finite, or outside the bounds.
    #[error("the start of `{name}` is {value}; it must be finite and between {lower} and {upper}")]
    Start {
        /// The parameter.
        name: String,
        /// The start.
        value: f64,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// No start is given.
    #[error("there is no start; give at least one")]
    NoStart,
    /// An option is not positive and finite.
    #[error("{what} is {value}; it must be positive and finite")]
    Option {
        /// The option.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// Fewer measured values than parameters.
    #[error(
        "{data} measured values cannot determine {parameters} parameters: {null_space}; measure more values, or hold \
         parameters fixed by equal bounds"
    )]
    TooFewData {
        /// The number of values with a weight.
        data: usize,
        /// The number of parameters that are not held fixed.
        parameters: usize,
        /// The rank of the Jacobian at the start, and the combinations of parameters that the values do not determine.
        null_space: NullSpace,
    },
    /// The model cannot be evaluated, at the start or wherever the iteration could go on.
    #[error(
        "the model cannot be evaluated at {}: {failure}; start elsewhere, or exclude these parameters by bounds",
        named_values(names, parameters)
    )]
    Model {
        /// The names of the parameters.
        names: Vec<String>,
        /// The parameters that were tried.
        parameters: Vec<f64>,
        /// The reason.
        failure: ModelFailure,
    },
    /// The problem of a motion is invalid.
    #[error(transparent)]
    Motion(InputError),
    /// A coordinate that does not exist.
    #[error("there is no coordinate {index}; the coordinates are counted from 0 to {}", .count - 1)]
    Coordinate {
        /// The index.
        index: usize,
        /// The number of coordinates.
        count: usize,
    },
    /// A variable that cannot be an unknown of a fit.
    #[error(
        "{variable} cannot be an unknown of a fit; choose among parameters, and positions, velocities and the action of \
         the start"
    )]
    Unknown {
        /// The variable.
        variable: String,
    },
    /// The parameters of the Lagrangian cannot be set.
    #[error("the parameters of the Lagrangian cannot be set; implement `Parametric::with_parameters`")]
    FixedParameters,
    /// A time of observation, or a node, is outside the span.
    #[error("the time {index} is {t}; times must be finite and not before the start t0 = {t0}")]
    Time {
        /// Its index, counted from 0.
        index: usize,
        /// The time.
        t: f64,
        /// The time of the start.
        t0: f64,
    },
    /// No value was observed after the start.
    #[error("no value was observed after the start, at t0 = {t0}; give values at later times")]
    NoTimes {
        /// The time of the start.
        t0: f64,
    },
    /// Nodes of multiple shooting are not in order between the start and the last observation.
    #[error(
        "the node {index} is at {t}; nodes must ascend strictly between the start and the last observation, {t0} and {t_end}"
    )]
    Node {
        /// Its index, counted from 0.
        index: usize,
        /// Its time.
        t: f64,
        /// The time of the start.
        t0: f64,
        /// The time of the last observation.
        t_end: f64,
    },
    /// The minimizer stopped for a reason that has nothing to do with the data.
    #[error("the minimizer stopped at {}: {reason}; scale the parameters or the data", named_values(names, parameters))]
    Numerical {
        /// The names of the parameters.
        names: Vec<String>,
        /// The best parameters so far.
        parameters: Vec<f64>,
        /// The reason.
        reason: String,
    },
}

/// `a = 1, b = 2`, for the first parameters of long lists.
pub(crate) fn named_values(names: &[String], values: &[f64]) -> String {
    const MOST_LISTED: usize = 12;
    let listed = names.iter().zip(values).take(MOST_LISTED).map(|(name, value)| format!("{name} = {value}"));
    let listed = listed.collect::<Vec<_>>().join(", ");
    if names.len() > MOST_LISTED { format!("{listed}, and {} more", names.len() - MOST_LISTED) } else { listed }
}
