//! Statements on forces, which the paper does not contain.

use super::{AnyFunction, System};
use crate::{
    ChartVector, Derivatives, Dual, Energy, Force, Forced, GeometryError, Scalar, SmoothFunction, VelocityPoint,
    herglotz_field, numbers::MaxOrNan,
};
use nalgebra::SVector;

/// A force without symmetry that depends on t, q, v and z, for statements about any force.
#[derive(Clone, Copy, Debug)]
pub struct AnyForce(pub f64);

impl<const N: usize> Force<N> for AnyForce {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let at = ChartVector::from(*x);
        SVector::from_fn(|i, _| AnyFunction(self.0 + 0.61 * i as f64).value(t, &at) + (t + x.z * 0.3).sin() * 0.2)
    }
}

/// Statement 42: along a motion with the force f, `E' = L_z E - L_t + f.v`.
pub(super) fn forced_energy<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let forced = Forced { lagrangian: system, force: AnyForce(0.37) };
    let field = herglotz_field(&forced, t, x)?;
    type Line = Dual<f64, SVector<f64, 1>>;
    let moving = |re: f64, slope: f64| -> Line { Dual { re, d: SVector::<f64, 1>::new(slope) } };
    let along = ChartVector::<N, Line> {
        x: SVector::from_fn(|i, _| moving(x.q[i], field.x[i])),
        y: SVector::from_fn(|i, _| moving(x.v[i], field.y[i])),
        z: moving(x.z, field.z),
    };
    let change = Energy(system).value(moving(t, 1.0), &along);
    let in_time = system.value(moving(t, 1.0), &x.q.map(Dual::constant), &x.v.map(Dual::constant), Dual::constant(x.z));
    let gradient = system.gradient(t, x);
    let decay = [gradient.z * change.re, -in_time.d[0], forced.force.value(t, x).dot(&x.v)];
    // The terms of the energy's derivative along the motion: those of its differential.
    let mass = system.hessian(t, x).vv;
    let size = decay.iter().fold(x.v.dot(&(mass * field.y)).abs() + gradient.x.dot(&x.v).abs(), |s, e| s + e.abs());
    Ok((change.d[0] - decay.iter().sum::<f64>()).abs() / size.max_or_nan(f64::MIN_POSITIVE))
}
