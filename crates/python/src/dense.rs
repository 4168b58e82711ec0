//! Dense output: states of a motion at any time.

use crate::arrays::{matrix, numbers, value_error, vector};
use crate::motion::{Motion, columns};
use crate::signals::Signals;
use herglotz_runtime::{
    AnyIntegrator, Column, Crossing, InitialVelocity, OutputTimes, RunMonitor, Start, StepControl, Steps,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::ops::ControlFlow;

/// The ends of a motion's steps.
#[derive(Default)]
struct Nodes {
    t: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    p: Vec<f64>,
    z: Vec<f64>,
}

struct NodeStore {
    nodes: Nodes,
    /// The times of the resets, with the states before them.
    resets: Vec<Start>,
    /// The time beyond which no node is needed, and whether it has been reached.
    until: f64,
    done: bool,
    signals: Signals,
}

impl RunMonitor for NodeStore {
    fn node(&mut self, t: f64, [q, v, p]: [&[f64]; 3], z: f64) {
        if self.done {
            return;
        }
        let first = self.nodes.t.first().copied().unwrap_or(t);
        self.done = t != first && (t - first).abs() >= (self.until - first).abs();
        self.nodes.t.push(t);
        self.nodes.q.extend_from_slice(q);
        self.nodes.v.extend_from_slice(v);
        self.nodes.p.extend_from_slice(p);
        self.nodes.z.push(z);
    }

    fn crossing(&mut self, reset: &Crossing) -> ControlFlow<()> {
        let Crossing { t, q, v, p, z, .. } = reset.clone();
        self.resets.push(Start { t, q, velocity: InitialVelocity::MomentumNear { p, v }, z });
        ControlFlow::Continue(())
    }

    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        if self.done { ControlFlow::Break(()) } else { self.signals.check() }
    }
}

/// Dense output of a motion: a state is on polynomials that resolve the motion from the node before it, or it is computed by a
/// step from that node.
#[pyclass(frozen, module = "herglotz._core")]
pub struct Dense {
    system: herglotz_runtime::System,
    by: AnyIntegrator,
    /// Whether states between nodes are computed by steps that end there.
    exact: bool,
    nodes: Nodes,
    /// The times of the resets, with the states before them.
    resets: Vec<Start>,
    /// The end of the motion, which may lie within a step that could not be completed.
    until: f64,
    /// The time of the node after which the motion is at rest, if it comes to rest.
    rests_from: Option<f64>,
}

/// The times, positions, velocities, momenta, actions and energies of states.
type States =
    (Py<PyArray2<f64>>, Py<PyArray2<f64>>, Py<PyArray2<f64>>, Py<PyArray1<f64>>, Py<PyArray1<f64>>, Py<PyArray2<f64>>);

/// Runs a motion again up to a time, and keeps the ends of its steps.
#[pyfunction]
pub fn nodes(py: Python<'_>, motion: &Motion, until: f64) -> PyResult<Dense> {
    let signals = motion.signals.clone();
    let mut store = NodeStore { nodes: Nodes::default(), resets: Vec::new(), until, done: false, signals };
    let by = py.detach(|| {
        let plan = motion.system.plan(&motion.motion)?;
        let by = match motion.motion.step_control {
            StepControl::Steps { by, .. } | StepControl::Accuracy { by: Some(by), .. } => Ok(by),
            StepControl::Accuracy { by: None, .. } => plan.by().ok_or(()),
        };
        let Ok(by) = by else { return Ok(None) };
        let again = herglotz_runtime::Motion {
            // A motion whose end is its start has no step.
            step_control: StepControl::Steps { by, steps: Steps::Count(plan.steps.max(1)) },
            rows: None,
            columns: Vec::new(),
            events: motion.motion.events.iter().filter(|event| event.reset.is_some()).cloned().collect(),
            conformal_factor: false,
            nodes: true,
            ..motion.motion.clone()
        };
        let outcome = motion.system.run(&again, &mut store)?;
        Ok(Some((by, outcome.rests_from)))
    });
    if let Some(raised) = motion.signals.take() {
        return Err(raised);
    }
    let by = by.map_err(|error: herglotz_runtime::RuntimeError| value_error(error))?;
    let (by, rests_from) = by.ok_or_else(|| {
        value_error(
            "the integrator of the plan does not support dense output: name another \
                                           `integrator`",
        )
    })?;
    let (system, exact) = (motion.system.clone(), motion.motion.exact);
    Ok(Dense { system, by, exact, nodes: store.nodes, resets: store.resets, until, rests_from })
}

impl Dense {
    /// The state before a reset at a time.
    fn before_reset(&self, t: f64) -> Option<&Start> {
        let sign = if self.nodes.t.first().is_some_and(|first| self.until < *first) { -1.0 } else { 1.0 };
        let k = self.resets.partition_point(|reset| sign * reset.t < sign * t);
        self.resets.get(k).filter(|reset| reset.t == t)
    }

    /// The rows at times within one step, in the direction of the motion.
    fn within(&self, k: usize, times: Vec<f64>, all: &[Column]) -> PyResult<Vec<Vec<f64>>> {
        if let [time] = times.as_slice()
            && let Some(before) = self.before_reset(*time)
        {
            return self.rows(before.clone(), *time, times, all);
        }
        let (n, Nodes { t, q, v, p, z }) = (self.system.dimension(), &self.nodes);
        let part = |x: &[f64]| x.get(k * n..(k + 1) * n).unwrap_or_default().to_vec();
        let at = |x: &[f64], k: usize| x.get(k).copied().unwrap_or(f64::NAN);
        let start = Start {
            t: at(t, k),
            q: part(q),
            velocity: InitialVelocity::MomentumNear { p: part(p), v: part(v) },
            z: at(z, k),
        };
        if self.rests_from == Some(start.t) {
            // The state there is that of the node: motions that end at their start.
            let there = |time: f64| self.rows(Start { t: time, ..start.clone() }, time, vec![time], all);
            return Ok(times.into_iter().map(there).collect::<PyResult<Vec<_>>>()?.concat());
        }
        self.rows(start, t.get(k + 1).copied().unwrap_or(self.until), times, all)
    }

    /// The rows at times of one step from a state.
    fn rows(&self, start: Start, end: f64, times: Vec<f64>, all: &[Column]) -> PyResult<Vec<Vec<f64>>> {
        let step_control = StepControl::Steps { by: self.by, steps: Steps::Count(1) };
        let motion = herglotz_runtime::Motion {
            rows: Some(OutputTimes::At(times)),
            columns: all.to_vec(),
            exact: self.exact,
            ..herglotz_runtime::Motion::new(start, end, step_control)
        };
        Ok(self.system.record(&motion).map_err(value_error)?.1)
    }
}

#[pymethods]
impl Dense {
    /// The states at given times, in any order, with the values of expressions there.
    fn at(&self, py: Python<'_>, t: &Bound<'_, PyAny>, expressions: Vec<String>) -> PyResult<States> {
        let (n, times) = (self.system.dimension(), numbers("t", t)?);
        let nodes = self.nodes.t.as_slice();
        let (Some(&first), Some(&last)) = (nodes.first(), nodes.last()) else {
            return Err(value_error("the motion has no steps"));
        };
        let sign = if self.until < first { -1.0 } else { 1.0 };
        let last = if sign * last < sign * self.until { self.until } else { last };
        // The final time is rounded by the sum of the steps, and by the arithmetic of the caller.
        let rounding = 4.0 * f64::EPSILON * (first.abs() + last.abs());
        let nearest = |t: f64| match (first - t, t - last) {
            (before, _) if sign * before > 0.0 && before.abs() <= rounding => first,
            (_, beyond) if sign * beyond > 0.0 && beyond.abs() <= rounding => last,
            _ => t,
        };
        let times: Vec<f64> = times.into_iter().map(nearest).collect();
        let inside = |t: f64| sign * first <= sign * t && sign * t <= sign * last;
        if let Some(t) = times.iter().find(|t| !inside(**t)) {
            return Err(value_error(format!("`t` contains {t}, but the motion runs from {first} to {last}")));
        }
        let mut all = columns(n, false);
        let own = all.len();
        for text in &expressions {
            all.push(Column::parse(text, self.system.formula()).map_err(value_error)?);
        }
        let mut order: Vec<(f64, usize)> = times.iter().copied().zip(0..).collect();
        order.sort_by(|a, b| (sign * a.0).total_cmp(&(sign * b.0)));
        let width = all.len();
        let mut found = vec![f64::NAN; times.len() * width];
        let mut rest = order.as_slice();
        while let Some(&(t, _)) = rest.first() {
            // The step that contains the time, or ends at it.
            py.check_signals()?;
            let k = nodes.partition_point(|node| sign * node < sign * t).saturating_sub(1);
            let end = nodes.get(k + 1).copied().unwrap_or(last);
            // The time of a reset is by itself, since its state is known.
            let is_reset = |t: f64| self.before_reset(t).is_some();
            let count = match is_reset(t) {
                true => rest.partition_point(|(other, _)| sign * other <= sign * t),
                false => rest.iter().take_while(|(t, _)| sign * t <= sign * end && !is_reset(*t)).count(),
            };
            let (these, others) = rest.split_at(count.max(1));
            rest = others;
            let mut different: Vec<f64> = these.iter().map(|(t, _)| *t).collect();
            different.dedup();
            let rows = py.detach(|| self.within(k, different.clone(), &all))?;
            for (t, index) in these {
                let row = different.iter().position(|x| x == t).and_then(|i| rows.get(i));
                if let (Some(row), Some(to)) = (row, found.get_mut(index * width..(index + 1) * width)) {
                    to.copy_from_slice(row);
                }
            }
        }
        let part = |from: usize, count: usize| -> Vec<f64> {
            found.chunks_exact(width).flat_map(|row| row.iter().skip(from).take(count).copied()).collect()
        };
        Ok((
            matrix(py, part(1, n), n)?,
            matrix(py, part(1 + n, n), n)?,
            matrix(py, part(1 + 2 * n, n), n)?,
            vector(py, part(1 + 3 * n, 1)),
            vector(py, part(2 + 3 * n, 1)),
            matrix(py, part(own, width - own), width - own)?,
        ))
    }

    /// The ends of the steps.
    #[getter]
    fn times(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        vector(py, self.nodes.t.clone())
    }
}
