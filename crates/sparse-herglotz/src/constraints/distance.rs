//! Rods: fixed distances of points.

use super::LocalConstraint;
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// A rigid rod without mass between two points a and b of a line, a plane or space, `|x_b - x_a|^2 - l^2 = 0`, with the
/// length l as parameter. An element is `[a, b]`, `[a_x, a_y, b_x, b_y]` and so on; with
/// [`FIXED`](crate::FIXED) components of a, the rod is attached to the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance;

/// A rigid rod without mass between a point x and a fixed point a, `|x - a|^2 - l^2 = 0`, in a plane with the parameters
/// `[a_x, a_y, l]`, in space with `[a_x, a_y, a_z, l]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceToPoint;

macro_rules! distance {
    ($($d:literal, $k:literal;)*) => {$(
        impl LocalConstraint<$k, 1> for Distance {
            #[inline(always)]
            fn value<T: Scalar>(&self, q: &SVector<T, $k>, c: &[T; 1]) -> T {
                (0..$d).fold(-(c[0] * c[0]), |sum, i| sum + (q[$d + i] - q[i]) * (q[$d + i] - q[i]))
            }
            #[inline(always)]
            fn gradient(&self, q: &SVector<f64, $k>, _c: &[f64; 1]) -> SVector<f64, $k> {
                SVector::from_fn(|i, _| 2.0 * (q[i] - q[(i + $d) % $k]))
            }
        }
    )*};
}
distance! { 1, 2; 2, 4; 3, 6; }

macro_rules! distance_to_point {
    ($($d:literal, $p:literal;)*) => {$(
        impl LocalConstraint<$d, $p> for DistanceToPoint {
            #[inline(always)]
            fn value<T: Scalar>(&self, q: &SVector<T, $d>, c: &[T; $p]) -> T {
                (0..$d).fold(-(c[$d] * c[$d]), |sum, i| sum + (q[i] - c[i]) * (q[i] - c[i]))
            }
            #[inline(always)]
            fn gradient(&self, q: &SVector<f64, $d>, c: &[f64; $p]) -> SVector<f64, $d> {
                SVector::from_fn(|i, _| 2.0 * (q[i] - c[i]))
            }
        }
    )*};
}
distance_to_point! { 2, 3; 3, 4; }
