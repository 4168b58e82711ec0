//! The model of a function of one variable, at many points.

use crate::{Model, ModelFailure};
use nalgebra::DMatrix;

/// The values of one function `f(x, theta)` at given points x.
///
/// The closure gets x, theta and a slice for the gradient `df/dtheta`, and returns the value.
///
/// ```
/// use herglotz_fit::{Curve, LeastSquares};
/// let decay = Curve::new(["amplitude", "rate"], [0.0, 1.0, 2.0, 3.0], |x, theta, gradient| {
///     let e = (-theta[1] * x).exp();
///     gradient.copy_from_slice(&[e, -theta[0] * x * e]);
///     theta[0] * e
/// });
/// println!("{}", LeastSquares::new(&decay, &[2.02, 1.21, 0.75, 0.44])?.solve(&[1.0, 1.0])?);
/// # Ok::<(), herglotz_fit::FitError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Curve<F> {
    names: Vec<String>,
    points: Vec<f64>,
    function: F,
}

impl<F: Fn(f64, &[f64], &mut [f64]) -> f64> Curve<F> {
    /// The function with these parameters, at these points.
    pub fn new<S: Into<String>>(
        names: impl IntoIterator<Item = S>,
        points: impl IntoIterator<Item = f64>,
        function: F,
    ) -> Self {
        Curve { names: names.into_iter().map(Into::into).collect(), points: points.into_iter().collect(), function }
    }
}

impl<F: Fn(f64, &[f64], &mut [f64]) -> f64> Model for Curve<F> {
    fn parameter_names(&self) -> Vec<String> {
        self.names.clone()
    }
    fn value_count(&self) -> usize {
        self.points.len()
    }
    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        let mut gradient = vec![f64::NAN; theta.len()];
        for (i, (x, value)) in self.points.iter().zip(values).enumerate() {
            *value = (self.function)(*x, theta, &mut gradient);
            if let Some(jacobian) = &mut jacobian {
                jacobian.row_mut(i).copy_from_slice(&gradient);
            }
        }
        Ok(())
    }
}
