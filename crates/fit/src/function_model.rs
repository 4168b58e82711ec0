//! The model of two closures.

use crate::{Model, ModelFailure};
use nalgebra::DMatrix;

/// A model by two closures: `values(theta, out)` and `jacobian(theta, out)`.
///
/// ```
/// use herglotz_fit::{FunctionModel, LeastSquares};
/// // Where two circles meet.
/// let circles = FunctionModel::new(
///     ["x", "y"],
///     2,
///     |p, out| {
///         out[0] = p[0].hypot(p[1]);
///         out[1] = (p[0] - 6.0).hypot(p[1]);
///     },
///     |p, out| {
///         let (near, far) = (p[0].hypot(p[1]), (p[0] - 6.0).hypot(p[1]));
///         out.copy_from_slice(&[p[0] / near, (p[0] - 6.0) / far, p[1] / near, p[1] / far]); // column by column
///     },
/// );
/// let fit = LeastSquares::new(&circles, &[5.0, 5.0])?.solve(&[1.0, 1.0])?;
/// assert!((fit.parameters[0] - 3.0).abs() < 1e-14 && (fit.parameters[1] - 4.0).abs() < 1e-14);
/// # Ok::<(), herglotz_fit::FitError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FunctionModel<V, J> {
    names: Vec<String>,
    count: usize,
    values: V,
    jacobian: J,
}

impl<V, J> FunctionModel<V, J>
where
    V: Fn(&[f64], &mut [f64]),
    J: Fn(&[f64], &mut DMatrix<f64>),
{
    /// The model with these parameters and this number of values.
    pub fn new<S: Into<String>>(
        names: impl IntoIterator<Item = S>,
        value_count: usize,
        values: V,
        jacobian: J,
    ) -> Self {
        FunctionModel { names: names.into_iter().map(Into::into).collect(), count: value_count, values, jacobian }
    }
}

impl<V, J> Model for FunctionModel<V, J>
where
    V: Fn(&[f64], &mut [f64]),
    J: Fn(&[f64], &mut DMatrix<f64>),
{
    fn parameter_names(&self) -> Vec<String> {
        self.names.clone()
    }
    fn value_count(&self) -> usize {
        self.count
    }
    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        (self.values)(theta, values);
        if let Some(jacobian) = jacobian {
            (self.jacobian)(theta, jacobian);
        }
        Ok(())
    }
    fn evaluates_jointly(&self) -> bool {
        false
    }
}
