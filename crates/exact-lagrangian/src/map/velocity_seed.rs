//! Dual numbers for derivatives with respect to the initial velocity.

use contact_geom::nalgebra::SVector;
use contact_geom::{Dual, VelocityPoint};

/// A point on dual numbers, with the components of the velocity as directions.
pub(crate) fn seeded<const N: usize>(x: &VelocityPoint<N>) -> VelocityPoint<N, Dual<f64, SVector<f64, N>>> {
    let still = Dual::<f64, SVector<f64, N>>::constant;
    let mut y = VelocityPoint { q: x.q.map(still), v: x.v.map(still), z: still(x.z) };
    for i in 0..N {
        y.v[i].d[i] = 1.0;
    }
    y
}
