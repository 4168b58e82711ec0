//! Vector types for the derivatives of dual numbers in the directions of a step's unknowns.

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{AugmentedVector, TangentVector};

/// A vector with `LEN` indexed components, one for each direction in a block of the unknowns of a step.
pub(crate) trait Unknowns: TangentVector<f64> {
    /// The number of directions.
    const LEN: usize;
    /// The vector with `value` in direction `i` and 0 in all others.
    fn unit(i: usize, value: f64) -> Self;
    /// The component in direction `i`.
    fn get(&self, i: usize) -> f64;
}

/// The mean velocity alone, for rules explicit in z.
impl<const M: usize> Unknowns for SVector<f64, M> {
    const LEN: usize = M;
    #[inline(always)]
    fn unit(i: usize, value: f64) -> Self {
        let mut unit = Self::null();
        unit[i] = value;
        unit
    }
    #[inline(always)]
    fn get(&self, i: usize) -> f64 {
        self[i]
    }
}

/// The mean velocity and the end action, for rules implicit in z.
impl<const M: usize> Unknowns for AugmentedVector<M> {
    const LEN: usize = M + 1;
    #[inline(always)]
    fn unit(i: usize, value: f64) -> Self {
        let mut unit = Self::null();
        if i < M {
            unit.x[i] = value;
        } else {
            unit.z = value;
        }
        unit
    }
    #[inline(always)]
    fn get(&self, i: usize) -> f64 {
        if i < M { self.x[i] } else { self.z }
    }
}
