//! Paths between given ends.

use crate::arrays::{matrix, number, numbers, table, value_error, vector, whole, word};
use crate::signals::heard_at_once;
use crate::system::System;
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, VelocityPoint, legendre};
use discrete_herglotz::{
    BoundaryPath, CriticalPath, DiscreteLagrangian, DiscretePath, End, Gauss, InputError, legendre_minus, legendre_plus,
};
use formula_lagrangian::Formula;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use runtime_herglotz::{AnyIntegrator, in_words};

/// What is asked of a path, checked.
struct Asked {
    by: AnyIntegrator,
    span: (f64, f64),
    steps: usize,
    ends: [Vec<f64>; 2],
    z0: f64,
    /// The points from which the search starts, one after the other.
    guess: Option<Vec<f64>>,
}

/// The last path of a search, whatever its dimension.
struct Found {
    q: Vec<f64>,
    p: Vec<f64>,
    z: Vec<f64>,
    is_found: bool,
    status: String,
    residual: f64,
    log_factor: f64,
    regularity: f64,
    error_estimate: Option<f64>,
    suspicion: Option<String>,
    iterations: u32,
}

fn within<const N: usize>(formula: &Formula, asked: &Asked) -> PyResult<Found> {
    let lagrangian = formula.lagrangian_within::<N>().map_err(value_error)?;
    let wrong = |error: InputError| value_error(in_words(&error));
    let (t0, t1) = asked.span;
    let h = (t1 - t0) / asked.steps as f64;
    match asked.by {
        AnyIntegrator::Gauss { stages } => {
            search(formula, Gauss::new::<N>(&lagrangian, stages, h).map_err(wrong)?, asked)
        }
        AnyIntegrator::Discrete(method) => {
            // A splitting reads its form at a state.
            let start = VelocityPoint { q: point(&asked.ends[0]), v: SVector::zeros(), z: asked.z0 };
            let state = legendre(&lagrangian, t0, &start);
            search(formula, method.discretise::<N, _>(&lagrangian, h, t0, &state).map_err(wrong)?, asked)
        }
        other => Err(value_error(format!(
            "the integrator {other} has no discrete Lagrangian that is known from both ends of a step: take \"gauss_4\", another of \
             Gauss', or \"midpoint\""
        ))),
    }
}

/// The first coordinates of a vector; what is beyond them is 0.
fn point<const N: usize>(x: &[f64]) -> SVector<f64, N> {
    SVector::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0))
}

fn search<D: DiscreteLagrangian<N>, const N: usize>(formula: &Formula, ld: D, asked: &Asked) -> PyResult<Found> {
    let wrong = |error: InputError| value_error(in_words(&error));
    let (n, t0, h) = (formula.dimension(), asked.span.0, ld.step_size());
    let ends = [0, 1].map(|i| End::Position(point(&asked.ends[i])));
    let mut problem =
        BoundaryPath::new(&ld, asked.steps, ends).and_then(|p| p.starting_at(t0, asked.z0)).map_err(wrong)?;
    if let Some(guess) = &asked.guess {
        let points = guess.chunks_exact(n).map(point).collect();
        let path = DiscretePath::new(points).map_err(value_error)?;
        problem = problem.from_path(path).map_err(wrong)?;
    }
    let found = problem.search();
    let p = momenta(&ld, t0, h, &found);
    let rows = |points: &[SVector<f64, N>]| points.iter().flat_map(|x| x.iter().take(n).copied()).collect();
    Ok(Found {
        q: rows(&found.points),
        p: rows(&p),
        z: found.actions.clone(),
        is_found: found.is_found(),
        status: found.status.to_string(),
        residual: found.residual,
        log_factor: found.log_factor,
        regularity: found.regularity,
        error_estimate: found.error_estimate,
        suspicion: found.suspicion.map(|suspicion| suspicion.to_string()),
        iterations: found.iterations,
    })
}

/// The momenta at the points, by the discrete Legendre transformation of the step before each, that of the first by the step after it. Not
/// numbers where they are not defined, as they are along every path that is found.
fn momenta<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    t0: f64,
    h: f64,
    path: &CriticalPath<N>,
) -> Vec<SVector<f64, N>> {
    let step = |k: usize| {
        Some((
            t0 + k as f64 * h,
            DiscretePoint { q0: *path.points.get(k)?, q1: *path.points.get(k + 1)?, z0: *path.actions.get(k)? },
        ))
    };
    let first = step(0).and_then(|(t, x)| legendre_minus(ld, t, &x).ok()).map(|state| state.p);
    let others = (0..path.points.len().saturating_sub(1))
        .map(|k| step(k).and_then(|(t, x)| legendre_plus(ld, t, &x).ok()).map(|state| state.p));
    std::iter::once(first).chain(others).map(|p| p.unwrap_or_else(|| SVector::repeat(f64::NAN))).collect()
}

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
    suspicion: Option<String>,
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
            return Err(value_error(format!("`{name}` has {} numbers, where the system has {n} coordinates", x.len())));
        }
    }
    let guess = guess.map(|guess| table("guess", &guess, n)).transpose()?.map(|(_, points)| points);
    let asked = Asked {
        by: word("integrator", &integrator, "\"gauss_4\"")?.parse().map_err(value_error)?,
        span: (number("t0", &span.0)?, number("t", &span.1)?),
        steps: whole("steps", &steps, 2)?,
        ends,
        z0: number("z0", &z0)?,
        guess,
    };
    let formula = system.inner.formula().clone();
    let found = heard_at_once(py, move || match n {
        1 => within::<1>(&formula, &asked),
        2 => within::<2>(&formula, &asked),
        3 => within::<3>(&formula, &asked),
        4 => within::<4>(&formula, &asked),
        5..=8 => within::<8>(&formula, &asked),
        _ => Err(value_error(format!(
            "the system has {n} coordinates, where paths between two ends are compiled for 1 to 8: write the system in Rust"
        ))),
    })??;
    Ok(PathRecord {
        q: matrix(py, found.q, n)?,
        p: matrix(py, found.p, n)?,
        z: vector(py, found.z),
        found: found.is_found,
        status: found.status,
        residual: found.residual,
        log_factor: found.log_factor,
        regularity: found.regularity,
        error_estimate: found.error_estimate,
        suspicion: found.suspicion,
        iterations: found.iterations,
    })
}
