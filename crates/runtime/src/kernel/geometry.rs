//! The geometry at a point.

use super::sized::{Sized, coordinates};
use crate::{Geometry, RuntimeError};
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{Arguments, Regularity, ScalarSystem, Slopes, VelocityPoint, herglotz_field};
use discrete_herglotz::Point;
use formula_lagrangian::{FormulaDerivatives, FormulaLagrangian};

/// What is asked of a regular Lagrangian.
const REMEDY: &str = "the Reeb field and the acceleration are defined only for a regular Lagrangian";

/// A Lagrangian and its derivatives at a point, in the coordinates of its formula.
struct Jet {
    l: f64,
    l_q: DVector<f64>,
    l_v: DVector<f64>,
    l_z: f64,
    l_vq: DMatrix<f64>,
    l_vz: DVector<f64>,
    l_vt: DVector<f64>,
    force: DVector<f64>,
    w: DMatrix<f64>,
}

impl Jet {
    fn at(derivatives: &FormulaDerivatives, t: f64, x: &Point) -> Self {
        let (n, all) = (derivatives.formula().dimension(), derivatives.dimension());
        // Coordinates that the formula does not have are at rest.
        let padded = |x: &[f64]| DVector::from_fn(all, |i, _| x.get(i).copied().unwrap_or(0.0));
        let (q, v) = (padded(&x.q), padded(&x.v));
        let (line, square) = (|| DVector::zeros(all), || DMatrix::zeros(all, all));
        let (mut l_q, mut l_v, mut l_z) = (line(), line(), 0.0);
        let l = derivatives.with_gradient::<f64, 0>(
            t,
            q.as_slice(),
            v.as_slice(),
            x.z,
            Slopes { q: l_q.as_mut_slice(), v: l_v.as_mut_slice(), z: &mut l_z },
        );
        let at = || Arguments { t, q: q.as_slice(), v: v.as_slice(), z: x.z };
        let (mut first_q, mut first_v, mut first_z) = (line(), line(), 0.0);
        let (mut qq, mut qv, mut w, mut qz, mut l_vz, mut zz) = (square(), square(), square(), line(), line(), 0.0);
        derivatives.with_second_derivatives::<f64, 0>(
            at(),
            Slopes { q: first_q.as_mut_slice(), v: first_v.as_mut_slice(), z: &mut first_z },
            [
                qq.as_mut_slice(),
                qv.as_mut_slice(),
                w.as_mut_slice(),
                qz.as_mut_slice(),
                l_vz.as_mut_slice(),
                std::slice::from_mut(&mut zz),
            ],
        );
        let (mut l_tq, mut l_vt, mut l_tz, mut force_t) = (line(), line(), 0.0, line());
        if !derivatives.proved().autonomous {
            let slopes = Slopes { q: l_tq.as_mut_slice(), v: l_vt.as_mut_slice(), z: &mut l_tz };
            derivatives.explicit(None, at(), slopes, force_t.as_mut_slice());
        }
        let mut force = line();
        derivatives.applied_force::<f64, 0>(t, q.as_slice(), v.as_slice(), x.z, force.as_mut_slice());
        let [l_q, l_v, l_vz, l_vt, force] = [l_q, l_v, l_vz, l_vt, force].map(|x| x.rows(0, n).into_owned());
        let [qv, w] = [qv, w].map(|x| x.view((0, 0), (n, n)).into_owned());
        Jet { l, l_q, l_v, l_z, l_vq: qv.transpose(), l_vz, l_vt, force, w }
    }

    /// `W^-1 x` and `det W`.
    fn solved(&self, mut x: DVector<f64>) -> Result<(DVector<f64>, f64), RuntimeError> {
        let determinant = solve(&mut self.w.clone(), &mut x).map_err(|error| error.of("W = L_vv", REMEDY))?;
        Ok((x, determinant))
    }

    /// The Herglotz field `(v, a, L)`: `W a = L_q + f + L_z L_v - L_vt - L_vq v - L_vz L`.
    fn herglotz_field(&self, v: &[f64]) -> Result<Vec<f64>, RuntimeError> {
        let along = &self.l_vq * DVector::from_column_slice(v) + &self.l_vz * self.l + &self.l_vt;
        let (a, _) = self.solved(&self.l_q + &self.force + &self.l_v * self.l_z - along)?;
        Ok([v, a.as_slice(), &[self.l]].concat())
    }
}

/// The geometry at a point; see [`Geometry`].
pub(super) fn at(derivatives: &FormulaDerivatives, t: f64, x: &Point) -> Result<Geometry, RuntimeError> {
    let jet = Jet::at(derivatives, t, x);
    let n = jet.l_v.len();
    let (reeb, determinant) = jet.solved(-&jet.l_vz)?;
    let (zero, one, momentum) = (vec![0.0; n], [1.0], jet.l_v.as_slice());
    let eta = [(-&jet.l_v).as_slice(), &zero, &one].concat();
    // `eta ^ (d eta)^n = (-1)^(n(n-1)/2) n! det W`.
    let volume =
        (1..=n).map(|k| if k.is_multiple_of(2) { -(k as f64) } else { k as f64 }).product::<f64>() * determinant;
    Ok(Geometry {
        lagrangian: jet.l,
        momentum: momentum.to_vec(),
        energy: momentum.iter().zip(&x.v).map(|(p, v)| p * v).sum::<f64>() - jet.l,
        rate: jet.l_z,
        mass: jet.w.row_iter().map(|row| row.iter().copied().collect()).collect(),
        condition: Regularity::of(jet.w.clone()).condition(),
        eta,
        reeb: [zero.as_slice(), reeb.as_slice(), &one].concat(),
        volume,
        herglotz_field: jet.herglotz_field(&x.v)?,
    })
}

/// The Herglotz field at a point of a formula in many coordinates.
pub(super) fn rates_of_many(derivatives: &FormulaDerivatives, t: f64, y: &[f64], to: &mut [f64]) {
    let n = derivatives.formula().dimension();
    let part = |first: usize| y.get(first..first + n).unwrap_or(&[]);
    let x = Point { q: part(0).into(), v: part(n).into(), z: y.get(2 * n).copied().unwrap_or(0.0) };
    match Jet::at(derivatives, t, &x).herglotz_field(&x.v) {
        Ok(field) => to.iter_mut().zip(&field).for_each(|(to, from)| *to = *from),
        Err(_) => to.fill(f64::NAN),
    }
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
