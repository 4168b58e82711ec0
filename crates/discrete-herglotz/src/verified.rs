//! The declared structure of a Lagrangian, after a probe.

use crate::InputError;
use contact_geom::{Lagrangian, Structure, VelocityPoint};

/// The bound on derivatives that a claim says vanish, relative to the second derivatives: round-off of second derivatives, with
/// room for Lagrangians that are written with cancellation.
const PROBE: f64 = 1e-9;

/// The structure that a Lagrangian claims, after a probe at two points near a start: what a method that skips work relies on.
///
/// # Errors
/// [`InputError::FalseClaim`] with the first claim that does not hold.
pub fn verified<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    start: &VelocityPoint<N>,
) -> Result<Structure, InputError> {
    let structure = lagrangian.structure();
    // At the start derivatives may vanish by symmetry, as at an equilibrium; beside it they do not.
    let aside = |x: f64, i: usize| x + (0.01 + 0.003 * i as f64) * (1.0 + x.abs());
    let beside = VelocityPoint {
        q: start.q.map_with_location(|i, _, q| aside(q, i)),
        v: start.v.map_with_location(|i, _, v| aside(v, N + i)),
        z: aside(start.z, 2 * N),
    };
    for x in [start, &beside] {
        for defect in structure.defects(lagrangian, t, x) {
            if defect.size.is_nan() || defect.size > PROBE {
                return Err(InputError::FalseClaim { claim: defect.claim, size: defect.size });
            }
        }
    }
    Ok(structure)
}
