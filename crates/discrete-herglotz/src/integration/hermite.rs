//! Cubic Hermite interpolation of a motion.

use crate::{Point, Vector};

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
    let [of_start, of_end, of_slopes] = [left * left * (1.0 + 2.0 * u), u * u * (1.0 + 2.0 * left), span * u * left];
    let q = Vector::from_fn(start.q.len(), |i| {
        start.q[i] * of_start + end.q[i] * of_end + (start.v[i] * left - end.v[i] * u) * of_slopes
    });
    let [of_change, at_start, at_end] = [6.0 * u * left / span, left * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)];
    let v = Vector::from_fn(start.q.len(), |i| {
        (end.q[i] - start.q[i]) * of_change + start.v[i] * at_start + end.v[i] * at_end
    });
    Point { q, v, z: start.z * left + end.z * u }
}
