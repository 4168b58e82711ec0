//! The model of a fit: quantities of a motion as functions of its unknowns.

use super::event_series::{LATER, LEAST_STEPS, SignChange, event_time, shorten};
use super::{Fit, FitError, FittedMotion, FittedSeries, METHOD, MotionFit, MultiStart, UNDER_CONSTRAINTS};
use crate::kernel::{Differentiated, of_expression};
use crate::{
    Column, Event, InitialVelocity, Motion, RunMonitor, RuntimeError, Start, StateDerivative, StepControl, System,
    velocity_name,
};
use discrete_herglotz::sensitivity::{SensitivityError, Variable};
use discrete_herglotz::{Status, Steps, Vector};
use formula_lagrangian::Expression;
use herglotz_fit::{DMatrix, Model, ModelFailure, Observation, Piece, PieceValues, PiecewiseModel, ShootingFit};
use std::cell::{Cell, RefCell};

/// What is observed.
pub(super) enum Quantity {
    /// A number of the state.
    Number(Part, usize),
    /// An expression of the state.
    Expression(Box<Expression>),
    /// The time of a sign change of the event with this index.
    EventTime(usize),
}

/// A part of a state.
#[derive(Clone, Copy)]
pub(super) enum Part {
    Position,
    Velocity,
    Momentum,
    Action,
}

impl Part {
    /// The number of a state, or of the derivative of one: `(q, v, p)` and z.
    fn of(self, [q, v, p]: [&[f64]; 3], z: f64, i: usize) -> f64 {
        let vector = match self {
            Part::Position => q,
            Part::Velocity => v,
            Part::Momentum => p,
            Part::Action => return z,
        };
        vector.get(i).copied().unwrap_or(f64::NAN)
    }
}

/// Quantities of a motion at times, as functions of unknowns.
pub(super) struct FitModel<'a> {
    system: &'a System,
    /// The motion with steps of a fixed length.
    motion: Motion,
    names: Vec<String>,
    unknowns: Vec<Variable>,
    quantities: Vec<Quantity>,
    /// The time of each value, and the index of its quantity.
    observed: Vec<(f64, usize)>,
    /// The number of the sign change of each value that is the time of one, in the order of the motion; 0 for others.
    numbers: Vec<usize>,
    pub(super) monitor: RefCell<&'a mut dyn RunMonitor>,
    /// Whether the monitor has ended a motion: all further ones are then refused.
    pub(super) is_interrupted: Cell<bool>,
    /// The error of a motion that has no derivatives, whatever the unknowns.
    no_tangent: RefCell<Option<RuntimeError>>,
}

impl<'a> FitModel<'a> {
    pub fn new(system: &'a System, request: &MotionFit, monitor: &'a mut dyn RunMonitor) -> Result<Self, RuntimeError> {
        let t0 = request.motion.start.t;
        let unknowns = request.unknowns.iter().map(|unknown| unknown_of(system, &unknown.name));
        let unknowns = unknowns.collect::<Result<Vec<_>, _>>()?;
        check_kind(&request.motion.start, &unknowns)?;
        let quantities = request.series.iter().map(|series| match &series.event {
            Some(of) => event_time(&request.motion, of),
            None => quantity(system, &series.quantity),
        });
        let quantities = quantities.collect::<Result<Vec<_>, _>>()?;
        let (mut observed, mut numbers) = (Vec::new(), Vec::new());
        for (k, series) in request.series.iter().enumerate() {
            let of_event = series.event.as_ref().map(|of| &of.numbers);
            let counts = [Some(series.values.len()), series.deviations.as_ref().map(Vec::len), of_event.map(Vec::len)];
            if let Some(found) = counts.into_iter().flatten().find(|count| *count != series.times.len()) {
                return Err(FitError::Count { what: "values of a series", found, expected: series.times.len() }.into());
            }
            if let Some(index) = series.times.iter().position(|t| !(t.is_finite() && *t >= t0)) {
                return Err(FitError::Time { index, t: series.times[index], t0 }.into());
            }
            observed.extend(series.times.iter().map(|t| (*t, k)));
            numbers.extend((0..series.times.len()).map(|i| of_event.and_then(|all| all.get(i)).copied().unwrap_or(0)));
        }
        let end = observed.iter().fold(t0, |end, (t, _)| end.max(*t));
        if end == t0 {
            return Err(FitError::NoTimes { t0 }.into());
        }
        if system.formula().constraints() > 0 && !request.nodes.is_empty() {
            let why = "cut a motion with constraints, whose state there has fewer unknowns than numbers; fit it without nodes";
            return Err(RuntimeError::argument("nodes", why));
        }
        let has_events = request.series.iter().any(|series| series.event.is_some());
        if has_events && !request.nodes.is_empty() {
            let why = "cut a motion whose times of events are fitted; fit them without nodes";
            return Err(RuntimeError::argument("nodes", why));
        }
        // Steps are chosen up to the last of the data: beyond it resets may accumulate.
        let motion = Motion {
            end,
            rows: None,
            columns: Vec::new(),
            events: if has_events { request.motion.events.clone() } else { Vec::new() },
            conformal_factor: false,
            estimate: false,
            ..request.motion.clone()
        };
        let mut motion = with_fixed_steps(system, motion, request.motion.end)?;
        if has_events {
            // Sign changes may be later until the unknowns are found.
            motion.end += LATER * (end - t0);
            shorten(&mut motion, (end - t0) / LEAST_STEPS);
        }
        Ok(FitModel {
            motion,
            system,
            names: request.unknowns.iter().map(|unknown| unknown.name.clone()).collect(),
            unknowns,
            quantities,
            observed,
            numbers,
            monitor: RefCell::new(monitor),
            is_interrupted: Cell::new(false),
            no_tangent: RefCell::new(None),
        })
    }

    /// The error of a motion that has no derivatives, if there is one, else the other error.
    pub fn reason(&self, error: FitError) -> RuntimeError {
        self.no_tangent.take().unwrap_or(RuntimeError::Fit(error))
    }

    /// The values of the unknowns in the system and the start of the motion.
    pub fn start(&self) -> Vec<f64> {
        let start = &self.motion.start;
        let rate = match &start.velocity {
            InitialVelocity::Velocity(rate) | InitialVelocity::Momentum(rate) => rate,
            InitialVelocity::MomentumNear { p, .. } => p,
        };
        let entry = |x: &[f64], i: usize| x.get(i).copied().unwrap_or(f64::NAN);
        let value = |unknown: &Variable| match unknown {
            Variable::Position(i) => entry(&start.q, *i),
            Variable::Velocity(i) | Variable::Momentum(i) => entry(rate, *i),
            Variable::Parameter(name) => {
                let found = self.system.formula().parameters().find(|(parameter, _)| parameter == name);
                found.map_or(f64::NAN, |(_, value)| value)
            }
            _ => start.z,
        };
        self.unknowns.iter().map(value).collect()
    }

    /// The start of the motion for these values of the unknowns.
    fn start_at(&self, theta: &[f64]) -> Start {
        let mut start = self.motion.start.clone();
        for (unknown, value) in self.unknowns.iter().zip(theta) {
            let Start { q, velocity, z, .. } = &mut start;
            let entry = match (unknown, velocity) {
                (Variable::Position(i), _) => q.get_mut(*i),
                (Variable::Velocity(i), InitialVelocity::Velocity(rate))
                | (Variable::Momentum(i), InitialVelocity::Momentum(rate))
                | (Variable::Momentum(i), InitialVelocity::MomentumNear { p: rate, .. }) => rate.get_mut(*i),
                (Variable::Action, _) => Some(z),
                _ => None,
            };
            if let Some(entry) = entry {
                *entry = *value;
            }
        }
        start
    }

    /// The parameters among the unknowns, with these values.
    fn parameters_at(&self, theta: &[f64]) -> Vec<(&str, f64)> {
        let of = self.unknowns.iter().zip(theta).filter_map(|(unknown, value)| match unknown {
            Variable::Parameter(name) => Some((name.as_str(), *value)),
            _ => None,
        });
        of.collect()
    }

    /// The fitted motion, with the data.
    pub fn result(
        &self,
        request: &MotionFit,
        fit: Fit,
        starts: MultiStart,
        shooting: Option<ShootingFit>,
    ) -> FittedMotion {
        let mut first = 0;
        let series = request.series.iter().map(|series| {
            let range = first..first + series.times.len();
            first = range.end;
            FittedSeries {
                quantity: series.quantity.clone(),
                times: series.times.clone(),
                values: series.values.clone(),
                fitted: fit.values.get(range.clone()).unwrap_or_default().to_vec(),
                residuals: fit.residuals.as_slice().get(range).unwrap_or_default().to_vec(),
            }
        });
        let parameters = self.parameters_at(&fit.parameters).into_iter().map(|(name, value)| (name.to_owned(), value));
        FittedMotion {
            series: series.collect(),
            parameters: parameters.collect(),
            motion: Motion { start: self.start_at(&fit.parameters), ..self.motion.clone() },
            best_start: starts.best_index().unwrap_or(0),
            starts: starts.fits,
            largest_defect: shooting.map(|shooting| shooting.largest_defect),
            fit,
        }
    }

    /// The variables of a piece, with the place of each among the unknowns and the numbers of the state after them.
    fn variables(&self, is_first: bool) -> (Vec<Variable>, Vec<usize>) {
        let n = self.system.dimension();
        let unknowns = self.unknowns.iter().cloned().enumerate().map(|(i, unknown)| (unknown, i));
        if is_first {
            return unknowns.unzip();
        }
        let parameters = unknowns.filter(|(unknown, _)| matches!(unknown, Variable::Parameter(_)));
        let state = (0..n).map(Variable::Position).chain((0..n).map(Variable::Velocity)).chain([Variable::Action]);
        let count = self.unknowns.len();
        parameters.chain(state.enumerate().map(|(i, variable)| (variable, count + i))).unzip()
    }
}

impl Model for FitModel<'_> {
    fn parameter_names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn value_count(&self) -> usize {
        self.observed.len()
    }

    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        let all: Vec<usize> = (0..self.observed.len()).collect();
        let piece = Piece { from: None, to: None, values: &all, is_differentiated: jacobian.is_some() };
        let found = self.piece(theta, &piece)?;
        values.copy_from_slice(&found.values);
        if let Some(jacobian) = jacobian {
            jacobian.copy_from(&found.derivatives);
        }
        Ok(())
    }
}

impl PiecewiseModel for FitModel<'_> {
    fn state_names(&self) -> Vec<String> {
        let names = self.system.formula().coordinates();
        let velocities = names.iter().map(|name| velocity_name(name)).collect::<Vec<_>>();
        names.into_iter().chain(velocities).chain(["z".to_owned()]).collect()
    }

    fn start_time(&self) -> f64 {
        self.motion.start.t
    }

    fn start_state(&self, theta: &[f64]) -> Vec<f64> {
        let start = self.start_at(theta);
        let rate = match start.velocity {
            InitialVelocity::Velocity(v) | InitialVelocity::MomentumNear { v, .. } => v,
            // It sets a scale only.
            InitialVelocity::Momentum(p) => p,
        };
        start.q.into_iter().chain(rate).chain([start.z]).collect()
    }

    fn observations(&self) -> Vec<Observation> {
        let n = self.system.dimension();
        let of = |(t, quantity): &(f64, usize)| {
            let (number, rate) = match &self.quantities[*quantity] {
                Quantity::Number(Part::Position, i) => (Some(*i), Some(n + i)),
                Quantity::Number(Part::Velocity, i) => (Some(n + i), None),
                Quantity::Number(Part::Action, _) => (Some(2 * n), None),
                _ => (None, None),
            };
            Observation { t: *t, number, rate }
        };
        self.observed.iter().map(of).collect()
    }

    fn piece(&self, theta: &[f64], piece: &Piece<'_>) -> Result<PieceValues, ModelFailure> {
        if self.is_interrupted.get() {
            return Err(ModelFailure::Undefined("the fit was interrupted".to_owned()));
        }
        let parameters = self.parameters_at(theta);
        let system = self.system.with_parameters(&parameters).map_err(undefined)?;
        let n = system.dimension();
        let start = match piece.from {
            None => self.start_at(theta),
            Some((t, state)) => {
                let numbers = |from: usize, to: usize| state.get(from..to).unwrap_or_default();
                Start::new(t, numbers(0, n), numbers(n, 2 * n), state.get(2 * n).copied().unwrap_or(f64::NAN))
            }
        };
        let (variables, places) = self.variables(piece.from.is_none());
        let variables = if piece.is_differentiated { variables } else { Vec::new() };
        let is_event = |i: &&usize| matches!(self.quantities[self.observed[**i].1], Quantity::EventTime(_));
        let of_state = piece.values.iter().filter(|i| !is_event(i));
        let mut times: Vec<f64> = of_state.map(|i| self.observed[*i].0).chain(piece.to).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut found = PieceValues::new(self, piece);
        let wanted: Vec<SignChange> = piece.values.iter().filter(is_event).map(|i| self.sign_change(*i)).collect();
        let end = if wanted.is_empty() { times.last().copied() } else { Some(self.motion.end) };
        let Some(end) = end else { return Ok(found) };
        let mut motion = Motion { start, end, ..self.motion.clone() };
        for (name, value) in &parameters {
            let expressions = motion.events.iter_mut().flat_map(Event::expressions_mut);
            expressions.into_iter().try_for_each(|expression| expression.set(name, *value)).map_err(undefined)?;
        }
        let crossings = if wanted.is_empty() { Vec::new() } else { self.crossings(&system, &motion, &wanted)? };
        let rows = {
            let mut monitor = self.monitor.borrow_mut();
            let of = Differentiated { variables: &variables, times: &times, crossings: &crossings };
            system.kernel.sensitivity(&motion, of, &mut **monitor)
        };
        let rows = rows.map_err(|error| {
            let failure = undefined(&error);
            if matches!(error, RuntimeError::Sensitivity(SensitivityError::NoTangent { .. })) {
                self.no_tangent.replace(Some(error));
            }
            failure
        })?;
        match rows.status {
            Status::Completed => {}
            status => {
                self.is_interrupted.set(matches!(status, Status::Stopped { .. }));
                return Err(undefined(status));
            }
        }
        if let Some(unresolved) = rows.unresolved {
            return Err(undefined(unresolved));
        }
        let expressions = self.expressions_at(&parameters)?;
        let mut of_events = crossings.iter().zip(&rows.event_times);
        for (row, i) in piece.values.iter().enumerate() {
            let (t, quantity) = self.observed[*i];
            if let Quantity::EventTime(_) = &self.quantities[quantity] {
                if let Some((at, slopes)) = of_events.next() {
                    found.set(row, at.t, places.iter().copied().zip(slopes.iter().copied()));
                }
                continue;
            }
            let at = times.partition_point(|time| *time < t);
            let (Some(state), Some(columns)) = (rows.states.get(at), rows.rows.get(at)) else { continue };
            let (value, slopes): (f64, Vec<f64>) = match (&self.quantities[quantity], &expressions[quantity]) {
                (Quantity::Number(part, i), _) => {
                    let of = |StateDerivative { q, v, p, z }: &StateDerivative| part.of([q, v, p], *z, *i);
                    (part.of([&state.q, &state.v, &state.p], state.z, *i), columns.iter().map(of).collect())
                }
                (Quantity::Expression(_), Some(expression)) => {
                    let (value, of_state, of_parameters) = of_expression(expression, state);
                    let slope = |(column, variable): (&StateDerivative, &Variable)| {
                        column.dot(&of_state) + self.explicit(&of_parameters, variable)
                    };
                    (value, columns.iter().zip(&variables).map(slope).collect())
                }
                (Quantity::Expression(_), None) | (Quantity::EventTime(_), _) => continue,
            };
            found.set(row, value, places.iter().copied().zip(slopes));
        }
        if let (Some(_), Some(state), Some(columns)) = (piece.to, rows.states.last(), rows.rows.last()) {
            let numbers = |q: &Vector, v: &Vector, z: f64| q.iter().chain(v).copied().chain([z]).collect::<Vec<_>>();
            for (k, number) in numbers(&state.q, &state.v, state.z).into_iter().enumerate() {
                found.values[piece.values.len() + k] = number;
            }
            for (place, column) in places.iter().zip(columns) {
                for (k, number) in numbers(&column.q, &column.v, column.z).into_iter().enumerate() {
                    found.derivatives[(piece.values.len() + k, *place)] = number;
                }
            }
        }
        Ok(found)
    }
}

impl FitModel<'_> {
    /// The expressions of the quantities that are one, for these parameters.
    fn expressions_at(&self, parameters: &[(&str, f64)]) -> Result<Vec<Option<Expression>>, ModelFailure> {
        let of = |quantity: &Quantity| {
            let Quantity::Expression(expression) = quantity else { return Ok(None) };
            let mut expression = (**expression).clone();
            for (name, value) in parameters {
                expression.set(name, *value).map_err(undefined)?;
            }
            Ok(Some(expression))
        };
        self.quantities.iter().map(of).collect()
    }

    /// The sign change of which a value is the time.
    fn sign_change(&self, value: usize) -> SignChange {
        let event = match self.quantities[self.observed[value].1] {
            Quantity::EventTime(event) => event,
            _ => usize::MAX,
        };
        SignChange { event, number: self.numbers[value] }
    }

    /// The partial derivative of an expression in a variable, where that is a parameter.
    fn explicit(&self, of_parameters: &[f64], variable: &Variable) -> f64 {
        let Variable::Parameter(name) = variable else { return 0.0 };
        let index = self.system.formula().parameters().position(|(parameter, _)| parameter == name);
        index.and_then(|i| of_parameters.get(i)).copied().unwrap_or(0.0)
    }
}

pub(super) fn undefined(cause: impl std::fmt::Display) -> ModelFailure {
    ModelFailure::Undefined(cause.to_string())
}

/// The variable of an unknown.
fn unknown_of(system: &System, name: &str) -> Result<Variable, RuntimeError> {
    match system.variable(name.strip_prefix("start.").unwrap_or(name))? {
        Variable::StartTime | Variable::EndTime => Err(FitError::Unknown { variable: name.to_owned() }.into()),
        variable => Ok(variable),
    }
}

/// Rejects unknown velocities of a start that is given by momenta, and the reverse.
fn check_kind(start: &Start, unknowns: &[Variable]) -> Result<(), RuntimeError> {
    let by_velocity = matches!(start.velocity, InitialVelocity::Velocity(_));
    let is_wrong = |unknown: &Variable| match unknown {
        Variable::Velocity(_) => !by_velocity,
        Variable::Momentum(_) => by_velocity,
        _ => false,
    };
    if !unknowns.iter().any(is_wrong) {
        return Ok(());
    }
    let kind = if by_velocity { "velocities" } else { "momenta" };
    Err(RuntimeError::argument("unknowns", format!("must be those of the start, which is given by {kind}")))
}

/// The quantity with a name, or an expression.
fn quantity(system: &System, text: &str) -> Result<Quantity, RuntimeError> {
    let formula = system.formula();
    Ok(match Column::parse(text, formula)? {
        Column::Position(i) => Quantity::Number(Part::Position, i),
        Column::Velocity(i) => Quantity::Number(Part::Velocity, i),
        Column::Momentum(i) => Quantity::Number(Part::Momentum, i),
        Column::Action => Quantity::Number(Part::Action, 0),
        Column::Time => return Err(RuntimeError::argument("quantity", "is the time; fit a quantity of the motion")),
        column if column.has_conformal_factor() => {
            let why = format!("{text:?} contains `sigma` or `log_factor`, which are not functions of the state");
            return Err(RuntimeError::argument("quantity", why));
        }
        Column::Expression(expression) => Quantity::Expression(expression),
        // A system with constraints, the only one with multipliers, has been refused.
        Column::Energy | Column::LogFactor | Column::Multiplier(_) => {
            Quantity::Expression(Box::new(formula.expression("energy")?))
        }
    })
}

/// The motion with steps of one length. Those of a number are those of the whole motion, to `end`.
fn with_fixed_steps(system: &System, motion: Motion, end: f64) -> Result<Motion, RuntimeError> {
    let (by, size) = match motion.step_control {
        StepControl::Accuracy { error, by } => {
            let by = by.unwrap_or(if system.formula().constraints() > 0 { UNDER_CONSTRAINTS } else { METHOD });
            let planned = Motion { step_control: StepControl::Accuracy { error, by: Some(by) }, ..motion.clone() };
            (by, system.plan(&planned)?.step_size)
        }
        StepControl::Steps { by, steps: Steps::Size(size) } => (by, size),
        StepControl::Steps { by, steps: Steps::Count(count) } => (by, (end - motion.start.t) / count as f64),
    };
    Ok(Motion { step_control: StepControl::Steps { by, steps: Steps::Size(size) }, ..motion })
}
