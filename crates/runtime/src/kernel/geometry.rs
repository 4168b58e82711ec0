//! The geometry at a point.

use super::sized::{Sized, coordinates};
use crate::{Geometry, RuntimeError, Start};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ChartVector, ContactForm, Derivatives, Lagrangian, LagrangianForm, Regularity, VelocityPoint, herglotz_field,
    legendre,
};
use formula_lagrangian::FormulaLagrangian;

/// The components of a vector on TQ x R in the first n coordinates.
fn components<const N: usize>(x: &ChartVector<N>, n: usize) -> Vec<f64> {
    [coordinates(x.x.as_slice(), n), coordinates(x.y.as_slice(), n), &[x.z]].concat()
}

/// The factor by which `eta ^ (d eta)^n = (-1)^(n(n-1)/2) n! det W`, evaluated on the coordinate vectors, grows when n
/// coordinates are extended to `all` and W is the identity on the additional ones.
fn added(n: usize, all: usize) -> f64 {
    (n + 1..=all).map(|k| if k.is_multiple_of(2) { -(k as f64) } else { k as f64 }).product()
}

pub(super) fn at<const N: usize>(
    system: &Sized<FormulaLagrangian<N>, N>,
    at: &Start,
) -> Result<Geometry, RuntimeError> {
    let problem = system.problem(at)?;
    let (lagrangian, t, x, n) = (&system.0, at.t, problem.start(), system.0.formula().dimension());
    let form = LagrangianForm { lagrangian, t };
    let point = ChartVector::from(*x);
    let (g, w) = (lagrangian.gradient(t, x), lagrangian.hessian(t, x).vv);
    let value = lagrangian.value(t, &x.q, &x.v, x.z);
    let p = legendre(lagrangian, t, x).p;
    Ok(Geometry {
        lagrangian: value,
        momentum: coordinates(p.as_slice(), n).to_vec(),
        energy: p.dot(&x.v) - value,
        rate: g.z,
        mass: w.row_iter().take(n).map(|row| row.iter().take(n).copied().collect()).collect(),
        condition: Regularity::of(DMatrix::from_fn(n, n, |i, j| w[(i, j)])).condition(),
        eta: components(&form.eta(&point)?, n),
        reeb: components(&form.reeb(&point)?, n),
        volume: form.volume(&point)? / added(n, N),
        herglotz_field: components(&herglotz_field(lagrangian, t, x)?, n),
    })
}

/// The Herglotz field at `y = (q, v)` or `y = (q, v, z)`.
pub(super) fn rates<const N: usize>(system: &Sized<FormulaLagrangian<N>, N>, t: f64, y: &[f64], to: &mut [f64]) {
    let n = system.0.formula().dimension();
    let part = |first: usize| {
        SVector::<f64, N>::from_fn(|i, _| if i < n { y.get(first + i).copied().unwrap_or(f64::NAN) } else { 0.0 })
    };
    let x = VelocityPoint { q: part(0), v: part(n), z: y.get(2 * n).copied().unwrap_or(0.0) };
    let Ok(field) = herglotz_field(&system.0, t, &x) else { return to.fill(f64::NAN) };
    let all = coordinates(field.x.as_slice(), n).iter().chain(coordinates(field.y.as_slice(), n)).chain([&field.z]);
    to.iter_mut().zip(all).for_each(|(to, from)| *to = *from);
}
