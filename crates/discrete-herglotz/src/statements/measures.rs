//! Measures that the statements share: relative differences, jets at a time, and pullbacks of covectors.

use crate::DiscreteLagrangian;
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ChartVector, DiscretePoint, GeometryError, SecondDiscreteJet,
    numbers::{MaxAbsOrNan, MaxOrNan},
};

/// The difference of two elements relative to the larger of them.
pub(super) fn relative<const N: usize>(a: impl Into<ChartVector<N>>, b: impl Into<ChartVector<N>>) -> f64 {
    let (a, b) = (a.into(), b.into());
    a.minus(b).max_abs_or_nan() / a.max_abs_or_nan().max_or_nan(b.max_abs_or_nan())
}

/// The difference of two vectors relative to a size.
pub(super) fn relative_vector<const N: usize>(a: SVector<f64, N>, b: SVector<f64, N>, size: f64) -> f64 {
    (a - b).max_abs_or_nan() / size
}

/// The second jet of a discrete Lagrangian at a time, as a function of the point.
pub(super) fn jets<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
) -> impl Fn(&DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, GeometryError> {
    move |x| Ok(ld.second_jet(t, x)?)
}

/// The pullback of a covector along a Jacobian.
pub(super) fn pull<const N: usize>(jacobian: &DMatrix<f64>, covector: &ChartVector<N>) -> ChartVector<N> {
    let image = jacobian.tr_mul(&covector.to_vector());
    ChartVector::from_fn(|i| image[i])
}
