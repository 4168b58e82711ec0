//! Numerical checks of the claimed structure of a Lagrangian.

use crate::integration::OfTyped;
use crate::system::ForceKind;
use crate::{InputError, Point, State, System, TypedSystem};
use contact_geom::nalgebra::SVector;
use contact_geom::{Defect, ForceStructure, GeometryError, Structure, VelocityPoint, numbers::max_abs_or_nan};

/// Refuses a Lagrangian with an applied force, for a method that takes none.
///
/// # Errors
/// [`InputError::Forced`].
pub fn check_unforced<const N: usize>(system: &dyn TypedSystem<N>, method: &'static str) -> Result<(), InputError> {
    if system.has_force() { Err(InputError::Forced { method }) } else { Ok(()) }
}

/// Refuses a Lagrangian with a force that is no kick, a function of time and positions alone.
///
/// # Errors
/// [`InputError::Forced`].
pub(crate) fn check_kicks(system: &dyn System, method: &'static str) -> Result<(), InputError> {
    if !system.hints().forced || is_of_positions(system) { Ok(()) } else { Err(InputError::Forced { method }) }
}

/// Whether L is separable with a force of time and positions alone, if any.
pub(crate) fn is_separable(system: &dyn System, structure: &Structure) -> bool {
    structure.separable && (!system.hints().forced || is_of_positions(system))
}

/// Whether the applied force depends on time and positions alone; so does a force that does not exist.
fn is_of_positions(system: &dyn System) -> bool {
    matches!(system.force_kind(), ForceKind::None | ForceKind::OfPositions)
}

/// Whether the action may act on the motion by more than a rate that depends on time alone.
pub(crate) fn depends_on_action(system: &dyn System, structure: &Structure) -> bool {
    !structure.is_affine_in_z() || system.hints().forced && system.force_kind() == ForceKind::General
}

/// The bound on derivatives that vanish according to a claim, relative to the size of their terms: some thousand units
/// of round-off, since the constants of a Lagrangian are rounded.
pub(crate) const MAX_CLAIM_DEFECT: f64 = 1e-12;

/// The structure that a Lagrangian claims, verified at an initial point and at a point near it, the second at a time
/// near the initial time. Methods that skip work rely on it. A structure that is proved is not verified.
///
/// # Errors
/// [`InputError::FalseClaim`] with the first claim that does not hold; [`InputError::Geometry`] where L is defined at
/// neither point.
pub fn check_claims<const N: usize>(
    system: &dyn TypedSystem<N>,
    t: f64,
    start: &VelocityPoint<N>,
) -> Result<Structure, InputError> {
    verified_structure(&OfTyped(system), t, &start.into())
}

/// The same for a system whose number of coordinates is known at run time.
pub(crate) fn verified_structure(system: &dyn System, t: f64, start: &Point) -> Result<Structure, InputError> {
    let structure = system.structure();
    let (nearby, n) = (near(start), system.dimension());
    for (t, x) in [(t, start), (shifted(t, 2 * n + 1), &nearby)] {
        if let Some(Defect { claim, size }) = system.force_defect(t, x) {
            return Err(InputError::FalseClaim { claim, size });
        }
    }
    if system.hints().hamiltonian {
        // The claims on the Hamiltonian are verified by the problem, at its state.
        return Ok(structure);
    }
    if system.hints().proved {
        let value = system.value(t, start);
        let undefined = GeometryError::Undefined { what: "the Lagrangian" };
        return if value.is_finite() { Ok(structure) } else { Err(undefined.into()) };
    }
    let at_both = [(t, start), (shifted(t, 2 * n + 1), &nearby)].map(|(t, x)| system.claim_defects(t, x));
    if at_both.iter().all(Option::is_none) {
        return Err(GeometryError::Undefined { what: "the Lagrangian" }.into());
    }
    match at_both.into_iter().flatten().flatten().find(|d| d.size > MAX_CLAIM_DEFECT) {
        Some(Defect { claim, size }) => Err(InputError::FalseClaim { claim, size }),
        None => Ok(structure),
    }
}

/// A number moved by about a hundredth of its size. At a start derivatives may vanish by symmetry, as at an equilibrium,
/// or for a cosine at t = 0; near it they do not.
fn shifted(x: f64, i: usize) -> f64 {
    x + (0.01 + 0.003 * i as f64) * (1.0 + x.abs())
}

/// A point near another.
fn near(x: &Point) -> Point {
    let n = x.q.len();
    let moved = |of: &[f64], first: usize| of.iter().enumerate().map(|(i, x)| shifted(*x, first + i)).collect();
    Point { q: moved(&x.q, 0), v: moved(&x.v, n), z: shifted(x.z, 2 * n) }
}

/// The defect of the declared structure of an applied force, if it is false at a point: the force is compared with its
/// declared form, which does not depend on the action.
pub(crate) fn force_defect<const N: usize>(
    system: &dyn TypedSystem<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Option<Defect> {
    if !system.hints().forced {
        return None;
    }
    let force = system.applied_force(t, x);
    let at_rest = || system.applied_force(t, &VelocityPoint { v: SVector::zeros(), z: shifted(x.z, 2 * N), ..*x });
    let (at_rest, linear, quadratic) = match system.force_structure() {
        ForceStructure::Drag { linear, quadratic } => (at_rest(), linear, quadratic * x.v.norm()),
        ForceStructure::None => (SVector::zeros(), SVector::zeros(), 0.0),
        _ => return None,
    };
    let defect = |i: usize| {
        let drag = (linear[i] + quadratic) * x.v[i];
        let size = force[i].abs() + at_rest[i].abs() + drag.abs();
        if size == 0.0 { 0.0 } else { (force[i] - (at_rest[i] - drag)).abs() / size }
    };
    let size = max_abs_or_nan((0..N).map(defect));
    // The force may not be defined at a point near the start.
    (size > MAX_CLAIM_DEFECT).then_some(Defect { claim: "force_structure", size })
}

/// The first claim that is false at a state `(q, p, z)` of a motion; `guess` is a guess of its velocity. Also `None`
/// where L is not defined, or where the inverse Legendre transformation fails.
pub(crate) fn violated_claim(system: &dyn System, t: f64, state: &State, guess: &[f64]) -> Option<Defect> {
    let hints = system.hints();
    if hints.proved && !(hints.forced && system.has_force()) {
        return None;
    }
    if hints.hamiltonian {
        return system.hamiltonian_defect(t, state);
    }
    let x = system.legendre_inverse(t, state, guess).ok()?;
    if let Some(defect) = system.force_defect(t, &x) {
        return Some(defect);
    }
    if hints.proved {
        return None;
    }
    system.claim_defects(t, &x)?.find(|d| d.size > MAX_CLAIM_DEFECT)
}

/// Verifies the claims at an initial point at this number of times in a span. A false claim on the time dependence
/// shows at all but special times.
///
/// # Errors
/// [`InputError::FalseClaim`] with the first claim that does not hold.
pub(crate) fn check_claims_over(
    system: &dyn System,
    t0: f64,
    span: f64,
    start: &Point,
    times: usize,
) -> Result<(), InputError> {
    let hints = system.hints();
    if hints.proved || hints.hamiltonian {
        return Ok(());
    }
    for i in 1..=times {
        // Multiples of the golden ratio modulo 1, which do not coincide with the zeros of a periodic function.
        let t = t0 + span * (i as f64 * 0.618_033_988_749_894_9).fract();
        let defects = system.claim_defects(t, start).into_iter().flatten();
        if let Some(Defect { claim, size }) = { defects }.find(|d| d.size > MAX_CLAIM_DEFECT) {
            return Err(InputError::FalseClaim { claim, size });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_lagrangians::{Even, OnLine};

    #[test]
    fn a_slope_in_time_that_vanishes_at_the_start_is_seen() {
        for (system, false_claim) in [(Even::Drag, "constant_rate"), (Even::Spring, "autonomous")] {
            let system = OnLine::from(system);
            for t in [0.0, std::f64::consts::PI] {
                let found = check_claims(&system, t, &VelocityPoint::new([1.0], [0.5], 0.2));
                let refused =
                    matches!(found, Err(InputError::FalseClaim { claim, size }) if claim == false_claim && size > 1e-3);
                assert!(refused, "{false_claim} at t = {t}: {found:?}");
            }
        }
    }
}
