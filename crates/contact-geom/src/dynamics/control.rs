//! What happens at a surface that a motion reaches.

use crate::VelocityPoint;

/// What happens where a motion reaches the zero of a [switching function](crate::Lagrangian::switching_functions).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Control<const N: usize> {
    /// The motion continues: across the surface where L is continuous, and by the corner conditions where L jumps.
    Continue,
    /// The state is replaced by `(q, v, z)`, and the motion continues from there.
    Replace(VelocityPoint<N>),
    /// The run ends.
    Stop,
}
