//! Motions that are interrupted: impacts, resets, and named times of kinks and jumps.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used)]

#[path = "motions/draws.rs"]
mod draws;

mod resets {
    mod breaks;
    mod campaign;
    mod contact;
    mod impacts;
    mod lagrangians;
    mod runs;
}

use contact_geom::switching::Surface;
use contact_geom::{Scalar, nalgebra::SVector};

/// The half line `q_N >= 0`.
#[derive(Clone, Copy, Debug)]
pub struct Floor;

impl<const N: usize> Surface<N> for Floor {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>) -> T {
        q.iter().last().copied().unwrap_or(T::zero())
    }
}
