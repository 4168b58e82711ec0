//! Pullbacks of contact forms, and the conformal factor and conformality defect of a map.

use crate::forms::smooth::apply_transposed;
use crate::{ChartVector, ContactForm, GeometryError, Smooth, numbers::MaxAbsOrNan};
use nalgebra::DMatrix;

/// The pullback of a contact form along a map at a point, compared with a multiple of the contact form there,
/// `F* tau = sigma eta`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conformality<const N: usize> {
    /// The covector `F* tau`.
    pub pullback: ChartVector<N>,
    /// The conformal factor `sigma = (F* tau)(R)`, with R the Reeb field of `eta`.
    pub sigma: f64,
    /// The largest component of `F* tau - sigma eta`, relative to the largest of `F* tau`.
    ///
    /// It is round-off (times the condition number of the Jacobian) for a conformal contactomorphism, and of the size
    /// of the local error for a map that approximates one.
    pub defect: f64,
}

/// Pulls `target` back along a map from the chart of `source`, and measures how conformal the map is at `x`.
///
/// The map is any smooth map given as a generic function, for example one step of an integrator, to test whether it is
/// contact. If only the image and the Jacobian at a point are available, use [`conformality_with_jacobian`].
///
/// # Errors
/// Those of the map and of the forms.
pub fn conformality<const N: usize>(
    source: &impl ContactForm<N>,
    target: &impl ContactForm<N>,
    map: &impl Smooth<N>,
    x: &ChartVector<N>,
) -> Result<Conformality<N>, GeometryError> {
    let (image, jacobian) = map.with_jacobian(x)?;
    conformality_with_jacobian(source, target, x, &image, &jacobian)
}

/// Like [`conformality`], for a map of which the image of `x` and the Jacobian there are known.
///
/// # Errors
/// [`GeometryError::WrongSize`] unless the Jacobian is square of size `2N + 1`, and those of the forms.
pub fn conformality_with_jacobian<const N: usize>(
    source: &impl ContactForm<N>,
    target: &impl ContactForm<N>,
    x: &ChartVector<N>,
    image: &ChartVector<N>,
    jacobian: &DMatrix<f64>,
) -> Result<Conformality<N>, GeometryError> {
    let size = ChartVector::<N>::DIMENSION;
    for found in [jacobian.nrows(), jacobian.ncols()] {
        if found != size {
            return Err(GeometryError::WrongSize { what: "the Jacobian", expected: size, found });
        }
    }
    let pullback = apply_transposed(jacobian, &target.eta(image)?);
    let sigma = pullback.dot(&source.reeb(x)?);
    let (difference, size) = (pullback.minus(source.eta(x)?.scale(sigma)).max_abs_or_nan(), pullback.max_abs_or_nan());
    // The pullback along a constant map is 0, which is conformal with the factor 0.
    let defect = if difference == 0.0 && size == 0.0 { 0.0 } else { difference / size };
    Ok(Conformality { pullback, sigma, defect })
}
