//! Smooth functions, maps, vector fields and one-forms in a chart, given as generic functions.

use crate::forms::points::seed;
use crate::{ChartVector, Dual, GeometryError, Scalar};
use nalgebra::DMatrix;

/// A smooth real function on a contact manifold, possibly depending on time: a contact Hamiltonian, an observable.
pub trait SmoothFunction<const N: usize> {
    /// The value at time `t` and the point with coordinates `x`.
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T;

    /// The differential `df` at `x`, time held fixed.
    #[inline]
    fn differential<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> ChartVector<N, T> {
        self.value(Dual::constant(t), &seed(x)).d
    }
}

impl<const N: usize, F: SmoothFunction<N>> SmoothFunction<N> for &F {
    #[inline]
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        (**self).value(t, x)
    }
}

/// `2N + 1` components that depend smoothly on a point: the coordinates of a map's image, the components of a vector
/// field or those of a one-form.
pub trait Smooth<const N: usize> {
    /// The components at the point with coordinates `x`.
    ///
    /// # Errors
    /// A [`GeometryError`] where the point is outside the domain.
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError>;

    /// The components at `x` and their derivatives, `J_ij = d(component i) / d(coordinate j)`.
    ///
    /// # Errors
    /// Those of [`at`](Self::at).
    fn with_jacobian(&self, x: &ChartVector<N>) -> Result<(ChartVector<N>, DMatrix<f64>), GeometryError> {
        let image = self.at(&seed(x))?;
        let row = |i: usize| match i {
            _ if i < N => &image.x[i],
            _ if i < 2 * N => &image.y[i - N],
            _ => &image.z,
        };
        let jacobian = DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| row(i).d.component(j));
        Ok((ChartVector::from_fn(|i| row(i).re), jacobian))
    }
}

impl<const N: usize, S: Smooth<N>> Smooth<N> for &S {
    #[inline]
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        (**self).at(x)
    }
}

/// The matrix product `m v`, in the order of the coordinates.
pub(crate) fn apply<const N: usize>(m: &DMatrix<f64>, v: &ChartVector<N>) -> ChartVector<N> {
    let image = m * v.to_vector();
    ChartVector::from_fn(|i| image[i])
}

/// `m^T v`: a covector pulled back along a linear map.
pub(crate) fn apply_transposed<const N: usize>(m: &DMatrix<f64>, v: &ChartVector<N>) -> ChartVector<N> {
    let image = m.tr_mul(&v.to_vector());
    ChartVector::from_fn(|i| image[i])
}
