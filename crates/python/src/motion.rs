//! Requests for a motion.

use crate::arrays::{named, number, numbers, value_error, whole, word};
use crate::events::GivenEvent;
use crate::method::Method;
use crate::signals::Signals;
use crate::system::System;
use herglotz_runtime::{AnyIntegrator, Column, FormulaMethod, InitialVelocity, OutputTimes, Start, StepControl, Steps};
use pyo3::prelude::*;

/// A request for a motion, from the arguments of `solve`.
#[pyclass(frozen, module = "herglotz._core")]
pub struct Motion {
    pub system: herglotz_runtime::System,
    pub motion: herglotz_runtime::Motion,
    /// Whether the rows have the conformal factor.
    pub conformal_factor: bool,
    /// The signals that interrupt its plan and its runs.
    pub signals: Signals,
}

/// The position, the velocity or the momentum, whether it is the momentum, the action, and for a momentum a nearby
/// velocity.
type GivenStart<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, bool, Bound<'py, PyAny>, Option<Vec<f64>>);

/// The arguments accuracy, integrator, step and steps.
pub type GivenStepControl<'py> = [Option<Bound<'py, PyAny>>; 4];

/// The discrete Lagrangian in the place of the integrator, if there is one.
fn method_of([_, integrator, ..]: &GivenStepControl<'_>) -> Option<FormulaMethod> {
    integrator.as_ref()?.cast::<Method>().ok().map(|method| method.get().inner.clone())
}

/// The step control that these arguments specify.
pub fn step_control([accuracy, integrator, step, steps]: &GivenStepControl<'_>) -> PyResult<StepControl> {
    /// The default accuracy: that of the Python documentation.
    const ACCURACY: f64 = 1e-9;
    let named = |name: &Bound<'_, PyAny>| -> PyResult<AnyIntegrator> {
        if name.is_instance_of::<Method>() {
            // It is replaced by the discrete Lagrangian.
            return Ok(AnyIntegrator::Gauss { stages: 1 });
        }
        word("integrator", name, "\"gauss_8\"")?.parse().map_err(value_error)
    };
    let by = integrator.as_ref().map(named).transpose()?;
    let given = match (step, steps) {
        (Some(_), Some(_)) => return Err(value_error("`step` and `steps` are both given: give one of them")),
        (Some(step), None) => Some(Steps::Size(number("step", step)?)),
        (None, Some(count)) => Some(Steps::Count(whole("steps", count, 1)?)),
        (None, None) => None,
    };
    match (given, by, accuracy) {
        (Some(_), _, Some(_)) => {
            Err(value_error("`accuracy` and a step are both given: give the accuracy, or the step with an integrator"))
        }
        (Some(_), None, None) => {
            Err(value_error("a step is given without `integrator`: give one, such as \"gauss_8\""))
        }
        (Some(steps), Some(by), None) => Ok(StepControl::Steps { by, steps }),
        (None, by, None) => Ok(StepControl::Accuracy { error: ACCURACY, by }),
        (None, by, Some(accuracy)) => Ok(StepControl::Accuracy { error: number("accuracy", accuracy)?, by }),
    }
}

/// The columns of every row: t, q, v, p, z, the energy, and the conformal factor where it is requested.
pub fn columns(n: usize, conformal_factor: bool) -> Vec<Column> {
    let mut columns = vec![Column::Time];
    columns.extend((0..n).map(Column::Position));
    columns.extend((0..n).map(Column::Velocity));
    columns.extend((0..n).map(Column::Momentum));
    columns.extend([Column::Action, Column::Energy]);
    columns.extend(conformal_factor.then_some(Column::LogFactor));
    columns
}

/// The times of an argument: those of the rows, the first of which is the initial time. A single number is the final
/// time of a motion from 0.
pub fn times(t: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let mut times = numbers("t", t)?;
    if let [end] = times.as_slice() {
        if t.len().is_ok() {
            return Err(no_times());
        }
        times = vec![0.0, *end];
    }
    Ok(times)
}

fn no_times() -> PyErr {
    value_error(
        "`t` must be the final time of a motion that starts at 0, or at least two times, the first of which is the \
         initial time",
    )
}

#[pymethods]
impl Motion {
    #[new]
    #[pyo3(signature = (system, start, t, every, step_control, events, columns, conformal_factor, estimate, scales,
                        project = false, exact = false))]
    #[expect(clippy::too_many_arguments, reason = "they are those of `solve`, which names them")]
    fn new(
        system: &System,
        start: GivenStart<'_>,
        t: Bound<'_, PyAny>,
        every: Option<Bound<'_, PyAny>>,
        step_control: GivenStepControl<'_>,
        events: Vec<GivenEvent<'_>>,
        columns: Vec<String>,
        conformal_factor: bool,
        estimate: bool,
        scales: Option<Bound<'_, PyAny>>,
        project: bool,
        exact: bool,
    ) -> PyResult<Self> {
        let (with_resets, events) = crate::events::events(events, system)?;
        let formula = with_resets.formula();
        let (q, velocity, is_momentum, z, near) = start;
        let q = numbers("q0", &q)?;
        let velocity = if is_momentum {
            InitialVelocity::Momentum(numbers("p0", &velocity)?)
        } else {
            InitialVelocity::Velocity(numbers("v0", &velocity)?)
        };
        // The velocity of a motion that is continued.
        let velocity = match (velocity, near) {
            (InitialVelocity::Momentum(p), Some(v)) if v.len() == p.len() && v.iter().all(|v| v.is_finite()) => {
                InitialVelocity::MomentumNear { p, v }
            }
            (velocity, _) => velocity,
        };
        let length = match &velocity {
            InitialVelocity::Velocity(v) => ("v0", v.len()),
            InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => ("p0", p.len()),
        };
        let (expected, given) = (formula.dimension(), formula.given_dimension());
        for (what, found) in [("q0", q.len()), length] {
            if found != expected && found != given {
                return Err(value_error(format!(
                    "`{what}` has {found} numbers, but the system has {given} coordinates"
                )));
            }
        }
        let times = times(&t)?;
        let (Some(&first), Some(&end)) = (times.first(), times.last()) else { return Err(no_times()) };
        let every = every.map(|every| whole("every", &every, 1)).transpose()?;
        // A motion whose end is its start has a single row.
        let times = if let [start, end] = times[..]
            && start == end
        {
            vec![start]
        } else {
            times
        };
        let rows = Some(every.map_or(OutputTimes::At(times), OutputTimes::Every));
        let (method, step_control) = (method_of(&step_control), self::step_control(&step_control)?);
        let mut all = self::columns(expected, conformal_factor);
        for text in &columns {
            all.push(named("the column", text, Column::parse(text, formula))?);
        }
        let start = Start { t: first, q, velocity, z: number("z0", &z)? };
        let scales = scales.map(|scales| numbers("scales", &scales)).transpose()?;
        let signals = Signals::new();
        let motion = herglotz_runtime::Motion {
            rows,
            columns: all,
            events,
            conformal_factor,
            estimate,
            scales,
            project,
            exact,
            method,
            interrupt: Some(signals.interrupt()),
            ..herglotz_runtime::Motion::new(start, end, step_control)
        };
        Ok(Motion { system: with_resets, motion, conformal_factor, signals })
    }

    /// The plan as text, with the name of the integrator, the step, the number of steps and the predicted error.
    fn plan(&self, py: Python<'_>) -> PyResult<(String, String, f64, usize, Option<f64>)> {
        let plan = py.detach(|| self.system.plan(&self.motion));
        if let Some(raised) = self.signals.take() {
            return Err(raised);
        }
        let plan = plan.map_err(value_error)?;
        Ok((plan.text, plan.integrator.name.into_owned(), plan.step_size, plan.steps, plan.error))
    }
}
