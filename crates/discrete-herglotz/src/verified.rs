//! The declared structure of a Lagrangian, after a probe.

use crate::InputError;
use contact_geom::{Defect, GeometryError, Lagrangian, Structure, VelocityPoint};

/// The bound on derivatives that a claim says vanish, relative to the size of their terms: some thousand units of round-off, for
/// Lagrangians whose constants are themselves rounded.
pub(crate) const PROBE: f64 = 1e-12;

/// The structure that a Lagrangian claims, after a probe at two points near a start: what a method that skips work relies on.
///
/// # Errors
/// [`InputError::FalseClaim`] with the first claim that does not hold; [`InputError::Geometry`] where L is defined at neither
/// point.
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
    let at_both = [start, &beside].map(|x| structure.defects(lagrangian, t, x));
    if at_both.iter().all(Option::is_none) {
        return Err(GeometryError::Undefined { what: "the Lagrangian" }.into());
    }
    match at_both.into_iter().flatten().flatten().find(|d| d.size > PROBE) {
        Some(Defect { claim, size }) => Err(InputError::FalseClaim { claim, size }),
        None => Ok(structure),
    }
}
