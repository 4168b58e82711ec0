//! The exact discrete Lagrangian, the contact exponential map and its inverse.

use crate::arrays::{number, numbers, value_error};
use crate::signals::leaving_at_signals;
use crate::system::System;
use ::exact_lagrangian::ExactLagrangian;
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{DiscretePoint, Regularity, VelocityPoint};
use discrete_herglotz::DiscreteLagrangian;
use formula_lagrangian::Formula;
use herglotz_runtime::RuntimeError;
use pyo3::prelude::*;

/// The map or function to be evaluated.
#[derive(Clone, Copy, PartialEq)]
enum What {
    Exponential,
    Retraction,
    Lagrangian,
}

/// What is computed here, in messages.
const EXACT: &str = "exponential maps, their inverses and exact Lagrangians";

/// A time, two vectors and an action, validated.
struct At {
    h: f64,
    t: f64,
    first: Vec<f64>,
    second: Vec<f64>,
    z: f64,
}

/// The vectors and numbers of a result.
type Found = (Vec<Vec<f64>>, Vec<f64>);

fn found<const N: usize>(formula: &Formula, what: What, at: &At) -> PyResult<Found> {
    // The additional coordinates of a larger dimension are at rest and not visible.
    let n = formula.dimension();
    let vector = |x: &[f64]| SVector::<f64, N>::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0));
    let list = |x: &SVector<f64, N>| x.iter().take(n).copied().collect::<Vec<f64>>();
    let lagrangian = formula.lagrangian_within::<N>().map_err(value_error)?;
    let exact = ExactLagrangian::<_, N>::new(&lagrangian, at.h).map_err(value_error)?;
    let (first, second) = (vector(&at.first), vector(&at.second));
    if what == What::Exponential {
        let x = VelocityPoint { q: first, v: second, z: at.z };
        let differential = exact.exponential().differential(at.t, &x).map_err(value_error)?;
        let smallest = Regularity::of(DMatrix::from_fn(n, n, |i, j| differential.v[(i, j)])).smallest;
        return Ok((vec![list(&differential.image.q1)], vec![smallest]));
    }
    let x = DiscretePoint { q0: first, q1: second, z0: at.z };
    if what == What::Lagrangian {
        let jet = exact.jet(at.t, &x).map_err(value_error)?;
        return Ok((vec![list(&jet.d1), list(&jet.d2)], vec![jet.value, jet.dz, jet.sigma()]));
    }
    let motion = exact.retract(at.t, &x).map_err(value_error)?;
    let vectors = vec![list(&motion.start.v), list(&motion.end.v)];
    Ok((vectors, vec![motion.end.z, motion.action, motion.b.exp()]))
}

fn of_system(
    py: Python<'_>,
    system: &System,
    what: What,
    names: [&str; 2],
    arguments: [Bound<'_, PyAny>; 5],
) -> PyResult<Found> {
    let [h, first, second, z, t] = arguments;
    let (first, second) = (numbers(names[0], &first)?, numbers(names[1], &second)?);
    let at = At { h: number("h", &h)?, t: number("t", &t)?, first, second, z: number("z0", &z)? };
    let (formula, n) = (system.inner.formula().clone(), system.inner.dimension());
    if formula.is_hamiltonian() {
        return Err(value_error(RuntimeError::OfLagrangians { what: EXACT }));
    }
    if formula.constraints() > 0 {
        return Err(value_error(RuntimeError::WithConstraints { what: EXACT }));
    }
    if !system.inner.losses().is_empty() {
        return Err(value_error(format!(
            "the system has a force, and {EXACT} are those of a Lagrangian alone; write the force into the Lagrangian, or \
             use `solve`"
        )));
    }
    for (name, x) in names.iter().zip([&at.first, &at.second]) {
        if x.len() != n {
            return Err(value_error(format!("`{name}` has {} numbers, but the system has {n} coordinates", x.len())));
        }
    }
    leaving_at_signals(py, move || match n {
        1 => found::<1>(&formula, what, &at),
        2 => found::<2>(&formula, what, &at),
        3 => found::<3>(&formula, what, &at),
        4..=8 => found::<8>(&formula, what, &at),
        _ => Err(value_error(format!(
            "the system has {n} coordinates, but the exact Lagrangian is compiled for 1 to 8: write the system in Rust"
        ))),
    })?
}

/// The position after a time h, and the smallest singular value of its derivative with respect to the velocity.
#[pyfunction]
pub fn exponential(py: Python<'_>, system: &System, arguments: [Bound<'_, PyAny>; 5]) -> PyResult<Found> {
    of_system(py, system, What::Exponential, ["q0", "v0"], arguments)
}

/// The velocities at both ends of the motion between two points, the action at its end, and the action and the
/// conformal factor of the motion.
#[pyfunction]
pub fn retract(py: Python<'_>, system: &System, arguments: [Bound<'_, PyAny>; 5]) -> PyResult<Found> {
    of_system(py, system, What::Retraction, ["q0", "q1"], arguments)
}

/// The value and the first derivatives of the exact discrete Lagrangian.
#[pyfunction]
pub fn exact_lagrangian(py: Python<'_>, system: &System, arguments: [Bound<'_, PyAny>; 5]) -> PyResult<Found> {
    of_system(py, system, What::Lagrangian, ["q0", "q1"], arguments)
}
