//! The corner conditions at a jump of the Lagrangian.

use super::surfaces::{Surfaces, TimedState};
use crate::{Point, StepError, System, Vector};
use contact_geom::nalgebra::{DMatrix, DVectorViewMut};
use contact_geom::{
    numbers::{max_abs_or_nan, max_or_nan},
    support::linear,
};

/// The distance from the surface at which L is evaluated on one side, relative to the position and to its change in a
/// step: far larger than the round-off of a position, and small enough that continuous functions change little over it.
const SURFACE_DISTANCE: f64 = 1e-9;

/// A second distance, in units of [`SURFACE_DISTANCE`]: closer to the surface a jump keeps its size, while the
/// difference of a continuous function decreases to this fraction.
const NEAR_DISTANCE: f64 = 0.125;

/// The part of a difference that a jump keeps at [`NEAR_DISTANCE`] at least.
const MIN_KEPT_JUMP: f64 = 0.7;

/// The size of a correction, relative to the number, below which corrections that no longer decrease are the round-off
/// of the extrapolation to the surface.
const STAGNATION_ROUND_OFF: f64 = 1e-10;

/// The least difference of L between both sides that counts as a jump, in units of the round-off of its terms: for the
/// sums in L and the extrapolation.
const JUMP_ROUNDINGS: f64 = 256.0;

/// The step, relative to the coordinates, of the differences for the normal of a surface. With differences of order six
/// the error is the round-off of the function divided by this, 1e-13.
const DIFFERENCE_STEP: f64 = 1e-3;

/// The largest number of Newton iterations for one number or one velocity: bisection would need as many.
const MAX_ITERATIONS: usize = 60;

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

/// The one-sided limit of L at a surface, extrapolated from three points on that side with an error of third order in
/// their distance.
struct OneSided<'a> {
    system: &'a dyn System,
    t: f64,
    z: f64,
    points: [Vector; 3],
}

/// The weights of the extrapolation from the distances 1, 2, 3 to 0.
const WEIGHTS: [f64; 3] = [3.0, -3.0, 1.0];

impl<'a> OneSided<'a> {
    fn new(system: &'a dyn System, at: &TimedState, toward: &Vector) -> Self {
        let points = [1.0, 2.0, 3.0].map(|k| &at.state.q + toward * k);
        OneSided { system, t: at.t, z: at.state.z, points }
    }

    fn points<'s>(&'s self, v: &'s Vector) -> impl Iterator<Item = (f64, Point)> + 's {
        let point = |q: &Vector| Point { q: q.clone(), v: v.clone(), z: self.z };
        WEIGHTS.into_iter().zip(&self.points).map(move |(weight, q)| (weight, point(q)))
    }

    fn value(&self, v: &Vector) -> f64 {
        self.points(v).map(|(weight, x)| weight * self.system.value(self.t, &x)).sum()
    }

    fn momentum(&self, v: &Vector) -> Vector {
        let of = |(weight, x): (f64, Point)| self.system.gradient(self.t, &x).y * weight;
        self.points(v).map(of).fold(Vector::zeros(v.len()), |sum, p| sum + p)
    }

    fn mass(&self, v: &Vector) -> DMatrix<f64> {
        let of = |(weight, x): (f64, Point)| self.system.hessian(self.t, &x).vv * weight;
        self.points(v).map(of).fold(DMatrix::zeros(v.len(), v.len()), |sum, w| sum + w)
    }

    /// The velocity of a momentum, by Newton's method from a guess, and the energy.
    fn velocity(&self, p: &Vector, guess: &Vector) -> Result<(Vector, f64), StepError> {
        let (mut v, mut before) = (guess.clone(), f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            let mut change = self.momentum(&v) - p;
            solve(self.mass(&v), &mut change)?;
            v -= &change;
            let size = max_abs_or_nan(change.iter().copied());
            if !size.is_finite() {
                return Err(StepError::NonFinite);
            }
            // The corrections decrease down to the round-off of the extrapolation.
            if size <= f64::EPSILON * max_abs_or_nan(v.iter().copied())
                || (size >= before && size <= STAGNATION_ROUND_OFF * max_abs_or_nan(v.iter().copied()))
            {
                let energy = p.dot(&v) - self.value(&v);
                return Ok((v, energy));
            }
            before = size;
        }
        Err(StepError::NotConverged { residual: before, iterations: MAX_ITERATIONS as u32 })
    }
}

/// Solves a linear system; the solution overwrites the right-hand side.
fn solve(mut w: DMatrix<f64>, x: &mut Vector) -> Result<(), StepError> {
    let n = x.len();
    linear::solve(&mut w, &mut DVectorViewMut::from_slice(x, n)).map_err(|e| StepError::Singular { pivot: e.pivot })?;
    Ok(())
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
pub(super) fn corner(
    system: &dyn System,
    surfaces: &mut Surfaces,
    index: usize,
    at: &TimedState,
    max_displacement: f64,
) -> Result<Corner, StepError> {
    let (x, side, n) = (at.point(), surfaces.side(index), at.v.len());
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
    let along_v = max_abs_or_nan((0..n).map(|i| of(&|by| (at.t, faster(i, by)), DIFFERENCE_STEP * unit(x.v[i]))));
    let along_z = of(&|by| (at.t, Point { z: x.z + by, ..x.clone() }), DIFFERENCE_STEP * unit(x.z));
    let rate_t = of(&|by| (at.t + by, x.clone()), DIFFERENCE_STEP * unit(at.t));

    let size = normal.norm();
    let one_sided = |toward: f64, of: f64| {
        let length = SURFACE_DISTANCE * scale(max_abs_or_nan(x.q.iter().copied()));
        OneSided::new(system, at, &(&normal * (toward * side * length * of / size)))
    };
    if size == 0.0 {
        // The surface does not depend on the position. If it depends on time alone, z and the momentum are continuous;
        // if it depends on the velocity or z, both sides are compared along these.
        let depends = along_v != 0.0 || along_z != 0.0;
        return if depends && jumps_along(system, at, index, surfaces) {
            Err(StepError::JumpAlong { t: at.t })
        } else {
            Ok(Corner::Continuous)
        };
    }
    let jump = |of: f64| one_sided(-1.0, of).value(&x.v) - one_sided(1.0, of).value(&x.v);
    let (wide, near) = (jump(1.0), jump(NEAR_DISTANCE));
    let (old, new) = (one_sided(1.0, NEAR_DISTANCE), one_sided(-1.0, NEAR_DISTANCE));
    let terms = old.value(&x.v).abs() + at.state.p.dot(&x.v).abs();
    if near.abs() <= JUMP_ROUNDINGS * f64::EPSILON * terms || near.abs() < MIN_KEPT_JUMP * wide.abs() {
        return Ok(Corner::Continuous);
    }
    if !near.is_finite() {
        return Err(StepError::NonFinite);
    }
    if along_v != 0.0 || along_z != 0.0 {
        return Err(StepError::JumpAlong { t: at.t });
    }
    let (v, energy) = old.velocity(&at.state.p, &x.v)?;
    let approach = normal.dot(&v) + rate_t;
    match conditions(&new, at, (&normal, rate_t), energy, (0.0, &v), approach)? {
        Some(p) => Ok(Corner::Refracted(p)),
        None => {
            let mut across = normal.clone();
            solve(old.mass(&v), &mut across)?;
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

/// Whether L or its momenta jump across a surface that does not depend on the position but on the velocity or z.
fn jumps_along(system: &dyn System, at: &TimedState, index: usize, surfaces: &mut Surfaces) -> bool {
    let x = at.point();
    let speed = max_abs_or_nan(x.v.iter().copied());
    let length = |of: f64| SURFACE_DISTANCE * of * if speed > 0.0 { speed } else { 1.0 };
    let moved = |by: f64| Point { v: x.v.map(|v| v + by), z: x.z + by, q: x.q.clone() };
    let here = |by: f64| system.value(at.t, &moved(by));
    let crossed = |surfaces: &mut Surfaces, by: f64| surfaces.value(system, index, (at.t, &moved(by)));
    // A jump is looked for only if the function changes its sign along the diagonal of the velocities and z.
    if crossed(surfaces, length(1.0)) * crossed(surfaces, -length(1.0)) >= 0.0 {
        return false;
    }
    let jump = |of: f64| {
        let [a, b] = [length(of), -length(of)].map(|by| system.gradient(at.t, &moved(by)).y);
        max_or_nan(max_abs_or_nan((a - b).iter().copied()), (here(length(of)) - here(-length(of))).abs())
    };
    let (wide, near) = (jump(1.0), jump(NEAR_DISTANCE));
    let terms = here(0.0).abs() + max_abs_or_nan(at.state.p.iter().copied());
    near > JUMP_ROUNDINGS * f64::EPSILON * terms && near >= MIN_KEPT_JUMP * wide
}
