//! Motions of rigid bodies.

use crate::arrays::{matrix, number, numbers, value_error, vector};
use crate::signals::Signals;
use herglotz_runtime::{
    AnyIntegrator, Body, BodyEvent, BodyMotion, BodyOutcome, Crossing, Direction, GroupStatus, OutputTimes, RunMonitor,
    RuntimeError, StepControl, Steps,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::ops::ControlFlow;

/// An event: its function, its direction, and whether it ends the motion.
type EventRequest = (String, String, bool);

/// The body: inertia as three or nine numbers, mass, centre, gravity, gamma.
type BodyRequest<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// The accuracy; or the integrator, and the length or the number of its steps.
type WayRequest<'py> = (Option<Bound<'py, PyAny>>, Option<String>, Option<Bound<'py, PyAny>>, Option<usize>);

/// Keeps the rows and the sign changes.
struct Kept {
    rows: Vec<f64>,
    crossings: Vec<(usize, Vec<f64>)>,
    signals: Signals,
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

    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        self.signals.check()
    }
}

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
    steps: usize,
    error_estimate: Option<f64>,
    interrupted: Option<Py<PyAny>>,
}

/// Three numbers.
fn triple(name: &str, from: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let found = numbers(name, from)?;
    let count = found.len();
    <[f64; 3]>::try_from(found).map_err(|_| value_error(format!("`{name}` has {count} numbers; it must have 3")))
}

/// The body of a request.
fn body_of((inertia, mass, centre, gravity, gamma): &BodyRequest<'_>) -> PyResult<Body> {
    let inertia = match numbers("inertia", inertia)?.as_slice() {
        [a, b, c] => Body::principal([*a, *b, *c]),
        [a, b, c, d, e, f, g, h, i] => [[*a, *b, *c], [*d, *e, *f], [*g, *h, *i]],
        other => {
            return Err(value_error(format!("`inertia` has {} numbers; it must have 3 or 3 times 3", other.len())));
        }
    };
    Ok(Body {
        inertia,
        mass: number("mass", mass)?,
        centre: triple("centre", centre)?,
        gravity: triple("gravity", gravity)?,
        gamma: number("gamma", gamma)?,
    })
}

/// Runs a motion of a rigid body with the interpreter lock released.
#[pyfunction]
pub fn run_rigid_body(
    py: Python<'_>,
    body: BodyRequest<'_>,
    start: (Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>),
    t: Bound<'_, PyAny>,
    every: Option<usize>,
    way: WayRequest<'_>,
    events: Vec<EventRequest>,
) -> PyResult<BodyRecord> {
    let body = body_of(&body)?;
    let (attitude, omega, z) = start;
    let attitude = numbers("attitude", &attitude)?;
    let count = attitude.len();
    let attitude = <[f64; 4]>::try_from(attitude)
        .map_err(|_| value_error(format!("`attitude` has {count} numbers; it must be a quaternion (w, x, y, z)")))?;
    let times = crate::motion::times(&t)?;
    let (Some(&first), Some(&end)) = (times.first(), times.last()) else { return Err(value_error("`t` is empty")) };
    let (accuracy, integrator, step, steps) = way;
    let by = integrator.map(|name| name.parse::<AnyIntegrator>()).transpose().map_err(value_error)?;
    let steps = match (step, steps) {
        (Some(_), Some(_)) => return Err(value_error("`step` and `steps` are both given: give one of them")),
        (Some(step), None) => Some(Steps::Size(number("step", &step)?)),
        (None, Some(count)) => Some(Steps::Count(count)),
        (None, None) => None,
    };
    let step_control = match (accuracy, by, steps) {
        (Some(_), _, Some(_)) => {
            return Err(value_error("`accuracy` and steps are both given: the accuracy determines the step"));
        }
        (Some(accuracy), by, None) => StepControl::Accuracy { error: number("accuracy", &accuracy)?, by },
        (None, Some(by), Some(steps)) => StepControl::Steps { by, steps },
        (None, None, Some(_)) => return Err(value_error("steps are given without an `integrator`: give one")),
        (None, by, None) => StepControl::Accuracy { error: 1e-9, by },
    };
    let event = |(function, direction, terminal): EventRequest| {
        let mut event = crate::motion::named("the event", &function, BodyEvent::parse(&function))?;
        event.direction = match direction.as_str() {
            "rising" => Direction::Rising,
            "falling" => Direction::Falling,
            _ => Direction::Both,
        };
        event.terminal = terminal;
        Ok(event)
    };
    let motion = BodyMotion {
        t: first,
        z: number("z0", &z)?,
        rows: Some(every.map_or(OutputTimes::At(times), OutputTimes::Every)),
        events: events.into_iter().map(event).collect::<PyResult<_>>()?,
        ..BodyMotion::new(attitude, triple("omega", &omega)?, end, step_control)
    };
    let signals = Signals::new();
    let mut kept = Kept { rows: Vec::new(), crossings: Vec::new(), signals: signals.clone() };
    let outcome: Result<BodyOutcome, RuntimeError> = py.detach(|| body.run(&motion, &mut kept));
    let outcome = outcome.map_err(value_error)?;
    let raised = signals.take();
    Ok(BodyRecord {
        rows: matrix(py, kept.rows, Body::COLUMNS.len())?,
        end: vector(py, outcome.row().to_vec()),
        crossings: kept.crossings,
        status: outcome.status.to_string(),
        // A terminal event is a regular end.
        success: matches!(outcome.status, GroupStatus::Completed | GroupStatus::Event { .. }) && raised.is_none(),
        integrator: outcome.by.to_string(),
        step_size: outcome.step_size,
        steps: outcome.steps,
        error_estimate: outcome.error_estimate,
        interrupted: raised.map(|raised| raised.into_value(py).into_any()),
    })
}
