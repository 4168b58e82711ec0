//! The geometry at a point.

use super::many::ManyCoordinates;
use super::sized::{Sized, coordinates};
use crate::{Geometry, RuntimeError};
use contact_geom::nalgebra::{DVector, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{GeometryError, Regularity, ScalarSystem, VelocityPoint, herglotz_field};
use discrete_herglotz::{Point, System};
use formula_lagrangian::{FormulaDerivatives, FormulaLagrangian};
use std::sync::Arc;

/// The geometry at a point of a formula, whose derivatives may be over more coordinates; see [`Geometry`].
pub(super) fn at(derivatives: &Arc<FormulaDerivatives>, t: f64, x: &Point) -> Result<Geometry, RuntimeError> {
    let (n, all) = (x.q.len(), derivatives.dimension());
    // Coordinates that the formula does not have are at rest.
    let padded = |x: &[f64]| x.iter().copied().chain(std::iter::repeat(0.0)).take(all).collect();
    let x = Point { q: padded(&x.q), v: padded(&x.v), z: x.z };
    let system = ManyCoordinates(derivatives.clone());
    let (l, g, h) = (System::value(&system, t, &x), system.gradient(t, &x), system.hessian(t, &x));
    let (field, _) = system.rates(t, &x)?;
    let w = h.vv.view((0, 0), (n, n)).into_owned();
    let mut reeb = DVector::from_fn(n, |i, _| -h.vz[i]);
    let determinant = solve(&mut w.clone(), &mut reeb)
        .map_err(|error| error.of("W = L_vv", "the Reeb field is defined only for a regular Lagrangian"))?;
    let (zero, one, momentum) = (vec![0.0; n], [1.0], coordinates(&g.y, n));
    let minus: Vec<f64> = momentum.iter().map(|p| -p).collect();
    // `eta ^ (d eta)^n = (-1)^(n(n-1)/2) n! det W`.
    let factor: f64 = (1..=n).map(|k| if k.is_multiple_of(2) { -(k as f64) } else { k as f64 }).product();
    Ok(Geometry {
        lagrangian: l,
        momentum: momentum.to_vec(),
        energy: momentum.iter().zip(&x.v).map(|(p, v)| p * v).sum::<f64>() - l,
        rate: g.z,
        mass: w.row_iter().map(|row| row.iter().copied().collect()).collect(),
        condition: Regularity::of(w).condition(),
        eta: [&minus[..], &zero, &one].concat(),
        reeb: [&zero[..], reeb.as_slice(), &one].concat(),
        volume: factor * determinant,
        herglotz_field: [coordinates(&field.x, n), coordinates(&field.y, n), &[field.z]].concat(),
    })
}

/// The Herglotz field at a point of a formula in many coordinates.
pub(super) fn rates_of_many(system: &ManyCoordinates, t: f64, y: &[f64], to: &mut [f64]) {
    let n = System::dimension(system);
    let part = |first: usize| y.get(first..first + n).unwrap_or(&[]);
    let x = Point { q: part(0).into(), v: part(n).into(), z: y.get(2 * n).copied().unwrap_or(0.0) };
    let field: Result<_, GeometryError> = system.rates(t, &x);
    let Ok((field, _)) = field else { return to.fill(f64::NAN) };
    let all = field.x.iter().chain(&field.y).chain([&field.z]);
    to.iter_mut().zip(all).for_each(|(to, from)| *to = *from);
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
