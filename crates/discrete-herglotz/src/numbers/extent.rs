//! The size of vectors over a scalar.

use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::MaxOrNan;

/// The largest value or differential of the entries; not finite where one of them is not.
pub(crate) fn extent<T: Scalar, const N: usize>(x: &SVector<T, N>) -> f64 {
    x.iter().fold(0.0, |largest, x| f64::max_or_nan(largest, x.extent()))
}
