//! Lie groups as configuration spaces: exponential maps, adjoint actions, trivialised derivatives, and Lagrangians of
//! `(t, g, xi, z)` with the body velocity `xi = g^-1 gdot`.
//!
//! Everything is left-trivialised: a tangent vector at g is `g xi`, a covector is given by its body momentum `Pi`, and
//! the contact form of T\*G x R is `eta = dz - Pi . (g^-1 dg)`. A group is a type without values that implements
//! [`LieGroup`]; its elements have a type of their own, over any [`Scalar`](crate::Scalar):
//!
//! | group | dimension | element | algebra |
//! |---|---|---|---|
//! | [`Rotations`], SO(3) | 3 | [`Rotation`], a unit quaternion | angular velocity |
//! | [`RigidMotions`], SE(3) | 6 | [`RigidMotion`] | angular velocity, then velocity |
//!
//! Formulas branch on the value of a number, so groups are evaluated for one state at a time, not in SIMD lanes.

mod error;
mod forced;
mod inertia;
mod lagrangian;
mod lie_group;
mod parametric;
mod potentials;
mod rigid_body;
mod rigid_motion;
mod rotation;
mod stumpff;
#[cfg(test)]
mod tests;

pub use error::GroupError;
pub use forced::{GroupForce, GroupForced};
pub use inertia::Inertia;
pub use lagrangian::{GroupLagrangian, GroupPartials};
pub use lie_group::LieGroup;
pub use parametric::ParametricGroupLagrangian;
pub use potentials::{GroupPotential, NoPotential, UniformGravity};
pub use rigid_body::RigidBody;
pub use rigid_motion::{RigidMotion, RigidMotions};
pub use rotation::{Rotation, Rotations};
