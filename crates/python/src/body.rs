//! Motions of rigid bodies.

use crate::arrays::{matrix, number, numbers, value_error, vector, whole};
use crate::checks::{Checked, checked};
use crate::signals::Signals;
use crate::watch::{GivenWatch, Watch};
use herglotz_runtime::{
    AnyIntegrator, Body, BodyDerivatives, BodyEnsemble, BodyEvent, BodyMember, BodyMotion, BodyOutcome, BodyTorque,
    Crossing, Direction, GroupStatus, OutputTimes, RunMonitor, RuntimeError, StepControl, Steps,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::ops::ControlFlow;

/// An event: its function, its direction, and whether it ends the motion.
type EventRequest = (String, String, bool);

/// The body: inertia as three or nine numbers, mass, centre, gravity, gamma, and the torque.
type BodyRequest<'py> = (
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Bound<'py, PyAny>,
    Option<[String; 3]>,
);

/// The initial attitude, angular velocity and action.
type StartRequest<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// The accuracy; or the integrator, and the length or the number of its steps.
type WayRequest<'py> = (Option<Bound<'py, PyAny>>, Option<String>, Option<Bound<'py, PyAny>>, Option<usize>);

/// Keeps the rows and the sign changes.
struct Kept {
    rows: Vec<f64>,
    crossings: Vec<(usize, Vec<f64>)>,
    signals: Signals,
    watch: Watch,
}

impl RunMonitor for Kept {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.rows.extend_from_slice(numbers);
        ControlFlow::Continue(())
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.crossings.push((crossing.event, crossing.columns.clone()));
        ControlFlow::Continue(())
    }

    fn wants_present(&mut self) -> bool {
        self.watch.is_due()
    }

    fn present(&mut self, numbers: &[f64]) {
        self.watch.present(numbers);
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        self.signals.check()?;
        let (rows, crossings) = (&self.rows, &self.crossings);
        self.watch.poll(part, |py, present| {
            // The record so far, whose last row is the present state.
            let mut rows = rows.clone();
            let last = rows.chunks(Body::COLUMNS.len()).last().and_then(<[f64]>::first);
            if last != present.first() {
                rows.extend_from_slice(present);
            }
            let record = BodyRecord {
                rows: matrix(py, rows, Body::COLUMNS.len())?,
                end: vector(py, present.to_vec()),
                crossings: crossings.clone(),
                status: "in progress".to_owned(),
                success: false,
                integrator: String::new(),
                step_size: f64::NAN,
                steps: None,
                error_estimate: None,
                interrupted: None,
                derivatives: None,
            };
            Ok(Py::new(py, record)?.into_any())
        })
    }
}

/// The derivatives of the end in the start and in the parameters, the logarithm of the conformal factor, and the contact
/// defect.
type DerivativesRecord = (Py<PyArray2<f64>>, Py<PyArray2<f64>>, f64, f64);

/// The record of a motion of a rigid body.
#[pyclass(frozen, get_all, module = "herglotz._core")]
pub struct BodyRecord {
    /// One row for each time, with the columns of the runtime.
    rows: Py<PyArray2<f64>>,
    /// The same for the state that was reached.
    end: Py<PyArray1<f64>>,
    /// The event and the columns of each sign change.
    crossings: Vec<(usize, Vec<f64>)>,
    status: String,
    success: bool,
    integrator: String,
    step_size: f64,
    /// The number of steps; `None` while the motion runs.
    steps: Option<usize>,
    error_estimate: Option<f64>,
    interrupted: Option<Py<PyAny>>,
    /// The derivatives, where they were requested and the run was completed.
    derivatives: Option<DerivativesRecord>,
}

/// Three numbers.
fn triple(name: &str, from: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let found = numbers(name, from)?;
    let count = found.len();
    <[f64; 3]>::try_from(found).map_err(|_| value_error(format!("`{name}` has {count} numbers; it must have 3")))
}

/// The body of a request.
fn body_of((inertia, mass, centre, gravity, gamma, torque): &BodyRequest<'_>) -> PyResult<Body> {
    let inertia = match numbers("inertia", inertia)?.as_slice() {
        [a, b, c] => Body::principal([*a, *b, *c]),
        [a, b, c, d, e, f, g, h, i] => [[*a, *b, *c], [*d, *e, *f], [*g, *h, *i]],
        other => {
            return Err(value_error(format!("`inertia` has {} numbers; it must have 3 or 3 times 3", other.len())));
        }
    };
    let torque = torque.as_ref().map(|torque| BodyTorque::parse(torque.each_ref().map(String::as_str)));
    Ok(Body {
        torque: torque.transpose().map_err(value_error)?,
        inertia,
        mass: number("mass", mass)?,
        centre: triple("centre", centre)?,
        gravity: triple("gravity", gravity)?,
        gamma: number("gamma", gamma)?,
    })
}

/// The steps of a request.
fn step_control(way: WayRequest<'_>) -> PyResult<StepControl> {
    let (accuracy, integrator, step, steps) = way;
    let by = integrator.map(|name| name.parse::<AnyIntegrator>()).transpose().map_err(value_error)?;
    let steps = match (step, steps) {
        (Some(_), Some(_)) => return Err(value_error("`step` and `steps` are both given: give one of them")),
        (Some(step), None) => Some(Steps::Size(number("step", &step)?)),
        (None, Some(count)) => Some(Steps::Count(count)),
        (None, None) => None,
    };
    match (accuracy, by, steps) {
        (Some(_), _, Some(_)) => {
            Err(value_error("`accuracy` and steps are both given: the accuracy determines the step"))
        }
        (Some(accuracy), by, None) => Ok(StepControl::Accuracy { error: number("accuracy", &accuracy)?, by }),
        (None, Some(by), Some(steps)) => Ok(StepControl::Steps { by, steps }),
        (None, None, Some(_)) => Err(value_error("steps are given without an `integrator`: give one")),
        (None, by, None) => Ok(StepControl::Accuracy { error: 1e-9, by }),
    }
}

/// A motion of a request, with rows at the times.
fn motion_of(
    (attitude, omega, z): &StartRequest<'_>,
    times: Vec<f64>,
    every: Option<usize>,
    step_control: StepControl,
    events: Vec<EventRequest>,
) -> PyResult<BodyMotion> {
    let attitude = numbers("attitude", attitude)?;
    let count = attitude.len();
    let attitude = <[f64; 4]>::try_from(attitude)
        .map_err(|_| value_error(format!("`attitude` has {count} numbers; it must be a quaternion (w, x, y, z)")))?;
    let (Some(&first), Some(&end)) = (times.first(), times.last()) else { return Err(value_error("`t` is empty")) };
    let event = |(function, direction, terminal): EventRequest| {
        let mut event = crate::arrays::named("the event", &function, BodyEvent::parse(&function))?;
        event.direction = match direction.as_str() {
            "rising" => Direction::Rising,
            "falling" => Direction::Falling,
            _ => Direction::Both,
        };
        event.terminal = terminal;
        Ok(event)
    };
    Ok(BodyMotion {
        t: first,
        z: number("z0", z)?,
        rows: Some(every.map_or(OutputTimes::At(times), OutputTimes::Every)),
        events: events.into_iter().map(event).collect::<PyResult<_>>()?,
        ..BodyMotion::new(attitude, triple("omega", omega)?, end, step_control)
    })
}

/// The body and the motion of a request, which the signals interrupt.
fn interruptible(
    body: &BodyRequest<'_>,
    start: &StartRequest<'_>,
    (t, every): (&Bound<'_, PyAny>, Option<usize>),
    way: WayRequest<'_>,
    events: Vec<EventRequest>,
) -> PyResult<(Body, BodyMotion, Signals)> {
    let (body, signals) = (body_of(body)?, Signals::new());
    let motion = motion_of(start, crate::motion::times(t)?, every, step_control(way)?, events)?;
    Ok((body, BodyMotion { interrupt: Some(signals.interrupt()), ..motion }, signals))
}

/// A matrix in the order of its rows.
fn by_rows(py: Python<'_>, found: &herglotz_runtime::DMatrix<f64>) -> PyResult<Py<PyArray2<f64>>> {
    matrix(py, found.transpose().as_slice().to_vec(), found.ncols())
}

/// The record of an outcome.
fn record_of(
    py: Python<'_>,
    outcome: &BodyOutcome,
    rows: Vec<f64>,
    crossings: Vec<(usize, Vec<f64>)>,
    raised: Option<PyErr>,
) -> PyResult<BodyRecord> {
    Ok(BodyRecord {
        rows: matrix(py, rows, Body::COLUMNS.len())?,
        end: vector(py, outcome.row().to_vec()),
        crossings,
        status: outcome.status.to_string(),
        // A terminal event is a regular end.
        success: matches!(outcome.status, GroupStatus::Completed | GroupStatus::Event { .. }) && raised.is_none(),
        integrator: outcome.by.to_string(),
        step_size: outcome.step_size,
        steps: Some(outcome.steps),
        error_estimate: outcome.error_estimate,
        interrupted: raised.map(|raised| raised.into_value(py).into_any()),
        derivatives: None,
    })
}

/// Runs a motion of a rigid body with the interpreter lock released.
#[pyfunction]
#[pyo3(signature = (body, start, t, every, way, events, sensitivity, watch = None))]
#[expect(clippy::too_many_arguments, reason = "they are those of the function of Python")]
pub fn run_rigid_body(
    py: Python<'_>,
    body: BodyRequest<'_>,
    start: StartRequest<'_>,
    t: Bound<'_, PyAny>,
    every: Option<usize>,
    way: WayRequest<'_>,
    events: Vec<EventRequest>,
    sensitivity: bool,
    watch: GivenWatch,
) -> PyResult<BodyRecord> {
    let (body, motion, signals) = interruptible(&body, &start, (&t, every), way, events)?;
    let watch = Watch::of(watch);
    let mut kept = Kept { rows: Vec::new(), crossings: Vec::new(), signals: signals.clone(), watch };
    let outcome: Result<BodyOutcome, RuntimeError> = py.detach(|| body.run(&motion, &mut kept));
    let outcome = outcome.map_err(value_error)?;
    let raised = signals.take().or_else(|| kept.watch.take());
    let is_whole = raised.is_none() && outcome.status == GroupStatus::Completed;
    let mut record = record_of(py, &outcome, kept.rows, kept.crossings, raised)?;
    if kept.watch.stopped {
        record.success = false;
        record.status = format!("stopped by `callback` at t = {}", outcome.row()[0]);
    }
    if sensitivity && is_whole {
        // The steps are known.
        let steps = StepControl::Steps { by: outcome.by, steps: Steps::Count(outcome.steps) };
        let motion = BodyMotion { step_control: steps, ..motion };
        let found: Result<BodyDerivatives, RuntimeError> = py.detach(|| body.derivatives(&motion));
        if let Some(raised) = signals.take() {
            // The motion is known, and its derivatives are not.
            record.interrupted = Some(raised.into_value(py).into_any());
            return Ok(record);
        }
        let BodyDerivatives { in_start, in_parameters, log_factor, contact_defect, .. } = found.map_err(value_error)?;
        record.derivatives = Some((by_rows(py, &in_start)?, by_rows(py, &in_parameters)?, log_factor, contact_defect));
    }
    Ok(record)
}

/// The derivatives of rows in the start and in the parameters, one column for each: those of the body coordinates, seven rows for each
/// time; those of the columns, nineteen rows for each; those of the times of sign changes, a row for each; the derivatives in
/// time of the columns at the last time.
type BodySensitivity = ([Py<PyArray2<f64>>; 3], Py<PyArray1<f64>>);

/// The derivatives of the states of a motion at times along it, and of the times of sign changes of its events.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are those of the function of Python")]
pub fn rigid_body_sensitivity(
    py: Python<'_>,
    body: BodyRequest<'_>,
    start: StartRequest<'_>,
    t: Bound<'_, PyAny>,
    way: WayRequest<'_>,
    events: Vec<EventRequest>,
    times: Vec<f64>,
    crossings: Vec<(usize, f64)>,
) -> PyResult<BodySensitivity> {
    let (body, motion, signals) = interruptible(&body, &start, (&t, None), way, events)?;
    let mut all: Vec<f64> = times.iter().copied().chain(crossings.iter().map(|(_, t)| *t)).collect();
    all.sort_by(|a, b| if motion.end < motion.t { b.total_cmp(a) } else { a.total_cmp(b) });
    all.dedup();
    let found = py.detach(|| body.derivatives_at(&motion, &all));
    if let Some(raised) = signals.take() {
        return Err(raised);
    }
    let found = found.map_err(value_error)?;
    let at = |t: f64| all.iter().position(|x| *x == t).and_then(|i| found.get(i));
    let mut parts: [Vec<f64>; 3] = Default::default();
    for at in times.iter().filter_map(|t| at(*t)) {
        let BodyDerivatives { in_start, in_parameters, of_columns, .. } = at;
        for (start, parameters) in in_start.row_iter().zip(in_parameters.row_iter()) {
            parts[0].extend(start.iter().chain(parameters.iter()));
        }
        of_columns.row_iter().for_each(|row| parts[1].extend(row.iter()));
    }
    for (event, t) in &crossings {
        if let (Some(event), Some(at)) = (motion.events.get(*event), at(*t)) {
            parts[2].extend(event.derivatives_of_time(at));
        }
    }
    let Some(last) = times.last().and_then(|t| at(*t)) else { return Err(value_error("`t` is empty")) };
    let width = last.of_columns.ncols();
    let [coordinates, columns, slopes] = parts.map(|part| matrix(py, part, width));
    Ok(([coordinates?, columns?, slopes?], vector(py, last.rates.to_vec())))
}

/// The value of an expression of the columns at a row, with its partial derivatives.
#[pyfunction]
pub fn rigid_body_expression(text: &str, row: Vec<f64>) -> PyResult<(f64, Vec<f64>)> {
    let of = crate::arrays::named("the loss", text, BodyEvent::parse(text))?;
    let row = <[f64; 19]>::try_from(row).map_err(|_| value_error("a row has nineteen columns"))?;
    Ok((of.value(&row), of.gradient(&row).to_vec()))
}

/// The plan of a motion: its text, the integrator, the length and the number of the steps, and the bound of the error.
#[pyfunction]
pub fn plan_rigid_body(
    py: Python<'_>,
    body: BodyRequest<'_>,
    start: StartRequest<'_>,
    t: Bound<'_, PyAny>,
    every: Option<usize>,
    way: WayRequest<'_>,
    events: Vec<EventRequest>,
) -> PyResult<(String, String, f64, usize, Option<f64>)> {
    let (body, motion, signals) = interruptible(&body, &start, (&t, every), way, events)?;
    let plan = py.detach(|| body.plan(&motion));
    if let Some(raised) = signals.take() {
        return Err(raised);
    }
    let plan = plan.map_err(value_error)?;
    Ok((plan.text, plan.integrator.name.to_string(), plan.step_size, plan.steps, plan.error))
}

/// Whether the steps of a motion are contact transformations.
#[pyfunction]
pub fn check_rigid_body(
    py: Python<'_>,
    body: BodyRequest<'_>,
    start: StartRequest<'_>,
    t: Bound<'_, PyAny>,
    way: WayRequest<'_>,
    places: Bound<'_, PyAny>,
) -> PyResult<Checked> {
    let places = whole("places", &places, 1)?;
    let (body, motion, signals) = interruptible(&body, &start, (&t, None), way, Vec::new())?;
    let found = py.detach(|| body.check(&motion, places));
    match signals.take() {
        Some(raised) => Err(raised),
        None => Ok(checked(found.map_err(value_error)?)),
    }
}

/// The angular velocity at the start of a motion between two attitudes.
#[pyfunction]
pub fn rigid_body_between(
    py: Python<'_>,
    body: BodyRequest<'_>,
    start: StartRequest<'_>,
    t: Bound<'_, PyAny>,
    way: WayRequest<'_>,
    to: Bound<'_, PyAny>,
) -> PyResult<[f64; 3]> {
    let (body, motion, signals) = interruptible(&body, &start, (&t, None), way, Vec::new())?;
    let to = numbers("to", &to)?;
    let count = to.len();
    let to = <[f64; 4]>::try_from(to)
        .map_err(|_| value_error(format!("`to` has {count} numbers; it must be a quaternion (w, x, y, z)")))?;
    let found = py.detach(|| body.between(&motion, to));
    match signals.take() {
        Some(raised) => Err(raised),
        None => found.map_err(value_error),
    }
}

/// Runs many motions of rigid bodies on several threads with the interpreter lock released: one record for each, or the
/// error of its input.
#[pyfunction]
pub fn run_rigid_bodies(
    py: Python<'_>,
    members: Vec<(BodyRequest<'_>, StartRequest<'_>)>,
    t: Bound<'_, PyAny>,
    way: WayRequest<'_>,
    threads: Option<usize>,
) -> PyResult<Vec<BodyRecord>> {
    let (times, step_control) = (crate::motion::times(&t)?, step_control(way)?);
    let mut all = Vec::with_capacity(members.len());
    for (body, start) in &members {
        all.push((body_of(body)?, motion_of(start, times.clone(), None, step_control, Vec::new())?));
    }
    let of = |index: usize| all.get(index).cloned();
    let (first, signals) = (of(0), Signals::new());
    let Some(first) = first else { return Err(value_error("there are no bodies: give at least one")) };
    let member = |index: usize| of(index).unwrap_or_else(|| first.clone());
    let ensemble = BodyEnsemble { count: all.len(), member: &member, threads, interrupt: Some(signals.interrupt()) };
    let mut found: Vec<BodyMember> = Vec::with_capacity(all.len());
    let tally = py.detach(|| {
        ensemble.run(&mut |member| {
            found.push(member);
            signals.check()
        })
    });
    tally.map_err(value_error)?;
    if let Some(raised) = signals.take() {
        return Err(raised);
    }
    let record = |member: BodyMember| {
        let index = member.index;
        let outcome = member.outcome.map_err(|error| value_error(format!("member {index}: {error}")))?;
        record_of(py, &outcome, member.rows.concat(), Vec::new(), None)
    };
    found.into_iter().map(record).collect()
}

/// The names of the parameters of the derivatives.
#[pyfunction]
pub fn rigid_body_parameters() -> Vec<&'static str> {
    Body::PARAMETERS.to_vec()
}
