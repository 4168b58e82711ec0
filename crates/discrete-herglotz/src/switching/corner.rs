//! The corner conditions at a jump of the Lagrangian.

use super::one_sided::{MAX_ITERATIONS, OneSided, STAGNATION_ROUND_OFF};
use super::{step_curve::TimedState, surfaces::Surfaces};
use crate::{Point, State, StepError, System, Vector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};

/// The distance from the surface at which L is evaluated on one side, relative to the position and to its change in a
/// step: far larger than the round-off of a position, and small enough that continuous functions change little over it.
const SURFACE_DISTANCE: f64 = 1e-9;

/// A second distance, in units of [`SURFACE_DISTANCE`]: closer to the surface a jump keeps its size, while the
/// difference of a continuous function decreases to this fraction.
const NEAR_DISTANCE: f64 = 0.125;

/// The part of a difference that a jump keeps at [`NEAR_DISTANCE`] at least.
const MIN_KEPT_JUMP: f64 = 0.7;

/// The least difference of L between both sides that counts as a jump, in units of the round-off of its terms: for the
/// sums in L and the extrapolation.
const JUMP_ROUNDINGS: f64 = 256.0;

/// The step, relative to the coordinates, of the differences for the normal of a surface. With differences of order six
/// the error is the round-off of the function divided by this, 1e-13.
const DIFFERENCE_STEP: f64 = 1e-3;

/// The behaviour of a motion at a zero of a switching function.
#[derive(Clone, Debug)]
pub(super) enum Corner {
    /// It crosses the surface with the same momentum, since L is continuous.
    Continuous,
    /// It crosses the surface with this momentum.
    Refracted(Vector),
    /// It stays on its side with this momentum, since its energy does not suffice on the other side.
    Reflected(Vector),
}

/// The derivative of a switching function along a direction in time, position and velocity, by central differences of
/// order six.
fn slope(
    system: &dyn System,
    surfaces: &mut Surfaces,
    index: usize,
    along: impl Fn(f64) -> (f64, Point),
    distance: f64,
) -> f64 {
    let mut difference = |k: f64| {
        let [(t, x), (s, y)] = [k * distance, -k * distance].map(&along);
        surfaces.value(system, index, (t, &x)) - surfaces.value(system, index, (s, &y))
    };
    let differences = [difference(1.0), difference(2.0), difference(3.0)];
    (45.0 * differences[0] - 9.0 * differences[1] + differences[2]) / (60.0 * distance)
}

/// Solves the corner conditions at a zero of a switching function, for a motion that arrives from its current side;
/// `max_displacement` is a bound for the change of position in a step.
///
/// # Errors
/// [`StepError::JumpAlong`] where L jumps across a surface that depends on the velocity or on z, or where the motion
/// can neither cross the surface nor be reflected; those of the inverse Legendre transformation on either side.
///
/// For a contact Hamiltonian, H and p are in the place of L and v.
pub(super) fn corner(
    system: &dyn System,
    surfaces: &mut Surfaces,
    index: usize,
    at: &TimedState,
    max_displacement: f64,
) -> Result<Corner, StepError> {
    let (x, side, n) = (at.argument(system), surfaces.side(index), at.v.len());
    let scale =
        |q: f64| if max_or_nan(q.abs(), max_displacement) > 0.0 { max_or_nan(q.abs(), max_displacement) } else { 1.0 };
    let mut of = |along: &dyn Fn(f64) -> (f64, Point), distance: f64| slope(system, surfaces, index, along, distance);
    let moved = |i: usize, by: f64| {
        let mut moved = x.clone();
        moved.q[i] += by;
        moved
    };
    let normal = Vector::from_fn(n, |i| of(&|by| (at.t, moved(i, by)), DIFFERENCE_STEP * scale(x.q[i])));
    let faster = |i: usize, by: f64| {
        let mut faster = x.clone();
        faster.v[i] += by;
        faster
    };
    let unit = |v: f64| if v == 0.0 { 1.0 } else { v.abs() };
    let along_v = Vector::from_fn(n, |i| of(&|by| (at.t, faster(i, by)), DIFFERENCE_STEP * unit(x.v[i])));
    let along_z = of(&|by| (at.t, Point { z: x.z + by, ..x.clone() }), DIFFERENCE_STEP * unit(x.z));
    let rate_t = of(&|by| (at.t + by, x.clone()), DIFFERENCE_STEP * unit(at.t));

    let size = normal.norm();
    let one_sided = |toward: f64, of: f64| {
        let length = SURFACE_DISTANCE * scale(max_abs_or_nan(x.q.iter().copied()));
        OneSided::new(system, at, &(&normal * (toward * side * length * of / size)))
    };
    // Written so that a NaN depends.
    let depends = !(max_abs_or_nan(along_v.iter().copied()) == 0.0 && along_z == 0.0);
    if size == 0.0 {
        // The surface does not depend on the position. If it depends on time alone, z and the momentum are continuous;
        // if it depends on the velocity or z, both sides are compared along these.
        return if depends && jumps_along(system, at, (&along_v, along_z)) {
            Err(StepError::JumpAlong { t: at.t })
        } else {
            Ok(Corner::Continuous)
        };
    }
    let jump = |of: f64| one_sided(-1.0, of).value(&x.v) - one_sided(1.0, of).value(&x.v);
    let (wide, near) = (jump(1.0), jump(NEAR_DISTANCE));
    let (old, new) = (one_sided(1.0, NEAR_DISTANCE), one_sided(-1.0, NEAR_DISTANCE));
    let terms = old.value(&x.v).abs() + at.state.p.dot(&at.v).abs();
    if near.abs() <= JUMP_ROUNDINGS * f64::EPSILON * terms || near.abs() < MIN_KEPT_JUMP * wide.abs() {
        return Ok(Corner::Continuous);
    }
    if !near.is_finite() {
        return Err(StepError::NonFinite);
    }
    if depends {
        return Err(StepError::JumpAlong { t: at.t });
    }
    let (v, energy) = old.velocity(&at.state.p, &at.v)?;
    let approach = normal.dot(&v) + rate_t;
    match conditions(&new, at, (&normal, rate_t), energy, (0.0, &v), approach)? {
        Some(p) => Ok(Corner::Refracted(p)),
        None => {
            let across = old.velocity_along((&v, &at.state.p), normal.clone())?;
            let back = -2.0 * approach / normal.dot(&across);
            let mirrored = &v + across * back;
            match conditions(&old, at, (&normal, rate_t), energy, (back, &mirrored), -approach)? {
                Some(p) => Ok(Corner::Reflected(p)),
                None => Err(StepError::JumpAlong { t: at.t }),
            }
        }
    }
}

/// The momentum `p + lambda g_q` with `E = E- - lambda g_t` on a side, with which the switching function changes in the
/// direction of `approach`; `None` where there is none.
///
/// The energy is convex in lambda, and its slope is the rate of the switching function. Newton's method from outside
/// therefore either finds the root or passes the minimum of the energy, where the rate changes its sign.
fn conditions(
    side: &OneSided<'_>,
    at: &TimedState,
    (normal, rate_t): (&Vector, f64),
    energy: f64,
    (mut lambda, guess): (f64, &Vector),
    approach: f64,
) -> Result<Option<Vector>, StepError> {
    let (mut v, mut before) = (guess.clone(), f64::INFINITY);
    for _ in 0..MAX_ITERATIONS {
        let p = &at.state.p + normal * lambda;
        let energy_here;
        (v, energy_here) = side.velocity(&p, &v)?;
        let rate = normal.dot(&v) + rate_t;
        if rate.is_nan() || rate * approach <= 0.0 {
            return Ok(None);
        }
        let change = (energy_here - energy + lambda * rate_t) / rate;
        let size = (change * normal.norm()).abs();
        lambda -= change;
        let scale = max_or_nan(max_abs_or_nan(p.iter().copied()), (lambda * normal.norm()).abs());
        if size <= f64::EPSILON * scale || (size >= before && size <= STAGNATION_ROUND_OFF * scale) {
            return Ok(Some(&at.state.p + normal * lambda));
        }
        before = size;
    }
    // Neither a root nor the minimum of the energy was found, so that a reflection cannot be concluded.
    Err(StepError::NotConverged { residual: before, iterations: MAX_ITERATIONS as u32 })
}

/// Whether L or its momenta, or the contact Hamiltonian, jump across a surface that does not depend on the position; its
/// function has these derivatives in the velocity, or the momentum, and in z.
fn jumps_along(system: &dyn System, at: &TimedState, (along_v, along_z): (&Vector, f64)) -> bool {
    let (x, is_hamiltonian) = (at.argument(system), system.hints().hamiltonian);
    let size = max_or_nan(max_abs_or_nan(along_v.iter().copied()), along_z.abs());
    let speed = max_abs_or_nan(x.v.iter().copied());
    let length = |of: f64| SURFACE_DISTANCE * of * if speed > 0.0 { speed } else { 1.0 } / size;
    let moved = |by: f64| Point { v: &x.v + along_v * by, z: x.z + along_z * by, q: x.q.clone() };
    // The value, and the momenta of a Lagrangian: the velocities of a Hamiltonian may jump.
    let here = |by: f64| {
        let x = moved(by);
        if !is_hamiltonian {
            return (system.value(at.t, &x), system.gradient(at.t, &x).y);
        }
        let value = system.hamiltonian_with_gradient(at.t, &State { q: x.q, p: x.v, z: x.z });
        (value.map_or(f64::NAN, |(h, _)| h), Vector::zeros(at.v.len()))
    };
    let jump = |of: f64| {
        let ((l, p), (m, r)) = (here(length(of)), here(-length(of)));
        max_or_nan(max_abs_or_nan((p - r).iter().copied()), (l - m).abs())
    };
    let (wide, near) = (jump(1.0), jump(NEAR_DISTANCE));
    let terms = here(0.0).0.abs() + max_abs_or_nan(at.state.p.iter().copied());
    near > JUMP_ROUNDINGS * f64::EPSILON * terms && near >= MIN_KEPT_JUMP * wide
}
