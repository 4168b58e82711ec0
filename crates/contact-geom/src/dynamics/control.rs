//! What happens at a surface that a motion reaches.

use crate::VelocityPoint;

/// What happens where a motion reaches the zero of a [switching function](crate::Lagrangian::switching_functions).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Control<const N: usize> {
    /// The motion continues: across the surface where L is continuous, and by the corner conditions where L jumps.
    Continue,
    /// The state is replaced by `(q, v, z)`, and the motion continues from there. No contact form is preserved.
    Replace(VelocityPoint<N>),
    /// The state is replaced by a map that is conformally contact on the surface: it multiplies `dz - p dq + H dt` by
    /// the factor. See [`Impact`](crate::switching::Impact).
    Conformal {
        /// The state after it.
        to: VelocityPoint<N>,
        /// The factor, 1 for an elastic impact.
        factor: f64,
    },
}
