//! The functions that are fitted.

use nalgebra::DMatrix;
use thiserror::Error;

/// A function of parameters theta whose values are compared with measured ones: `model_i(theta)`, `i = 0, 1, ...`.
///
/// [`Curve`](crate::Curve) is the model of values of one function at many points, [`FunctionModel`](crate::FunctionModel)
/// that of two closures. [`jacobian_defect`](crate::jacobian_defect) compares a Jacobian with differences.
pub trait Model {
    /// The names of the parameters, without repetition.
    fn parameter_names(&self) -> Vec<String>;

    /// The number of values.
    fn value_count(&self) -> usize;

    /// Writes the values `model_i(theta)`, and, where a Jacobian is requested, the derivatives
    /// `d model_i / d theta_j` in row i and column j. Every entry is to be written.
    ///
    /// # Errors
    /// A model that is not defined at theta returns why. Values and derivatives that are not finite are taken as such a
    /// failure. The iteration then tries a shorter step.
    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure>;

    /// Whether the Jacobian is requested together with the values at every trial of the iteration, as by default. This
    /// is faster where values and Jacobian have most of their work in common, as those of a motion: nearly all trials
    /// are accepted, and the Jacobian is then needed.
    fn evaluates_jointly(&self) -> bool {
        true
    }
}

impl<M: Model + ?Sized> Model for &M {
    fn parameter_names(&self) -> Vec<String> {
        (**self).parameter_names()
    }
    fn value_count(&self) -> usize {
        (**self).value_count()
    }
    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        (**self).evaluate(theta, values, jacobian)
    }
    fn evaluates_jointly(&self) -> bool {
        (**self).evaluates_jointly()
    }
}

/// Why a model cannot be evaluated.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ModelFailure {
    /// A value is not finite.
    #[error("its value {index} is {value}")]
    Value {
        /// The index of the value, counted from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A derivative is not finite.
    #[error("the derivative of its value {index} with respect to `{parameter}` is {value}")]
    Derivative {
        /// The index of the value, counted from 0.
        index: usize,
        /// The parameter.
        parameter: String,
        /// The derivative.
        value: f64,
    },
    /// The model is not defined there.
    #[error("{0}")]
    Undefined(String),
}
