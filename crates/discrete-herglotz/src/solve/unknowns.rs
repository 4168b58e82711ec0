//! The directions of a step's unknowns, as modules that duals carry.

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{AugmentedVector, TangentVector};

/// A module of `LEN` directions that can be reached by index: a block of the unknowns of a step.
pub(crate) trait Unknowns: TangentVector<f64> {
    /// The number of directions.
    const LEN: usize;
    /// The element with `value` in direction `i`.
    fn unit(i: usize, value: f64) -> Self;
    /// The component in direction `i`.
    fn get(&self, i: usize) -> f64;
}

/// The mean velocity alone: rules explicit in z.
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

/// The mean velocity and the end action: rules implicit in z.
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
