//! A cubic potential, with a count of the evaluations.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};
use std::sync::atomic::{AtomicUsize, Ordering};

/// `v^2/2 + q^3/3 - z/10`, with a count of the evaluations of L: for long steps the stage equations have no solution.
#[derive(Debug)]
pub(crate) struct Cubic {
    pub count: AtomicUsize,
    pub claims: Structure,
}

impl Lagrangian<1> for Cubic {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.count.fetch_add(1, Ordering::Relaxed);
        v[0] * v[0] * 0.5 + q[0].powi(3) / 3.0 - z * 0.1
    }
    fn structure(&self) -> Structure {
        self.claims
    }
}
