//! The exact retractions: the motion from one point to another.

use contact_geom::VelocityPoint;

/// How the motion between two points was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RetractionRoute {
    /// By collocation with both positions given, the least expensive way, which is taken where its iteration contracts.
    Collocation,
    /// By Newton's method on the exponential map.
    Newton,
    /// By Newton's method and continuation from a short time to h, along the straight line between the points.
    Continuation,
}

/// The motion from `q0` to `q1` in time h: `R_h^(e-)` is its start, `R_h^(e+) = phi_h o R_h^(e-)` its end; paper,
/// section 4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Retraction<const N: usize> {
    /// `R_h^(e-)(q0, q1, z0) = (q0, v0, z0)`.
    pub start: VelocityPoint<N>,
    /// `R_h^(e+)(q0, q1, z0) = (q1, v1, z1)`.
    pub end: VelocityPoint<N>,
    /// The action `z1 - z0`, which is the value of `L_h^e`, to relative round-off.
    pub action: f64,
    /// `b = int L_z dt` along the motion.
    pub b: f64,
    /// The time from the start, in multiples of h/32, by which the motion has met a conjugate point. In this case other
    /// motions join the points as well. `None` if the sign of `det dq(t)/dv0` shows no conjugate point; on the route by
    /// collocation it is checked at the end only. [`conjugate_points`](crate::ContactExponential::conjugate_points)
    /// searches more thoroughly, also for points of even multiplicity.
    pub conjugate: Option<f64>,
    /// How it was found.
    pub route: RetractionRoute,
    /// The evaluations of the vector field in the last computation of the motion.
    pub evaluations: u64,
}
