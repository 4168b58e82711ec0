//! The arguments of a kick, by which forces are added to velocities.

use discrete_herglotz::support::Drift;

/// The factor by which a force is multiplied when it is added to a velocity.
#[derive(Clone, Copy)]
pub(crate) enum KickFactor<'a> {
    /// The same factor for all unknowns.
    Uniform(f64),
    /// A factor, and the inverse masses of the block by which it is multiplied.
    InverseMasses(f64, &'a [f64]),
}

/// The drift after a kick, and the slice for the new positions of the block.
pub(crate) struct FollowingDrift<'a> {
    pub drift: Drift,
    pub next: &'a mut [f64],
}
