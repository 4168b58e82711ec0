//! Paths between given ends.

use crate::arrays::{matrix, number, numbers, table, value_error, vector, whole, word};
use crate::signals::leaving_at_signals;
use crate::system::System;
use herglotz_runtime::{BoundaryProblem, FoundPath, PathStatus};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// A path of k steps between two positions: k + 1 points with momenta and actions.
#[pyclass(frozen, get_all, module = "herglotz._core")]
pub struct PathRecord {
    q: Py<PyArray2<f64>>,
    p: Py<PyArray2<f64>>,
    z: Py<PyArray1<f64>>,
    found: bool,
    status: String,
    residual: f64,
    log_factor: f64,
    regularity: f64,
    error_estimate: Option<f64>,
    unresolved: Option<String>,
    iterations: u32,
}

/// Searches for a path between two positions over a time.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are those of `path`, which names them")]
pub fn search_path(
    py: Python<'_>,
    system: &System,
    q0: Bound<'_, PyAny>,
    q1: Bound<'_, PyAny>,
    span: (Bound<'_, PyAny>, Bound<'_, PyAny>),
    steps: Bound<'_, PyAny>,
    integrator: Bound<'_, PyAny>,
    z0: Bound<'_, PyAny>,
    guess: Option<Bound<'_, PyAny>>,
) -> PyResult<PathRecord> {
    let n = system.inner.dimension();
    let ends = [numbers("q0", &q0)?, numbers("q1", &q1)?];
    for (name, x) in ["q0", "q1"].iter().zip(&ends) {
        if x.len() != n {
            return Err(value_error(format!("`{name}` has {} numbers, but the system has {n} coordinates", x.len())));
        }
    }
    let guess = guess.map(|guess| table("guess", &guess, n)).transpose()?.map(|(_, points)| points);
    let problem = BoundaryProblem {
        ends,
        span: (number("t0", &span.0)?, number("t", &span.1)?),
        z0: number("z0", &z0)?,
        by: word("integrator", &integrator, "\"gauss_4\"")?.parse().map_err(value_error)?,
        steps: whole("steps", &steps, 2)?,
        guess,
    };
    let of = system.inner.clone();
    let found = leaving_at_signals(py, move || of.path(&problem))?.map_err(value_error)?;
    let FoundPath { q, p, z, residual, log_factor, regularity, error_estimate, iterations, .. } = found;
    Ok(PathRecord {
        q: matrix(py, q, n)?,
        p: matrix(py, p, n)?,
        z: vector(py, z),
        found: found.status == PathStatus::Found,
        status: found.status.to_string(),
        residual,
        log_factor,
        regularity,
        error_estimate,
        unresolved: found.unresolved.map(|unresolved| unresolved.to_string()),
        iterations,
    })
}
