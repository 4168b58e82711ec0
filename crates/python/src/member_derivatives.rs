//! Derivatives of the members of ensembles.

use crate::arrays::{matrix, numbers, value_error, vector};
use crate::ensemble::{GivenStarts, Members};
use crate::events::GivenEvent;
use crate::motion::{self, GivenStepControl};
use crate::sensitivity::loss_of;
use crate::signals::{no_report, with_signals};
use crate::system::System;
use herglotz_runtime::{
    EndCovector, Ensemble, Event, Interrupt, LossGradient, MotionState, RuntimeError, Sensitivity, Status,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::atomic::Ordering;

/// The arguments of `ensemble` that members have in common: the system, the starts, the times of the rows, the step
/// control, the parameters that vary and their values, the number of threads, and the events.
type Given<'py> = (
    GivenStarts<'py>,
    Bound<'py, PyAny>,
    GivenStepControl<'py>,
    Vec<String>,
    Vec<Bound<'py, PyAny>>,
    Option<Bound<'py, PyAny>>,
    Vec<GivenEvent<'py>>,
);

/// The members of a system with the resets of the events.
struct Request {
    members: Members,
    times: Vec<f64>,
    system: herglotz_runtime::System,
    events: Vec<Event>,
}

impl Request {
    fn new(system: &System, given: Given<'_>) -> PyResult<Self> {
        let (start, t, step_control, names, values, threads, events) = given;
        let times = motion::times(&t)?;
        let members = Members::new(system, start, &times, &step_control, names, &values, threads)?;
        let (system, events) = crate::events::events(events, system)?;
        Ok(Request { members, times, system, events })
    }

    /// Calls a function with the system with the resets, and the ensemble with the events.
    fn with<R>(&self, then: impl FnOnce(&herglotz_runtime::System, &Ensemble<'_>) -> R) -> R {
        self.members.ensemble(|ensemble| then(&self.system, &Ensemble { events: &self.events, ..ensemble }))
    }
}

/// Performs a computation with the interpreter lock released, and an interrupt that signals set.
fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Interrupt) -> Result<T, RuntimeError> + Send,
) -> PyResult<T> {
    let (found, raised) = with_signals(py, no_report, |ended| {
        let ended = ended.clone();
        work(&Interrupt::when(move || ended.load(Ordering::Relaxed)))
    })?;
    match raised {
        Some(raised) => Err(raised),
        None => found.map_err(value_error),
    }
}

/// The reasons why members have no derivatives, or why these may be wrong, by the index of the member.
type Troubles = Vec<(usize, String)>;

/// The values of the losses; the gradients in q0, in v0 or p0, in z0, in the parameters, in t0 and in the final time; the
/// growth; a row for each member.
type Gradients = (
    Py<PyArray1<f64>>,
    Py<PyArray2<f64>>,
    Py<PyArray2<f64>>,
    Py<PyArray1<f64>>,
    Py<PyArray2<f64>>,
    [Py<PyArray1<f64>>; 3],
    Troubles,
);

fn gradients(
    py: Python<'_>,
    system: &herglotz_runtime::System,
    found: Vec<Result<LossGradient, RuntimeError>>,
) -> PyResult<Gradients> {
    let (n, m) = (system.dimension(), system.formula().parameters().count());
    let (mut values, mut z, mut times) = (Vec::new(), Vec::new(), [const { Vec::new() }; 3]);
    let (mut q, mut velocity, mut parameters, mut troubles) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (index, member) in found.into_iter().enumerate() {
        match member {
            Ok(LossGradient { loss: Some((value, gradient)), unresolved, .. }) => {
                troubles.extend(unresolved.map(|unresolved| (index, unresolved.to_string())));
                values.push(value);
                q.extend(&gradient.q);
                velocity.extend(&gradient.rate);
                z.push(gradient.z);
                parameters.extend(gradient.parameters);
                for (all, x) in times.iter_mut().zip([gradient.t0, gradient.t_end, gradient.growth]) {
                    all.push(x);
                }
            }
            failed => {
                troubles.push((index, failed.map_or_else(|error| error.to_string(), |found| found.status.to_string())));
                for x in times.iter_mut().chain([&mut values, &mut z]) {
                    x.push(f64::NAN);
                }
                q.resize(q.len() + n, f64::NAN);
                velocity.resize(velocity.len() + n, f64::NAN);
                parameters.resize(parameters.len() + m, f64::NAN);
            }
        }
    }
    let times = times.map(|x| vector(py, x));
    let (q, velocity) = (matrix(py, q, n)?, matrix(py, velocity, n)?);
    let parameters =
        if m == 0 { PyArray2::zeros(py, [z.len(), 0], false).unbind() } else { matrix(py, parameters, m)? };
    Ok((vector(py, values), q, velocity, vector(py, z), parameters, times, troubles))
}

/// The gradients of numbers with given partial derivatives in q, v, p and z of the rows of each member, one member after
/// the other.
#[pyfunction]
pub fn ensemble_pullback(
    py: Python<'_>,
    system: &System,
    given: Given<'_>,
    parts: [Bound<'_, PyAny>; 3],
    z: Bound<'_, PyAny>,
) -> PyResult<Gradients> {
    let request = Request::new(system, given)?;
    let (n, k) = (request.system.dimension(), request.times.len());
    let [q, v, p] = &parts;
    let (q, v, p, z) = (numbers("q", q)?, numbers("v", v)?, numbers("p", p)?, numbers("z", &z)?);
    let loss = |index: usize, states: &[MotionState]| {
        let covector = |row: usize| {
            let i = index * k + row;
            let of = |x: &[f64]| x.get(i * n..(i + 1) * n).map_or_else(|| vec![0.0; n], <[f64]>::to_vec);
            EndCovector {
                t: 0.0,
                q: of(&q).into(),
                v: of(&v).into(),
                p: of(&p).into(),
                z: z.get(i).copied().unwrap_or(0.0),
            }
        };
        (0.0, (0..states.len()).map(covector).collect())
    };
    let found = interruptible(py, |interrupt| {
        request.with(|system, ensemble| system.ensemble_gradient(ensemble, &request.times, &loss, Some(interrupt)))
    })?;
    gradients(py, &request.system, found)
}

/// The values and the gradients of an expression of the final state of each member.
#[pyfunction]
pub fn ensemble_value_and_gradient(
    py: Python<'_>,
    system: &System,
    given: Given<'_>,
    loss: &str,
) -> PyResult<Gradients> {
    let request = Request::new(system, given)?;
    let expression = loss_of(&request.system, loss)?;
    let found = interruptible(py, |interrupt| {
        request.with(|system, ensemble| system.ensemble_end_gradient(ensemble, &expression, Some(interrupt)))
    })?;
    gradients(py, &request.system, found)
}

/// The derivatives of q, v and p in the rows of all members with respect to variables: for each member, a row for each
/// time and one variable after the other; those of z; the growths.
type Sensitivities = ([Py<PyArray2<f64>>; 3], Py<PyArray1<f64>>, Py<PyArray1<f64>>, Troubles);

/// The derivatives of the rows of all members with respect to variables.
#[pyfunction]
pub fn ensemble_sensitivity(
    py: Python<'_>,
    system: &System,
    given: Given<'_>,
    variables: Vec<String>,
) -> PyResult<Sensitivities> {
    let request = Request::new(system, given)?;
    let names: Vec<&str> = variables.iter().map(String::as_str).collect();
    let found = interruptible(py, |interrupt| {
        request.with(|system, ensemble| system.ensemble_sensitivity(ensemble, &names, &request.times, Some(interrupt)))
    })?;
    let (n, rows) = (request.system.dimension(), request.times.len() * names.len());
    let (mut parts, mut z) = ([const { Vec::new() }; 3], Vec::new());
    let (mut growths, mut troubles) = (Vec::new(), Vec::new());
    for (index, member) in found.into_iter().enumerate() {
        match member {
            Ok(Sensitivity { status: Status::Completed, rows, growth, unresolved, .. }) => {
                troubles.extend(unresolved.map(|unresolved| (index, unresolved.to_string())));
                for state in rows.iter().flatten() {
                    for (all, x) in parts.iter_mut().zip([&state.q, &state.v, &state.p]) {
                        all.extend_from_slice(x);
                    }
                    z.push(state.z);
                }
                growths.push(growth);
            }
            failed => {
                troubles.push((index, failed.map_or_else(|error| error.to_string(), |found| found.status.to_string())));
                parts.iter_mut().for_each(|all| all.resize(all.len() + rows * n, f64::NAN));
                z.resize(z.len() + rows, f64::NAN);
                growths.push(f64::NAN);
            }
        }
    }
    let [q, v, p] = parts;
    Ok(([matrix(py, q, n)?, matrix(py, v, n)?, matrix(py, p, n)?], vector(py, z), vector(py, growths), troubles))
}
