//! Motions that are interrupted: impacts, resets, and named times of kinks and jumps.

pub mod breaks;
pub mod campaign;
mod contact;
pub mod impacts;
pub mod runs;

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
