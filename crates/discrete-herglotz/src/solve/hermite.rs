//! Cubic Hermite interpolation of a motion.

use crate::Point;

/// The cubic Hermite interpolant of two points with their velocities, at the time `at` after the first point;
/// extrapolated linearly outside the span. The action is interpolated linearly.
pub(crate) fn hermite(start: &Point, end: &Point, span: f64, at: f64) -> Point {
    // Time in units of the span, which is negative in a run backward in time.
    let u = at / span;
    if u <= 0.0 {
        return Point { q: &start.q + &start.v * at, v: start.v.clone(), z: start.z };
    }
    if u >= 1.0 {
        return Point { q: &end.q + &end.v * (at - span), v: end.v.clone(), z: end.z };
    }
    let left = 1.0 - u;
    let q = &start.q * (left * left * (1.0 + 2.0 * u))
        + &end.q * (u * u * (1.0 + 2.0 * left))
        + (&start.v * left - &end.v * u) * (span * u * left);
    let v = (&end.q - &start.q) * (6.0 * u * left / span)
        + &start.v * (left * (1.0 - 3.0 * u))
        + &end.v * (u * (3.0 * u - 2.0));
    Point { q, v, z: start.z * left + end.z * u }
}
