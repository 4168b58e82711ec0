//! The observer of a motion: rows, events, nodes, and polling for interruption.

use super::formula_system::Observed;
use super::sized::coordinates;
use crate::{
    AfterReset, Column, Crossing, Direction, InitialVelocity, Motion, OutputTimes, RunMonitor, RuntimeError, Start,
};
use contact_geom::nalgebra::DMatrix;
use discrete_herglotz::support::sorted;
use discrete_herglotz::{
    Event, Events, InputError, Observer, OutputRequest, Point, Reset, Row, Rows, RunInfo, State, StepView, Stop,
    Terminal, Vector,
};
use formula_lagrangian::Expression;
use std::cell::{Cell, RefCell};
use std::ops::ControlFlow;
use std::rc::Rc;

/// The number of steps between two polls: a poll is then inexpensive compared with the steps.
const STEPS_BETWEEN_POLLS: usize = 256;

/// The round-off of the times of a run, which are sums of its start and of its steps, and of roots within steps, relative to the
/// largest of them.
pub(super) const ROUND_OFF_OF_TIMES: f64 = 64.0 * f64::EPSILON;

/// Observes a motion on behalf of a [`RunMonitor`].
pub(super) struct Recorder<'r> {
    rows: Option<Rows<'r>>,
    columns: &'r [Column],
    /// The numbers of a row, in a buffer that is reused.
    numbers: Vec<f64>,
    crossings: Option<Crossings<'r>>,
    nodes: bool,
    /// Whether there are no rows between the start and the end of the motion.
    rows_at_ends: bool,
    needs: OutputRequest,
    /// The time after which nothing is wanted of the motion.
    until: Option<f64>,
    run_info: Option<RunInfo>,
    dimension: usize,
    lagrangian: &'r dyn Observed,
    monitor: &'r mut dyn RunMonitor,
}

impl<'r> Recorder<'r> {
    pub fn new(
        lagrangian: &'r dyn Observed,
        motion: &'r Motion,
        monitor: &'r mut dyn RunMonitor,
    ) -> Result<Self, RuntimeError> {
        let columns = motion.columns.as_slice();
        let rows = motion.rows.as_ref().map(|when| rows(when, columns)).transpose()?;
        check_events(lagrangian, &motion.events)?;
        let crossings = Crossings::of(lagrangian, &motion.events, Some(&motion.start));
        let needs = |of: Option<OutputRequest>| of.unwrap_or_default();
        let of_rows = needs(rows.as_ref().map(Observer::needs)).and(needs(crossings.as_ref().map(Crossings::needs)));
        let of_all = OutputRequest { action: motion.nodes, saved: motion.resumable, ..OutputRequest::default() };
        Ok(Recorder {
            rows,
            columns,
            numbers: Vec::with_capacity(columns.len()),
            crossings,
            nodes: motion.nodes,
            rows_at_ends: match &motion.rows {
                None => true,
                Some(OutputTimes::Every(_)) => false,
                Some(OutputTimes::At(times)) => times.iter().all(|t| *t == motion.start.t || *t == motion.end),
            },
            needs: of_rows.and(of_all),
            until: None,
            run_info: None,
            dimension: lagrangian.formula().dimension(),
            lagrangian,
            monitor,
        })
    }

    /// Ends the motion after the step that goes beyond a time.
    pub fn until(self, t: Option<f64>) -> Self {
        Recorder { until: t, ..self }
    }

    /// Whether nothing is wanted of the motion after a time. What happens at the end of a step may be in the next one.
    fn is_over(&self, t: f64) -> bool {
        let (Some(until), Some(RunInfo { t0, t_end, .. })) = (self.until, self.run_info) else { return false };
        let beyond = if t_end < t0 { until - t } else { t - until };
        beyond > ROUND_OFF_OF_TIMES * t0.abs().max(t_end.abs())
    }

    /// Passes on the rows, up to a time if one is given.
    fn pass_on_rows(&mut self, until: Option<f64>) -> ControlFlow<Stop> {
        let Some(rows) = &mut self.rows else { return ControlFlow::Continue(()) };
        let backward = self.run_info.is_some_and(|run_info| run_info.t_end < run_info.t0);
        let beyond = |t: f64| until.is_some_and(|end| if backward { t < end } else { t > end });
        for row in rows.rows.drain(..).filter(|row| !beyond(row.t)) {
            self.numbers.clear();
            let lagrangian = self.lagrangian;
            self.numbers.extend(self.columns.iter().map(|column| number(lagrangian, column, &row)));
            if self.monitor.row(&self.numbers).is_break() {
                return ControlFlow::Break(Stop::here("the monitor"));
            }
        }
        ControlFlow::Continue(())
    }

    fn notify(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if self.nodes && (at.last || !at.is_at_rest()) {
            let State { q, p, z } = &at.state;
            // The velocity is set to zero where none corresponds to the momentum; q and p are valid.
            let v = at.velocity().unwrap_or_else(|_| Vector::zeros(q.len()));
            self.monitor.node(at.t, [q, &v, p].map(|x| coordinates(x, self.dimension)), *z);
        }
        let is_due = at.is_at_rest() || at.k.is_multiple_of(STEPS_BETWEEN_POLLS);
        if is_due && self.monitor.wants_present() {
            let (t, v, energy) = (at.t, at.velocity().ok(), at.energy().ok());
            let State { q, p, z } = at.state.clone();
            let row = Row { t, q, v, p, z: Some(z), energy, log_factor: at.log_factor, columns: Vec::new() };
            self.numbers.clear();
            self.numbers.extend(self.columns.iter().map(|column| number(self.lagrangian, column, &row)));
            self.monitor.present(&self.numbers);
        }
        if is_due
            && let Some(RunInfo { t0, t_end, .. }) = self.run_info
            && self.monitor.poll(if t_end == t0 { 1.0 } else { (at.t - t0) / (t_end - t0) }).is_break()
        {
            if let Some(interrupted) = at.resume_state() {
                self.monitor.interrupted(interrupted);
            }
            return ControlFlow::Break(Stop::here("the monitor"));
        }
        if is_due
            && self.monitor.wants_checkpoint()
            && let Some(saved) = at.resume_state()
            && self.monitor.checkpoint(at.k, saved).is_break()
        {
            return ControlFlow::Break(Stop::here("the monitor"));
        }
        ControlFlow::Continue(())
    }
}

/// The rows that have the quantities of these columns.
pub(super) fn rows<'r>(when: &OutputTimes, columns: &[Column]) -> Result<Rows<'r>, InputError> {
    let rows = match when {
        OutputTimes::Every(stride) => Rows::every(*stride)?,
        OutputTimes::At(times) => Rows::at(times.iter().copied())?,
    };
    let any = |of: fn(&Column) -> bool| columns.iter().any(of);
    let velocity = any(|c| match c {
        Column::Velocity(_) | Column::Multiplier(_) => true,
        Column::Expression(e) => e.has_velocity() && !e.is_of_hamiltonian(),
        _ => false,
    });
    let action = any(|c| match c {
        Column::Action | Column::Multiplier(_) => true,
        Column::Expression(e) => e.has_action(),
        _ => false,
    });
    let rows = if velocity { rows.with_velocity() } else { rows };
    let rows = if any(|c| matches!(c, Column::Energy)) { rows.with_energy() } else { rows };
    let rows = if any(Column::has_conformal_factor) { rows.with_conformal_factor() } else { rows };
    Ok(if action { rows } else { rows.without_action() })
}

/// The value of a column in a row; NaN where the row does not have it.
pub(super) fn number(lagrangian: &dyn Observed, column: &Column, row: &Row) -> f64 {
    let of = |vector: Option<&Vector>, i: usize| vector.and_then(|v| v.get(i)).copied().unwrap_or(f64::NAN);
    match column {
        Column::Time => row.t,
        Column::Position(i) => of(Some(&row.q), *i),
        Column::Velocity(i) => of(row.v.as_ref(), *i),
        Column::Momentum(i) => of(Some(&row.p), *i),
        Column::Action => row.z.unwrap_or(f64::NAN),
        Column::Energy => row.energy.unwrap_or(f64::NAN),
        Column::LogFactor => row.log_factor.unwrap_or(f64::NAN),
        Column::Multiplier(i) => match (&row.v, row.z) {
            (Some(v), Some(z)) => lagrangian.multiplier(row.t, &Point::new(row.q.clone(), v.clone(), z), *i),
            _ => f64::NAN,
        },
        Column::Expression(e) => {
            // An expression that does not contain v or z ignores the zeros here.
            let zeros;
            let v = match &row.v {
                _ if e.is_of_hamiltonian() => &row.p,
                Some(v) => v,
                None => {
                    zeros = Vector::zeros(row.q.len());
                    &zeros
                }
            };
            let state = (row.q.as_slice(), v.as_slice(), row.z.unwrap_or(0.0));
            e.at_factor(row.t, state, row.log_factor.unwrap_or(f64::NAN))
        }
    }
}

/// Rejects events with the conformal factor where it is not known at all times, terminal events that count from a given
/// time or have a reset, and events with a reset that the formula does not have.
pub(super) fn check_events(lagrangian: &dyn Observed, events: &[crate::Event]) -> Result<(), RuntimeError> {
    let of_terminal = events.iter().any(|event| event.terminal && event.from.is_some());
    if of_terminal {
        let why = "is given for a terminal event, which is detected from the start of the motion; remove one of the \
                   two";
        return Err(RuntimeError::Argument { argument: "from", why: why.to_owned() });
    }
    if events.iter().any(|event| event.terminal && event.reset.is_some()) {
        let why = "is given for a terminal event, which ends the motion before its reset; remove one of the two";
        return Err(RuntimeError::argument("reset", why));
    }
    if events.iter().any(|event| event.terminal && mode(lagrangian, event).is_some()) {
        let why = "is given for the changes of a mode, which do not end a motion; give a function whose sign changes there, \
                   such as the velocity relative to the surface";
        return Err(RuntimeError::argument("terminal", why));
    }
    if events.iter().any(|event| event.reset.is_some_and(|reset| reset >= lagrangian.resets())) {
        return Err(RuntimeError::argument(
            "reset",
            format!("of an event is not one of the {} resets of the formula", lagrangian.resets()),
        ));
    }
    let has_factor = events.iter().flat_map(crate::Event::expressions).any(Expression::has_conformal_factor);
    let is_known = lagrangian.constant_rate().is_some() && !lagrangian.formula().has_conformal_impacts();
    if has_factor && !is_known { Err(RuntimeError::FactorInEvent) } else { Ok(()) }
}

/// Data of a motion that functions of a state `(q, p, z)` need in addition to the state.
struct EventContext {
    /// The initial time.
    start_time: Cell<f64>,
    /// The last velocity that was found, the initial guess for the next.
    velocity: RefCell<Vector>,
    /// The matrix whose product with the momentum is the velocity, if there is one.
    inverse_mass: RefCell<Option<DMatrix<f64>>>,
}

/// An expression as a function of time and of a state `(q, p, z)` of a motion.
fn at_states<'r>(
    lagrangian: &'r dyn Observed,
    function: &'r Expression,
    context: Rc<EventContext>,
) -> impl FnMut(f64, &State) -> f64 + 'r {
    // `check_events` ensures that the rate is constant wherever it is needed.
    let rate = lagrangian.constant_rate().unwrap_or(f64::NAN);
    move |t, state| {
        if function.has_velocity() {
            let found = match &*context.inverse_mass.borrow() {
                Some(inverse) => Some(Vector::product(inverse, &state.p)),
                None => lagrangian.velocity_or_momentum(t, state, &context.velocity.borrow()),
            };
            match found {
                Some(v) => context.velocity.replace(v),
                None => return f64::NAN,
            };
        }
        let v = context.velocity.borrow();
        function.at_factor(t, (state.q.as_slice(), v.as_slice(), state.z), rate * (t - context.start_time.get()))
    }
}

/// The events of a motion, with the data needed to evaluate them.
pub(super) struct Crossings<'r> {
    lagrangian: &'r dyn Observed,
    /// The events whose sign changes are searched for, and their indices.
    events: Events<'r>,
    searched: Vec<usize>,
    /// The events at which a mode changes, which are at resets, with the number of the mode.
    modes: Vec<(usize, usize)>,
    /// The events as they were requested.
    requested: &'r [crate::Event],
    /// `L_z`, where it is constant: `check_events` ensures that it is known where a column needs it.
    rate: f64,
    /// Whether an event or a column contains the action.
    action: bool,
    /// Whether an event contains the velocity.
    velocity: bool,
    context: Rc<EventContext>,
    backward: bool,
    dimension: usize,
}

impl<'r> Crossings<'r> {
    /// `None` where there are no events.
    pub fn of(lagrangian: &'r dyn Observed, events: &'r [crate::Event], start: Option<&Start>) -> Option<Self> {
        let numbers = match start.map(|start| &start.velocity) {
            Some(InitialVelocity::Velocity(v) | InitialVelocity::MomentumNear { v, .. }) => v.as_slice(),
            _ => &[],
        };
        // The velocity is set to zero where none is given: an expression that does not contain it ignores it.
        let v = Vector::from_fn(lagrangian.formula().dimension(), |i| numbers.get(i).copied().unwrap_or(0.0));
        let (start_time, velocity, inverse_mass) = (Cell::new(0.0), RefCell::new(v), RefCell::new(None));
        let context = Rc::new(EventContext { start_time, velocity, inverse_mass });
        let action = events.iter().flat_map(crate::Event::expressions).any(Expression::has_action);
        let modes = events.iter().enumerate().filter_map(|(i, event)| Some((i, mode(lagrangian, event)?))).collect();
        let is_searched = |i: &usize| events[*i].reset.is_none() && mode(lagrangian, &events[*i]).is_none();
        let searched: Vec<usize> = (0..events.len()).filter(is_searched).collect();
        let all = Events::new(searched.iter().map(|i| of(lagrangian, &events[*i], context.clone())));
        (!events.is_empty()).then(|| Crossings {
            lagrangian,
            events: all,
            searched,
            modes,
            requested: events,
            rate: lagrangian.constant_rate().unwrap_or(f64::NAN),
            action,
            velocity: events.iter().any(|event| event.function.has_velocity()),
            context: context.clone(),
            backward: false,
            dimension: lagrangian.formula().dimension(),
        })
    }

    pub fn needs(&self) -> OutputRequest {
        OutputRequest { action: self.action, ..OutputRequest::default() }
    }

    pub fn prepare(&mut self, run_info: &RunInfo) -> Result<(), InputError> {
        self.context.start_time.set(run_info.t0);
        self.backward = run_info.t_end < run_info.t0;
        self.events.prepare(run_info)
    }

    pub fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if self.velocity {
            // There is none for a Hamiltonian, whose expressions contain the momentum in the place of the velocity.
            self.context.inverse_mass.replace(at.inverse_mass().cloned());
            if let Ok(v) = at.velocity() {
                self.context.velocity.replace(v);
            }
        }
        self.events.start(at)
    }

    /// Whether an event may occur after the motion has come to rest: one whose function depends on time.
    pub fn follows_rest(&self) -> bool {
        let functions = self.searched.iter().filter_map(|i| self.requested.get(*i)).map(|event| &event.function);
        functions.into_iter().any(|function| function.has_time() || function.has_conformal_factor())
    }

    /// The terminal events, at which trial runs end.
    pub fn terminal(&self) -> Option<Terminal<'_>> {
        self.events.terminal()
    }

    /// Passes on the sign changes in a step; `Break` at a terminal event.
    pub fn step(
        &mut self,
        at: &StepView<'_>,
        mut pass_on_rows: impl FnMut(Crossing) -> ControlFlow<()>,
    ) -> ControlFlow<Stop> {
        let ended = self.events.step(at);
        let end = match &ended {
            ControlFlow::Break(Stop { at: Some((t, _)), .. }) => Some(*t),
            _ => None,
        };
        for (event, t, before, after) in self.found(at, end) {
            let requested = self.requested.get(event);
            let from = requested.and_then(|event| event.from);
            if from.is_some_and(|from| if self.backward { t > from } else { t < from }) {
                continue;
            }
            // The velocity at the end of the step is close enough as an initial guess.
            let velocity =
                |state: &State| at.velocity_at(t, state).unwrap_or_else(|_| Vector::repeat(state.q.len(), f64::NAN));
            let v = velocity(&before);
            let State { q, p, z } = before;
            let log_factor = self.rate * (t - self.context.start_time.get());
            let columns = requested.map_or(&[][..], |event| &event.columns).iter();
            let of_expression = if self.lagrangian.formula().is_hamiltonian() { &p } else { &v };
            let state = (q.as_slice(), of_expression.as_slice(), z);
            let columns = columns.map(|e| e.at_factor(t, state, log_factor)).collect();
            let vectors = |x: [&Vector; 3]| x.map(|x| coordinates(x, self.dimension).to_vec());
            let after = after.as_ref().map(|after| {
                let [q, v, p] = vectors([&after.q, &velocity(after), &after.p]);
                AfterReset { q, v, p, z: after.z }
            });
            let [q, v, p] = vectors([&q, &v, &p]);
            if pass_on_rows(Crossing { t, event, q, v, p, z, columns, after }).is_break() {
                return ControlFlow::Break(Stop::here("the monitor"));
            }
        }
        ended
    }

    /// The crossings in a step, up to a time at which the motion ends within it: the index of the event, the time, the
    /// state, and that after a reset. They are in the order of the motion, resets after others at the same time.
    fn found(&mut self, at: &StepView<'_>, end: Option<f64>) -> Vec<Found> {
        let searched = &self.searched;
        let changes = self.events.crossings.drain(..);
        let changes = changes.map(|c| (searched.get(c.event).copied().unwrap_or(usize::MAX), c.t, c.state, None));
        let mut found: Vec<Found> = changes.collect();
        let count = found.len();
        for Reset { t, index, before, after } in at.resets() {
            let Some(reset) = self.lagrangian.reset_of(*index) else { continue };
            if end.is_some_and(|end| if self.backward { *t < end } else { *t > end }) {
                continue;
            }
            if let Some(event) = self.requested.iter().position(|event| event.reset == Some(reset)) {
                found.push((event, *t, before.clone(), Some(after.clone())));
            }
            for (event, mode) in &self.modes {
                let change = after.q[*mode] - before.q[*mode];
                let counts = match self.requested.get(*event).map(|event| event.direction) {
                    Some(Direction::Rising) => change > 0.0,
                    Some(Direction::Falling) => change < 0.0,
                    _ => change != 0.0,
                };
                if counts {
                    found.push((*event, *t, after.clone(), None));
                }
            }
        }
        if found.len() > count {
            found = sorted(&found, |found| found.1, self.backward);
        }
        found
    }
}

/// A crossing: the index of the event, the time, the state, and that after a reset.
type Found = (usize, f64, State, Option<State>);

/// The mode of friction or of resting contact whose changes an event is, if its function is one by itself.
fn mode(lagrangian: &dyn Observed, event: &crate::Event) -> Option<usize> {
    event.function.mode(lagrangian.formula()).filter(|_| event.reset.is_none())
}

fn of<'r>(lagrangian: &'r dyn Observed, event: &'r crate::Event, context: Rc<EventContext>) -> Event<'r> {
    let found = Event::new(at_states(lagrangian, &event.function, context));
    let found = match event.direction {
        Direction::Rising => found.rising(),
        Direction::Falling => found.falling(),
        Direction::Both => found,
    };
    if event.terminal { found.terminal() } else { found }
}

impl Observer for Recorder<'_> {
    fn terminal(&self) -> Option<Terminal<'_>> {
        self.crossings.as_ref().and_then(Crossings::terminal)
    }

    fn needs(&self) -> OutputRequest {
        self.needs
    }

    fn prepare(&mut self, run_info: &RunInfo) -> Result<(), InputError> {
        self.run_info = Some(*run_info);
        if let Some(rows) = &mut self.rows {
            rows.prepare(run_info)?;
        }
        self.crossings.as_mut().map_or(Ok(()), |crossings| crossings.prepare(run_info))
    }

    fn next(&self, taken: usize) -> usize {
        if self.nodes || self.crossings.is_some() {
            return taken + 1;
        }
        let poll = (taken / STEPS_BETWEEN_POLLS + 1) * STEPS_BETWEEN_POLLS;
        self.rows.as_ref().map_or(poll, |rows| rows.next(taken).min(poll))
    }

    fn follows_rest(&mut self, _from: &StepView<'_>, _t_end: f64) -> bool {
        self.crossings.as_ref().is_some_and(Crossings::follows_rest)
    }

    fn sees_only_the_ends(&self) -> bool {
        !self.nodes && self.crossings.is_none() && self.rows_at_ends
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if let Some(rows) = &mut self.rows {
            rows.start(at)?;
        }
        if let Some(crossings) = &mut self.crossings {
            crossings.start(at)?;
        }
        self.pass_on_rows(None)?;
        self.notify(at)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if let Some(rows) = &mut self.rows {
            rows.step(at)?;
        }
        if let Some(crossings) = &mut self.crossings {
            let ended = crossings.step(at, |crossing| self.monitor.crossing(&crossing));
            if let ControlFlow::Break(stop) = ended {
                self.pass_on_rows(stop.at.as_ref().map(|(t, _)| *t))?;
                return ControlFlow::Break(stop);
            }
        }
        self.pass_on_rows(None)?;
        self.notify(at)?;
        if !at.last && self.is_over(at.t) {
            ControlFlow::Break(Stop::here("the last row"))
        } else {
            ControlFlow::Continue(())
        }
    }
}
