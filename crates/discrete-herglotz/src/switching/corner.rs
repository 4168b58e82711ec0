//! The corner conditions at a jump of the Lagrangian.

use super::surfaces::{Surfaces, TimedState};
use crate::{StepError, System};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{
    VelocityPoint,
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
#[derive(Clone, Copy, Debug)]
pub(super) enum Corner<const N: usize> {
    /// It crosses the surface with the same momentum, since L is continuous.
    Continuous,
    /// It crosses the surface with this momentum.
    Refracted(SVector<f64, N>),
    /// It stays on its side with this momentum, since its energy does not suffice on the other side.
    Reflected(SVector<f64, N>),
}

/// The one-sided limit of L at a surface, extrapolated from three points on that side with an error of third order in
/// their distance.
struct OneSided<'a, const N: usize> {
    lagrangian: &'a dyn System<N>,
    t: f64,
    z: f64,
    points: [SVector<f64, N>; 3],
}

/// The weights of the extrapolation from the distances 1, 2, 3 to 0.
const WEIGHTS: [f64; 3] = [3.0, -3.0, 1.0];

impl<'a, const N: usize> OneSided<'a, N> {
    fn new(lagrangian: &'a dyn System<N>, at: &TimedState<N>, toward: &SVector<f64, N>) -> Self {
        let points = [1.0, 2.0, 3.0].map(|k| at.state.q + toward * k);
        OneSided { lagrangian, t: at.t, z: at.state.z, points }
    }

    fn points<'s>(&'s self, v: &'s SVector<f64, N>) -> impl Iterator<Item = (f64, VelocityPoint<N>)> + 's {
        WEIGHTS.into_iter().zip(self.points).map(|(weight, q)| (weight, VelocityPoint { q, v: *v, z: self.z }))
    }

    fn value(&self, v: &SVector<f64, N>) -> f64 {
        self.points(v).map(|(weight, x)| weight * self.lagrangian.value(self.t, &x)).sum()
    }

    fn momentum(&self, v: &SVector<f64, N>) -> SVector<f64, N> {
        let of = |(weight, x): (f64, VelocityPoint<N>)| self.lagrangian.gradient(self.t, &x).y * weight;
        self.points(v).map(of).fold(SVector::zeros(), |sum, p| sum + p)
    }

    fn mass(&self, v: &SVector<f64, N>) -> SMatrix<f64, N, N> {
        let of = |(weight, x): (f64, VelocityPoint<N>)| self.lagrangian.hessian(self.t, &x).vv * weight;
        self.points(v).map(of).fold(SMatrix::zeros(), |sum, w| sum + w)
    }

    /// The velocity of a momentum, by Newton's method from a guess, and the energy.
    fn velocity(&self, p: &SVector<f64, N>, guess: &SVector<f64, N>) -> Result<(SVector<f64, N>, f64), StepError> {
        let (mut v, mut before) = (*guess, f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            let mut change = self.momentum(&v) - p;
            linear::solve(&mut self.mass(&v), &mut change).map_err(|e| StepError::Singular { pivot: e.pivot })?;
            v -= change;
            let size = max_abs_or_nan(change.iter().copied());
            if !size.is_finite() {
                return Err(StepError::NonFinite);
            }
            // The corrections decrease down to the round-off of the extrapolation.
            if size <= f64::EPSILON * max_abs_or_nan(v.iter().copied())
                || (size >= before && size <= STAGNATION_ROUND_OFF * max_abs_or_nan(v.iter().copied()))
            {
                return Ok((v, p.dot(&v) - self.value(&v)));
            }
            before = size;
        }
        Err(StepError::NotConverged { residual: before, iterations: MAX_ITERATIONS as u32 })
    }
}

/// The derivative of a switching function along a direction in time, position and velocity, by central differences of
/// order six.
fn slope<const N: usize>(
    lagrangian: &dyn System<N>,
    surfaces: &mut Surfaces,
    index: usize,
    along: impl Fn(f64) -> (f64, VelocityPoint<N>),
    distance: f64,
) -> f64 {
    let mut difference = |k: f64| {
        let [(t, x), (s, y)] = [k * distance, -k * distance].map(&along);
        surfaces.value(lagrangian, index, (t, &x)) - surfaces.value(lagrangian, index, (s, &y))
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
pub(super) fn corner<const N: usize>(
    lagrangian: &dyn System<N>,
    surfaces: &mut Surfaces,
    index: usize,
    at: &TimedState<N>,
    max_displacement: f64,
) -> Result<Corner<N>, StepError> {
    let (x, side) = (at.point(), surfaces.side(index));
    let scale =
        |q: f64| if max_or_nan(q.abs(), max_displacement) > 0.0 { max_or_nan(q.abs(), max_displacement) } else { 1.0 };
    let mut of = |along: &dyn Fn(f64) -> (f64, VelocityPoint<N>), distance: f64| {
        slope(lagrangian, surfaces, index, along, distance)
    };
    let moved =
        |i: usize, by: f64| VelocityPoint { q: SVector::from_fn(|j, _| x.q[j] + if i == j { by } else { 0.0 }), ..x };
    let normal: SVector<f64, N> =
        SVector::from_fn(|i, _| of(&|by| (at.t, moved(i, by)), DIFFERENCE_STEP * scale(x.q[i])));
    let faster =
        |i: usize, by: f64| VelocityPoint { v: SVector::from_fn(|j, _| x.v[j] + if i == j { by } else { 0.0 }), ..x };
    let unit = |v: f64| if v == 0.0 { 1.0 } else { v.abs() };
    let along_v = max_abs_or_nan((0..N).map(|i| of(&|by| (at.t, faster(i, by)), DIFFERENCE_STEP * unit(x.v[i]))));
    let along_z = of(&|by| (at.t, VelocityPoint { z: x.z + by, ..x }), DIFFERENCE_STEP * unit(x.z));
    let rate_t = of(&|by| (at.t + by, x), DIFFERENCE_STEP * unit(at.t));

    let size = normal.norm();
    let one_sided = |toward: f64, of: f64| {
        let length = SURFACE_DISTANCE * scale(max_abs_or_nan(x.q.iter().copied()));
        OneSided::new(lagrangian, at, &(normal * (toward * side * length * of / size)))
    };
    if size == 0.0 {
        // The surface does not depend on the position. If it depends on time alone, z and the momentum are continuous;
        // if it depends on the velocity or z, both sides are compared along these.
        let depends = along_v != 0.0 || along_z != 0.0;
        return if depends && jumps_along(lagrangian, at, index, surfaces) {
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
            let mut w = old.mass(&v);
            let mut across = normal;
            linear::solve(&mut w, &mut across).map_err(|e| StepError::Singular { pivot: e.pivot })?;
            let back = -2.0 * approach / normal.dot(&across);
            let mirrored = v + across * back;
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
fn conditions<const N: usize>(
    side: &OneSided<'_, N>,
    at: &TimedState<N>,
    (normal, rate_t): (&SVector<f64, N>, f64),
    energy: f64,
    (mut lambda, guess): (f64, &SVector<f64, N>),
    approach: f64,
) -> Result<Option<SVector<f64, N>>, StepError> {
    let (mut v, mut before) = (*guess, f64::INFINITY);
    for _ in 0..MAX_ITERATIONS {
        let p = at.state.p + normal * lambda;
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
            return Ok(Some(at.state.p + normal * lambda));
        }
        before = size;
    }
    // Neither a root nor the minimum of the energy was found, so that a reflection cannot be concluded.
    Err(StepError::NotConverged { residual: before, iterations: MAX_ITERATIONS as u32 })
}

/// Whether L or its momenta jump across a surface that does not depend on the position but on the velocity or z.
fn jumps_along<const N: usize>(
    lagrangian: &dyn System<N>,
    at: &TimedState<N>,
    index: usize,
    surfaces: &mut Surfaces,
) -> bool {
    let x = at.point();
    let speed = max_abs_or_nan(x.v.iter().copied());
    let length = |of: f64| SURFACE_DISTANCE * of * if speed > 0.0 { speed } else { 1.0 };
    let moved = |by: f64| VelocityPoint { v: x.v.map(|v| v + by), z: x.z + by, ..x };
    let here = |by: f64| lagrangian.value(at.t, &moved(by));
    let crossed = |surfaces: &mut Surfaces, by: f64| surfaces.value(lagrangian, index, (at.t, &moved(by)));
    // A jump is looked for only if the function changes its sign along the diagonal of the velocities and z.
    if crossed(surfaces, length(1.0)) * crossed(surfaces, -length(1.0)) >= 0.0 {
        return false;
    }
    let jump = |of: f64| {
        let [a, b] = [length(of), -length(of)].map(|by| lagrangian.gradient(at.t, &moved(by)).y);
        max_or_nan(max_abs_or_nan((a - b).iter().copied()), (here(length(of)) - here(-length(of))).abs())
    };
    let (wide, near) = (jump(1.0), jump(NEAR_DISTANCE));
    let terms = here(0.0).abs() + max_abs_or_nan(at.state.p.iter().copied());
    near > JUMP_ROUNDINGS * f64::EPSILON * terms && near >= MIN_KEPT_JUMP * wide
}
