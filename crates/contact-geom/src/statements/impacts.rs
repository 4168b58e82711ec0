//! Statements on impacts, which the paper does not contain.

use super::System;
use crate::switching::Impact;
use crate::{Derivatives, GeometryError, VelocityPoint, numbers::MaxOrNan};
use nalgebra::SVector;

/// Statements 46 and 47: on vectors tangent to a surface, the law multiplies `dz - p dq + H dt` by its factor.
///
/// The surface passes through the point with a normal without symmetry, moves, and is oriented so that the motion arrives
/// at it. Where the law takes more energy than there is, the residual is 0, since there is no state after the impact.
pub(super) fn impact<const N: usize>(
    system: &impl System<N>,
    law: Impact,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let wave = |i: usize| (1.3 * i as f64 + 0.4).sin();
    let normal = SVector::<f64, N>::from_fn(|i, _| wave(i) + if i + 1 == N { 1.5 } else { 0.0 });
    let approach = normal.dot(&x.v) + 0.1;
    if !(x.q.iter().chain(&x.v).all(|e| e.is_finite()) && x.z.is_finite() && t.is_finite()) {
        return Ok(f64::NAN);
    }
    // A motion that arrives slowly may not arrive after a rounding.
    if approach.abs() < 1e-3 * (normal.abs().dot(&x.v.abs()) + 0.1) {
        return Ok(0.0);
    }
    let (normal, rate) = (normal * -approach.signum(), -0.1 * approach.signum());
    let factor = law.factor().unwrap_or(f64::NAN);
    let Some(y) = law.after(system, t, x, (&normal, rate)) else { return Ok(0.0) };
    let free = SVector::<f64, N>::from_fn(|i, _| wave(i + 7));
    let (dt, dz) = (0.7, -0.4);
    // The vector of the surface: g_q . dq + g_t dt = 0.
    let dq = free - normal * ((normal.dot(&free) + rate * dt) / normal.norm_squared());
    let form = |x: &VelocityPoint<N>, dz: f64| {
        let (value, slope) = system.with_gradient(t, x);
        let (power, work) = (x.v.dot(&slope.y), slope.y.dot(&dq));
        let size = dz.abs() + slope.y.abs().dot(&dq.abs()) + (x.v.abs().dot(&slope.y.abs()) + value.abs()) * dt;
        (dz - work + (power - value) * dt, size)
    };
    let ((before, size), (after, later)) = (form(x, dz), form(&y, factor * dz));
    Ok((after - factor * before).abs() / size.max_or_nan(later))
}
