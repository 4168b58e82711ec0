//! Splittings of rigid bodies.

/// Explicit splittings of a rigid body.
pub struct RigidBodySplitting;
