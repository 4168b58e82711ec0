//! Systems with constraints: each type is its Lagrangian together with its constraint.

mod chaplygin_sleigh;
mod four_bar;
mod knife_edge;
mod parallel_cranks;
mod rigid_pendulum;
mod rolling_disc;
mod squeezer;

pub use chaplygin_sleigh::ChaplyginSleigh;
pub use four_bar::FourBar;
pub use knife_edge::KnifeEdge;
pub use parallel_cranks::ParallelCranks;
pub use rigid_pendulum::RigidPendulum;
pub use rolling_disc::RollingDisc;
pub use squeezer::Squeezer;

use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The Lagrangian of a uniform rod of unit mass between two points of a vertical plane, without the drag:
/// `(va.va + va.vb + vb.vb)/6 - gravity (ya + yb)/2`.
fn rod<T: Scalar>(a: [T; 2], b: [T; 2], va: [T; 2], vb: [T; 2], gravity: f64) -> T {
    let kinetic = |i: usize| va[i] * va[i] + va[i] * vb[i] + vb[i] * vb[i];
    (kinetic(0) + kinetic(1)) * (1.0 / 6.0) - (a[1] + b[1]) * (0.5 * gravity)
}

/// The square of the distance of two points, minus that of a rod.
fn length<T: Scalar>(a: [T; 2], b: [T; 2], rod: f64) -> T {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x * x + y * y - rod * rod
}

/// The point with this number among the coordinates of points of a plane.
fn point<T: Scalar, const N: usize>(q: &SVector<T, N>, i: usize) -> [T; 2] {
    [q[2 * i], q[2 * i + 1]]
}
