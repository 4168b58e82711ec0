//! Motions of systems of many coordinates.

use crate::arrays::{number, numbers, of_runtime, value_error};
use crate::run::{Record, RowStore, record};
use crate::signals::Signals;
use crate::watch::GivenWatch;
use herglotz_runtime::{
    AnyIntegrator, Bodies, Boundary, InitialVelocity, Lattice, OutputTimes, RuntimeError, SiteMotion, SiteSystem,
    Start, Steps, SumOfTerms,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

/// The arguments of a motion: q0, v0 or p0 as flat arrays, whether it is p0, and z0; t; every; integrator, step, steps;
/// and whether the conformal factor is requested.
type Request<'py> = (
    (Bound<'py, PyAny>, Bound<'py, PyAny>, bool, Bound<'py, PyAny>),
    Bound<'py, PyAny>,
    Option<usize>,
    (String, Option<Bound<'py, PyAny>>, Option<usize>),
    bool,
);

/// Runs a motion of bodies.
#[pyfunction]
#[pyo3(signature = (masses, dimensions, g, gamma, request, watch = None))]
pub fn run_bodies(
    py: Python<'_>,
    masses: Bound<'_, PyAny>,
    dimensions: usize,
    g: Bound<'_, PyAny>,
    gamma: Bound<'_, PyAny>,
    request: Request<'_>,
    watch: GivenWatch,
) -> PyResult<Record> {
    let (masses, g, gamma) = (numbers("masses", &masses)?, number("G", &g)?, number("gamma", &gamma)?);
    let bodies = Bodies { masses, dimensions, g, gamma };
    run(py, (request, watch), || bodies.system())
}

/// Runs a motion of a lattice.
#[pyfunction]
#[pyo3(signature = (formulas, sizes, boundary, parameters, request, watch = None))]
pub fn run_lattice(
    py: Python<'_>,
    formulas: (Vec<String>, String, Option<String>),
    sizes: Vec<usize>,
    boundary: &str,
    parameters: Option<&Bound<'_, PyDict>>,
    request: Request<'_>,
    watch: GivenWatch,
) -> PyResult<Record> {
    let lattice = lattice(formulas, sizes, boundary, parameters)?;
    run(py, (request, watch), || lattice.system())
}

/// The text, the coordinates and the parameters of a system.
type Terms = (String, Vec<String>, BTreeMap<String, f64>);

/// The Lagrangian of bodies as text.
#[pyfunction]
pub fn bodies_terms(
    masses: Bound<'_, PyAny>,
    dimensions: usize,
    g: Bound<'_, PyAny>,
    gamma: Bound<'_, PyAny>,
) -> PyResult<Terms> {
    let (masses, g, gamma) = (numbers("masses", &masses)?, number("G", &g)?, number("gamma", &gamma)?);
    terms(Bodies { masses, dimensions, g, gamma }.sum_of_terms())
}

/// The Lagrangian of a lattice as text.
#[pyfunction]
#[pyo3(signature = (formulas, sizes, boundary, parameters))]
pub fn lattice_terms(
    formulas: (Vec<String>, String, Option<String>),
    sizes: Vec<usize>,
    boundary: &str,
    parameters: Option<&Bound<'_, PyDict>>,
) -> PyResult<Terms> {
    let lattice = lattice(formulas, sizes, boundary, parameters)?;
    lattice.check_parameters().map_err(|error| value_error(of_runtime(error)))?;
    terms(lattice.sum_of_terms())
}

fn terms(found: Result<SumOfTerms, RuntimeError>) -> PyResult<Terms> {
    let SumOfTerms { lagrangian, coordinates, parameters } = found.map_err(|error| value_error(of_runtime(error)))?;
    Ok((lagrangian, coordinates, parameters.into_iter().collect()))
}

fn lattice(
    (coordinates, site, bond): (Vec<String>, String, Option<String>),
    sizes: Vec<usize>,
    boundary: &str,
    parameters: Option<&Bound<'_, PyDict>>,
) -> PyResult<Lattice> {
    let parameters = crate::system::values(parameters)?;
    let boundary: Boundary = boundary.parse().map_err(value_error)?;
    Ok(Lattice { coordinates, site, bond, sizes, boundary, parameters })
}

/// Runs a motion with the interpreter lock released.
fn run(
    py: Python<'_>,
    (request, watch): (Request<'_>, GivenWatch),
    system: impl Send + FnOnce() -> Result<SiteSystem, RuntimeError>,
) -> PyResult<Record> {
    let ((q, velocity, is_momentum, z), t, every, (integrator, step, steps), conformal_factor) = request;
    let velocity = if is_momentum {
        InitialVelocity::Momentum(numbers("p0", &velocity)?)
    } else {
        InitialVelocity::Velocity(numbers("v0", &velocity)?)
    };
    let times = crate::motion::times(&t)?;
    let (Some(&first), Some(&end)) = (times.first(), times.last()) else { return Err(value_error("`t` is empty")) };
    let by: AnyIntegrator = integrator.parse().map_err(value_error)?;
    let steps = match (step, steps) {
        (Some(_), Some(_)) => return Err(value_error("`step` and `steps` are both given: give one of them")),
        (Some(step), None) => Steps::Size(number("step", &step)?),
        (None, Some(count)) => Steps::Count(count),
        (None, None) => {
            return Err(value_error("neither `step` nor `steps` is given: give the length or the number of the steps"));
        }
    };
    let start = Start { t: first, q: numbers("q0", &q)?, velocity, z: number("z0", &z)? };
    let rows = every.map_or(OutputTimes::At(times), OutputTimes::Every);
    let motion = SiteMotion { rows, conformal_factor, ..SiteMotion::new(start, end, by, steps) };
    let (kept, outcome) = py
        .detach(move || {
            let system = system()?;
            let mut kept = RowStore::new(system.dimension(), conformal_factor, Signals::new(), watch);
            let outcome = system.run(&motion, &mut kept)?;
            Ok::<_, RuntimeError>((kept, outcome))
        })
        .map_err(|error| value_error(of_runtime(error)))?;
    record(py, kept, outcome)
}
