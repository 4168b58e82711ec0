//! The geometry at a point.

use super::Sized;
use crate::{Geometry, RuntimeError, Start};
use contact_geom::{
    ContactForm, Derivatives, Lagrangian, LagrangianForm, Triple, herglotz_field, legendre, regularity,
};

/// The components of a vector on TQ x R.
fn components<const N: usize>(x: &Triple<N>) -> Vec<f64> {
    x.to_vector().as_slice().to_vec()
}

pub(super) fn at<const N: usize>(system: &Sized<N>, at: &Start) -> Result<Geometry, RuntimeError> {
    let problem = system.problem(at)?;
    let (lagrangian, t, x) = (&system.0, at.t, problem.start());
    let form = LagrangianForm { lagrangian, t };
    let point = Triple::from(*x);
    let (g, w) = (lagrangian.gradient(t, x), lagrangian.hessian(t, x).vv);
    let value = lagrangian.value(t, &x.q, &x.v, x.z);
    let p = legendre(lagrangian, t, x).p;
    Ok(Geometry {
        lagrangian: value,
        momentum: p.as_slice().to_vec(),
        energy: p.dot(&x.v) - value,
        rate: g.z,
        mass: w.row_iter().map(|row| row.iter().copied().collect()).collect(),
        condition: regularity(lagrangian, t, x).condition(),
        eta: components(&form.eta(&point)?),
        reeb: components(&form.reeb(&point)?),
        volume: form.volume(&point)?,
        herglotz_field: components(&herglotz_field(lagrangian, t, x)?),
    })
}
