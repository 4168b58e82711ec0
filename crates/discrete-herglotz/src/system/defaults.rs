//! What a [`System`] computes from its value and its derivatives, unless it provides it.

use super::ridders;
use super::{AtState, Components, ExplicitDerivatives, Point, Quantity, State, System, Vector};
use crate::StepError;
use crate::solve::{ITERATION_LIMIT, last_correction};
use contact_geom::numbers::max_abs_or_nan;
use contact_geom::support::linear;
use contact_geom::{Defect, Defects, GeometryError, nalgebra::DVector};

/// The Herglotz vector field `(v, a, L)` with the rate `L_z`: `W a = L_q + f + L_z L_v - L_vt - L_vq v - L_vz L`.
pub(super) fn rates(system: &(impl System + ?Sized), t: f64, x: &Point) -> Result<(Components, f64), GeometryError> {
    let (l, mut g, h) = (system.value(t, x), system.gradient(t, x), system.hessian(t, x));
    if system.hints().forced {
        g.x += system.applied_force(t, x);
    }
    let l_vt = system.in_quantity(Quantity::Time, t, x).gradient.y;
    let mut a = DVector::from_fn(x.q.len(), |i, _| {
        let along: f64 = x.v.iter().enumerate().map(|(j, v)| h.qv[(j, i)] * v).sum();
        g.x[i] + g.z * g.y[i] - l_vt[i] - along - h.vz[i] * l
    });
    let mut w = h.vv;
    let remedy = "the acceleration is defined only for a regular Lagrangian";
    linear::solve(&mut w, &mut a).map_err(|e| e.of("W = L_vv", remedy))?;
    Ok((Components { x: x.v.clone(), y: a.as_slice().into(), z: l }, g.z))
}

/// The number of corrections that do not decrease after which the remaining ones are taken for round-off.
const MAX_STALLED_CORRECTIONS: u32 = 8;

/// The inverse Legendre transformation by Newton's method; see [`legendre_inverse`](crate::theory::legendre_inverse).
pub(super) fn legendre_inverse(
    system: &(impl System + ?Sized),
    t: f64,
    state: &State,
    guess: &[f64],
) -> Result<Point, StepError> {
    let mut x = Point { q: state.q.clone(), v: guess.into(), z: state.z };
    let (mut before, mut stalled) = (f64::INFINITY, 0);
    let mut momenta = system.gradient(t, &x).y;
    for _ in 0..ITERATION_LIMIT {
        let mut change = DVector::from_column_slice(&(&momenta - &state.p));
        let mut w = system.mass_matrix(t, &x);
        if !(max_abs_or_nan(change.iter().copied()) + max_abs_or_nan(w.iter().copied())).is_finite() {
            return Err(StepError::NonFinite);
        }
        linear::solve(&mut w, &mut change).map_err(|e| StepError::Singular { pivot: e.pivot })?;
        let (from, mut change) = (x.v.clone(), Vector::from(change.as_slice()));
        x.v -= &change;
        let (size, scale) = (change.amax(), x.v.amax());
        if !(size + scale).is_finite() {
            return Err(StepError::NonFinite);
        }
        let round_off = f64::EPSILON * scale;
        let stalls = size >= 0.5 * before;
        stalled += u32::from(stalls);
        let left = stalled >= MAX_STALLED_CORRECTIONS && size <= f64::EPSILON.sqrt() * scale;
        if last_correction(size, before, round_off) || (stalls && (size <= 64.0 * round_off || left)) {
            return Ok(x);
        }
        before = size;
        momenta = system.gradient(t, &x).y;
        // A full correction may leave the domain of L.
        for _ in 0..f64::MANTISSA_DIGITS {
            if momenta.amax().is_finite() {
                break;
            }
            change = change * 0.5;
            x.v = &from - &change;
            momenta = system.gradient(t, &x).y;
        }
    }
    Err(StepError::NotConverged { residual: before, iterations: ITERATION_LIMIT })
}

/// L and its derivatives at a state.
pub(super) fn at_state(
    system: &(impl System + ?Sized),
    t: f64,
    state: &State,
    guess: &[f64],
) -> Result<AtState, StepError> {
    let x = system.legendre_inverse(t, state, guess)?;
    let (l, mut g) = (system.value(t, &x), system.gradient(t, &x));
    if system.hints().forced {
        g.x += system.applied_force(t, &x);
    }
    Ok(AtState { x, l, force: g.x, rate: g.z })
}

/// Bounds of the rounding errors of L and of its gradient, if each is a sum of terms that are not larger than L, `v . L_v`
/// and `q . L_q`, or than the component of the gradient.
pub(super) fn rounding(system: &(impl System + ?Sized), t: f64, x: &Point) -> (f64, Components) {
    let (l, g) = (system.value(t, x), system.gradient(t, x));
    let terms = |a: &Vector, b: &Vector| a.iter().zip(b).map(|(a, b)| (a * b).abs()).sum::<f64>();
    let units = |of: &Vector| of.map(|g| ROUNDINGS * f64::EPSILON * g.abs());
    let value = ROUNDINGS * f64::EPSILON * (l.abs() + terms(&x.v, &g.y) + terms(&x.q, &g.x));
    (value, Components { x: units(&g.x), y: units(&g.y), z: ROUNDINGS * f64::EPSILON * g.z.abs() })
}

/// The defect of the claim that `W = L_vv` is constant: its change to a point near another, relative to its size. Other
/// claims are not verified, and a [`Guarded`](super::Guarded) system does not use them.
pub(super) fn claim_defects(system: &(impl System + ?Sized), t: f64, x: &Point) -> Option<Defects> {
    let mut defects = [const { None }; 9];
    if system.structure().constant_mass {
        let moved = |of: &Vector| of.map(|x| x + NEARBY * (1.0 + x.abs()));
        let near = Point { q: moved(&x.q), v: moved(&x.v), z: x.z + NEARBY * (1.0 + x.z.abs()) };
        let [here, there] = [(t, x), (t + NEARBY * (1.0 + t.abs()), &near)].map(|(t, x)| system.mass_matrix(t, x));
        let (change, size) = ((&there - &here).amax(), here.amax());
        if !(change + size).is_finite() {
            return None;
        }
        defects[0] = Some(Defect { claim: "constant_mass", size: change / size });
    }
    Some(defects.into_iter().flatten())
}

/// The relative distance of a point near another.
const NEARBY: f64 = 0.01;

/// The number of rounding errors in a value.
const ROUNDINGS: f64 = 4.0;

/// The derivatives with respect to a quantity, by differences.
pub(super) fn in_quantity(system: &(impl System + ?Sized), of: Quantity, t: f64, x: &Point) -> ExplicitDerivatives {
    let n = x.q.len();
    if of == Quantity::Time && system.structure().autonomous {
        return ExplicitDerivatives::zeros(n);
    }
    let theta = system.parameters();
    let scale = match of {
        Quantity::Time => 1.0,
        Quantity::Parameter(k) => theta.get(k).map_or(0.0, |theta| theta.abs()),
    };
    let found = ridders::derivative(if scale > 0.0 { scale } else { 1.0 }, |by| match of {
        Quantity::Time => Some(numbers(system, t + by, x)),
        Quantity::Parameter(k) => {
            let mut theta = theta.clone();
            *theta.get_mut(k)? += by;
            Some(numbers(&*system.with_parameters(&theta)?, t, x))
        }
    });
    let found = found.unwrap_or_else(|| vec![f64::NAN; 3 * n + 2]);
    let of = |from: usize| Vector::from(&found[from..from + n]);
    ExplicitDerivatives {
        l: found[0],
        gradient: Components { x: of(2), y: of(n + 2), z: found[1] },
        force: of(2 * n + 2),
    }
}

/// L, `L_z`, `L_q`, `L_v` and the applied force at a point.
fn numbers(system: &(impl System + ?Sized), t: f64, x: &Point) -> Vec<f64> {
    let (l, g, f) = (system.value(t, x), system.gradient(t, x), system.applied_force(t, x));
    [&[l, g.z], &g.x[..], &g.y, &f].concat()
}
