//! Derivatives of motions: forward, and by the adjoint.

use crate::arrays::{matrix, named, value_error, vector};
use crate::motion::Motion;
use crate::signals::Signals;
use herglotz_runtime::{
    EndCovector, EventAt, Expression, Gradient, LossGradient, RunMonitor, RuntimeError, StateDerivative, Status,
};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use std::ffi::CString;
use std::ops::ControlFlow;

/// Ends a run at a signal.
pub struct SignalMonitor(Signals);

impl RunMonitor for SignalMonitor {
    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        self.0.check()
    }
}

/// Performs a computation with the interpreter lock released. An exception of a signal handler is raised.
pub fn detached<T: Send>(
    py: Python<'_>,
    motion: &Motion,
    work: impl FnOnce(&mut SignalMonitor) -> Result<T, RuntimeError> + Send,
) -> PyResult<T> {
    let mut monitor = SignalMonitor(motion.signals.clone());
    let found = py.detach(|| work(&mut monitor));
    match motion.signals.take() {
        Some(raised) => Err(raised),
        None => found.map_err(value_error),
    }
}

fn not_completed(status: &Status) -> PyErr {
    value_error(format!("the motion has no derivatives, since it was not completed: {status}"))
}

/// The derivatives of q, v and p, each with a row for each time and one variable after the other; those of z; the growth;
/// and the derivatives of the times of sign changes, with a row for each of them.
type Rows = ([Py<PyArray2<f64>>; 3], Py<PyArray2<f64>>, f64, Py<PyArray2<f64>>);

/// The derivatives of a motion at some times, and of the times of sign changes of events, with respect to variables.
#[pyfunction]
pub fn sensitivity(
    py: Python<'_>,
    motion: &Motion,
    variables: Vec<String>,
    times: Vec<f64>,
    crossings: Vec<(usize, f64)>,
) -> PyResult<Rows> {
    let crossings: Vec<EventAt> = crossings.into_iter().map(|(event, t)| EventAt { event, t }).collect();
    let names: Vec<&str> = variables.iter().map(String::as_str).collect();
    let found = detached(py, motion, |monitor| {
        motion.system.sensitivity_with_events(&motion.motion, &names, &times, &crossings, monitor)
    })?;
    if found.status != Status::Completed {
        return Err(not_completed(&found.status));
    }
    let width = motion.system.dimension() * names.len();
    let all = |of: fn(&StateDerivative) -> &[f64]| {
        let numbers = found.rows.iter().flatten().flat_map(|state| of(state).iter().copied()).collect();
        matrix(py, numbers, width)
    };
    let parts = [all(|state| &state.q)?, all(|state| &state.v)?, all(|state| &state.p)?];
    let z = found.rows.iter().flatten().map(|state| state.z).collect();
    let event_times = matrix(py, found.event_times.concat(), names.len())?;
    Ok((parts, matrix(py, z, names.len())?, found.growth, event_times))
}

/// A gradient: in q0, in v0 or p0, in z0, in the parameters, in t0 and in the final time; the growth; and
/// the reason why the steps do not resolve the motion.
type Slopes = (Py<PyArray1<f64>>, Py<PyArray1<f64>>, f64, Vec<f64>, f64, f64, f64, Option<String>);

/// The value and the gradient of a completed motion.
fn slopes(py: Python<'_>, found: LossGradient) -> PyResult<(f64, Slopes)> {
    let Some((value, gradient)) = found.loss else { return Err(not_completed(&found.status)) };
    let (q, velocity) = (vector(py, gradient.q.to_vec()), vector(py, gradient.rate.to_vec()));
    let unresolved = found.unresolved.map(|unresolved| unresolved.to_string());
    let Gradient { z, parameters, t0, t_end, growth, .. } = gradient;
    Ok((value, (q, velocity, z, parameters, t0, t_end, growth, unresolved)))
}

/// The gradient of a number with given partial derivatives in q, v, p and z at some times, row by row.
#[pyfunction]
pub fn pullback(
    py: Python<'_>,
    motion: &Motion,
    times: Vec<f64>,
    parts: [Vec<f64>; 3],
    z: Vec<f64>,
) -> PyResult<Slopes> {
    let [q, v, p] = parts;
    let n = motion.system.dimension();
    let covector = |(i, z): (usize, &f64)| {
        let row = |x: &[f64]| x.get(i * n..(i + 1) * n).map_or_else(|| vec![0.0; n], <[f64]>::to_vec);
        EndCovector { t: 0.0, q: row(&q).into(), v: row(&v).into(), p: row(&p).into(), z: *z }
    };
    let covectors: Vec<EndCovector> = z.iter().enumerate().map(covector).collect();
    let found = detached(py, motion, |monitor| {
        motion.system.gradient(&motion.motion, &times, &mut |_| (0.0, covectors.clone()), monitor)
    })?;
    Ok(slopes(py, found)?.1)
}

/// The value and the gradient of an expression of the final state.
#[pyfunction]
pub fn value_and_gradient(py: Python<'_>, motion: &Motion, loss: &str) -> PyResult<(f64, Slopes)> {
    let expression = loss_of(&motion.system, loss)?;
    let found = detached(py, motion, |monitor| motion.system.end_gradient(&motion.motion, &expression, monitor))?;
    slopes(py, found)
}

/// A loss as an expression of the final state.
pub fn loss_of(system: &herglotz_runtime::System, loss: &str) -> PyResult<Expression> {
    let expression = system.formula().named_expression(loss).map_err(Into::into);
    let expression = named("the loss", loss, expression)?;
    if expression.has_conformal_factor() {
        return Err(value_error(format!(
            "the loss {loss:?} contains `sigma` or `log_factor`, which are not functions of the final state; write it in \
             terms of the state"
        )));
    }
    Ok(expression)
}

/// The exponents, those of the second half, the pairs, the rate, and the defects of the sums of the pairs and of the sum of
/// all.
type Exponents = (Py<PyArray1<f64>>, Py<PyArray1<f64>>, Py<PyArray2<f64>>, f64, Option<f64>, Option<f64>);

/// The Lyapunov exponents of a motion.
#[pyfunction]
pub fn lyapunov_exponents(py: Python<'_>, motion: &Motion) -> PyResult<Exponents> {
    let found = detached(py, motion, |monitor| motion.system.lyapunov_exponents(&motion.motion, monitor))?;
    if found.status != Status::Completed {
        return Err(value_error(format!("the motion has no exponents, since it was not completed: {}", found.status)));
    }
    if let Some(contradiction) = found.contradiction() {
        let message = CString::new(contradiction)?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &message, 2)?;
    }
    let pairs = matrix(py, found.pairs.into_iter().flatten().collect(), 2)?;
    let (exponents, second) = (vector(py, found.exponents), vector(py, found.of_second_half));
    Ok((exponents, second, pairs, found.rate, found.pairing_defect, found.volume_defect))
}
