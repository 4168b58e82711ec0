//! Scenes of motions from an initial state.

use super::constraints::with_constraints;
use super::file::{self, EventTable, File, RunTable};
use super::fit::{self, SceneFit};
use super::forces::{with_forces, with_friction};
use super::location::{Location, Named, Span};
use super::members::Members;
use super::only::set;
use super::output::{self, EventColumns, Events, RowTimes, times_in_order};
use super::resets::with_resets;
use super::start::StartNames;
use super::step_control::step_control;
use super::sweep::{self, SweptQuantity};
use super::system::{check_used, entry, formula};
use super::{SceneError, start, sum_of_terms, tables};
use crate::runtime::{
    AfterReset, Column, Crossing, Event, InputError, Motion, MotionFit, RuntimeError, SelectionFailure, Start,
    StepControl, StepError, System, Table, in_words, velocity_name,
};
use std::path::Path;

/// A scene that has been read and validated.
#[derive(Clone)]
pub struct Scene {
    /// The system.
    pub system: System,
    /// The columns with their names, in their order.
    pub columns: Vec<(String, Column)>,
    /// The events with the texts of their functions, in their order.
    pub events: Vec<(String, Event)>,
    event_columns: EventColumns,
    angles: Vec<String>,
    /// The texts of all columns and events.
    expressions: Vec<String>,
    /// The swept quantities with their values.
    pub swept: Vec<SweptQuantity>,
    fit: Option<SceneFit>,
    /// The text of the formula.
    lagrangian: String,
    start: Start,
    end: f64,
    step_control: StepControl,
    rows: RowTimes,
    /// Forces, constraints, tables, breaks and resets in one text, to distinguish scenes.
    additions: String,
    conformal_factor: bool,
    estimate: bool,
    scales: Option<Vec<f64>>,
    project: bool,
    exact: bool,
    text: String,
    spans: Spans,
}

/// Positions in the file, for errors that are found after it has been read.
#[derive(Clone, Copy, Debug)]
struct Spans {
    lagrangian: Span,
    force: Span,
    start: Span,
    run: Span,
    time: Span,
    accuracy: Span,
    scales: Span,
    integrator: Span,
    step: Span,
    rows: Span,
}

impl Scene {
    /// Reads a scene file.
    ///
    /// ```
    /// let scene = herglotz::Scene::read(r#"
    ///     [system]
    ///     coordinates = ["theta"]
    ///     lagrangian = "theta'^2/2 + cos(theta) + gamma*z"
    ///     parameters = { gamma = -0.1 }
    ///     [start]
    ///     theta = 1.0
    ///     "theta'" = 0.0
    ///     [run]
    ///     time = 100.0
    ///     accuracy = 1e-10
    /// "#)?;
    /// assert_eq!(scene.motion().end, 100.0);
    /// # Ok::<(), herglotz::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text.
    pub fn read(text: &str) -> Result<Self, SceneError> {
        Self::read_with(text, &[])
    }

    /// Reads a scene file and overrides some of its values: `gamma=-0.2` for a parameter, `start.x=1`, `run.time=10`,
    /// `run.accuracy=1e-6`, `run.step=0.1`, `run.steps=100`, `run.integrator=gauss_8`. Of the accuracy and the steps,
    /// the one that is set last counts.
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text, or in the override.
    pub fn read_with(text: &str, changes: &[String]) -> Result<Self, SceneError> {
        Self::read_in(text, changes, Path::new(""))
    }

    /// The same for a scene in a folder, to which the paths of its tables are relative; otherwise they are relative to
    /// the current directory.
    ///
    /// # Errors
    /// Those of [`read_with`](Self::read_with).
    pub fn read_in(text: &str, changes: &[String], folder: &Path) -> Result<Self, SceneError> {
        let file = file::read(text, changes)?;
        if let Some(body) = &file.system.body {
            let message = "a rigid body works only with `herglotz run`, `plan`, `check` and `sweep`; the other commands are for \
                           systems given by formulas";
            return Err(SceneError::at(text, body.span(), message));
        }
        if let Some(ends) = &file.ends {
            let message = "a path between ends works only with `herglotz run`; the other commands are for motions \
                           from a start";
            return Err(SceneError::at(text, ends.span(), message));
        }
        Self::of(text, &file, folder)
    }

    /// Reads the tables of a scene.
    pub(super) fn of(text: &str, file: &File, folder: &Path) -> Result<Self, SceneError> {
        let entry = entry(text, &file.system)?;
        let tables = tables::read(text, folder, &file.tables)?;
        let formula = formula(text, &file.system, entry, &tables)?;
        let formula = with_forces(text, formula, file.force.as_ref())?;
        let formula = with_constraints(text, formula, file.system.constraints.as_ref())?;
        let (system, run) = (&file.system, &file.run);
        let header = file.start.as_ref().map_or(system.span(), Location::span);
        let lattice = sum_of_terms::lattice(system);
        let names = StartNames::of(&formula).with_lattice(lattice.as_ref());
        let start = start::read(text, &names, file.start.as_deref(), entry, header)?;
        let formula = with_friction(text, formula, &file.friction)?;
        let end = run.end(text, run.span())?;
        let breaks = run.breaks.as_deref().map(Vec::as_slice).unwrap_or_default();
        let breaks = times_in_order(text, breaks, "breaks", (start.t, end))?;
        let with_breaks = formula.with_breaks(&breaks);
        let formula = with_breaks.map_err(|error| SceneError::at(text, run.span(), error.to_string()))?;
        let (formula, resets) = with_resets(text, formula, &file.want.events)?;
        let texts: Vec<&str> = expressions(file).map(String::as_str).collect();
        check_used(text, &formula, system, &texts)?;
        tables::check_used(text, &tables, || all_formulas(file))?;
        let source = system.lagrangian.as_ref().or(system.hamiltonian.as_ref());
        let lagrangian = source.map_or(system.span(), Location::span);
        let runs = System::new(&formula).map_err(|error| output::of_formula(text, lagrangian, &error))?;
        let step_control = step_control(text, run)?;
        let by = match step_control {
            StepControl::Accuracy { by, .. } => by,
            StepControl::Steps { by, .. } => Some(by),
        };
        if let (Some(by), Some(name)) = (by, &run.integrator) {
            let refused = |error: InputError| SceneError::at(text, name.span(), in_words(&error));
            runs.check_integrator(by).map_err(refused)?;
        }
        let known_factor = runs.structure().has_constant_rate() && !formula.has_conformal_impacts();
        let of_events = (file.want.events.as_slice(), resets.as_slice());
        let events = Events::read(text, (&formula, known_factor), of_events, (start.t, end))?;
        let columns = output::columns(text, &formula, file.want.rows.as_ref())?;
        let of_state = output::state_of_event(&formula);
        let of_rows = columns.iter().map(|(name, _)| name);
        let named = formula.coordinates();
        let named = named.iter().chain(of_rows).chain(if events.events.is_empty() { &[] } else { &of_state[..] });
        let known: Vec<&str> = named.chain(&events.columns.names).map(String::as_str).collect();
        Ok(Scene {
            angles: output::angles(text, &file.want.wrap, &known)?,
            columns,
            events: events.events,
            event_columns: events.columns,
            swept: sweep::read(text, &formula, &start, &file.sweep)?,
            fit: match &file.fit {
                Some(table) => Some(fit::Reader { text, folder, formula: &formula, start: &start, end }.read(table)?),
                None => None,
            },
            rows: RowTimes::read(text, file.want.rows.as_ref(), (start.t, end))?,
            system: runs,
            expressions: expressions(file).cloned().collect(),
            additions: additions(file, &tables),
            lagrangian: match (entry, source, sum_of_terms::read(text, system)?) {
                (Some(entry), ..) => entry.lagrangian.to_owned(),
                (None, Some(own), _) => (**own).clone(),
                (None, None, terms) => terms.map(|terms| terms.lagrangian).unwrap_or_default(),
            },
            start,
            end,
            step_control,
            conformal_factor: set(&file.want.conformal_factor).is_some(),
            estimate: set(&file.want.estimate).is_some(),
            scales: run.scales.as_deref().cloned(),
            project: set(&run.project).is_some(),
            exact: set(&run.exact).is_some(),
            text: text.to_owned(),
            spans: Spans {
                lagrangian,
                force: file.force.as_ref().map_or(header, Location::span),
                start: header,
                run: run.span(),
                time: RunTable::span_of(&run.time, run.span()),
                accuracy: RunTable::span_of(&run.accuracy, run.span()),
                scales: RunTable::span_of(&run.scales, run.span()),
                integrator: RunTable::span_of(&run.integrator, run.span()),
                step: run
                    .step
                    .as_ref()
                    .map(Location::span)
                    .or(run.steps.as_ref().map(Location::span))
                    .unwrap_or(run.span()),
                rows: file.want.rows.as_ref().map_or(run.span(), Location::span),
            },
        })
    }

    /// The motion with the requested output.
    pub fn motion(&self) -> Motion {
        Motion {
            rows: Some(self.rows.when(self.start.t, self.end)),
            columns: self.columns.iter().map(|(_, column)| column.clone()).collect(),
            events: self.events.iter().map(|(_, event)| event.clone()).collect(),
            conformal_factor: self.conformal_factor,
            estimate: self.estimate,
            ..self.bare_motion()
        }
    }

    /// The motion with no output but its end.
    pub fn bare_motion(&self) -> Motion {
        let motion = Motion::new(self.start.clone(), self.end, self.step_control);
        Motion { scales: self.scales.clone(), project: self.project, exact: self.exact, ..motion }
    }

    /// The fit of its motion to data, if it has one.
    pub fn motion_fit(&self) -> Option<MotionFit> {
        self.fit.as_ref().map(|fit| fit.of(self.bare_motion()))
    }

    /// The columns of events.csv after the name of the event: the state there, the columns of the events, and with
    /// resets the coordinates, velocities and action after a reset.
    pub fn columns_of_events(&self) -> Vec<String> {
        let mut columns = output::state_of_event(self.system.formula());
        columns.extend(self.event_columns.names.iter().cloned());
        if self.has_resets() {
            let names = self.system.formula().coordinates();
            let velocities = names.iter().map(|name| velocity_name(name));
            let state = names.iter().cloned().chain(velocities).chain([self.system.formula().action().to_owned()]);
            columns.extend(state.map(|name| format!("{name} after")));
        }
        columns
    }

    /// Whether an event changes the state.
    fn has_resets(&self) -> bool {
        self.events.iter().any(|(_, event)| event.reset.is_some())
    }

    /// The coordinates and the columns of the first event, by name.
    pub fn columns_of_first_event(&self) -> Vec<String> {
        let EventColumns { names, of_event } = &self.event_columns;
        let own = of_event.first().into_iter().flatten().filter_map(|place| names.get(*place));
        self.system.formula().coordinates().into_iter().chain(own.cloned()).collect()
    }

    /// The numbers of a sign change in these columns; `None` in columns of other events.
    pub fn numbers_of_event(&self, crossing: &Crossing) -> Vec<Option<f64>> {
        let Crossing { t, event, q, v, p, z, columns, after, .. } = crossing;
        let of_state = [*t].into_iter().chain(q.iter().chain(v).chain(p).copied()).chain([*z]).map(Some);
        let EventColumns { names, of_event } = &self.event_columns;
        let own = of_event.get(*event).map(Vec::as_slice).unwrap_or_default();
        let place = |column: usize| own.iter().position(|known| *known == column);
        let own = (0..names.len()).map(|column| columns.get(place(column)?).copied());
        let mut numbers: Vec<Option<f64>> = of_state.chain(own).collect();
        match after {
            _ if !self.has_resets() => {}
            Some(AfterReset { q, v, z, .. }) => numbers.extend(q.iter().chain(v).chain([z]).copied().map(Some)),
            None => numbers.extend(std::iter::repeat_n(None, 2 * q.len() + 1)),
        }
        numbers
    }

    /// Whether a column of rows or events is an angle, which figures show from -pi to pi.
    pub fn is_angle(&self, column: &str) -> bool {
        self.angles.iter().any(|angle| angle == column)
    }

    /// The number of steps between two rows, where rows are given by steps.
    pub fn rows_every_step(&self) -> Option<usize> {
        match self.rows {
            RowTimes::EveryStep(steps) => Some(steps),
            _ => None,
        }
    }

    /// The members of its sweep.
    pub fn members(&self) -> Members<'_> {
        Members::new(&self.swept, &self.start)
    }

    /// A text of everything that determines the output, used to distinguish scenes.
    pub fn fingerprint(&self) -> String {
        let events = self.events.iter().map(|(name, e)| (name, e.direction, e.terminal, e.from)).collect::<Vec<_>>();
        let Scene { start, end, step_control, rows, conformal_factor, expressions, event_columns, additions, .. } =
            self;
        let formula = self.system.formula();
        let (names, values) = (formula.coordinates(), formula.parameters().collect::<Vec<_>>());
        let (momenta, action) = (formula.momenta(), formula.action());
        let kind = if formula.is_hamiltonian() { "H" } else { "L" };
        let of_system = format!("{kind} {} {names:?} {momenta:?} {action} {values:?}", self.lagrangian);
        format!(
            "{of_system} {start:?} {end:?} {step_control:?} {rows:?} {conformal_factor} {expressions:?} {events:?} \
             {event_columns:?} {additions}"
        )
    }

    /// A warning where the parameter gamma is positive, and so is L_z, or -H_z, at the start: most who give it want a drag.
    pub fn gain_of_energy(&self) -> Option<String> {
        let (_, gamma) = self.system.formula().parameters().find(|(name, gamma)| *name == "gamma" && *gamma > 0.0)?;
        let rate = if self.system.formula().is_hamiltonian() {
            self.system.hamiltonian_geometry(&self.start).ok()?.rate
        } else {
            self.system.geometry(&self.start).ok()?.rate
        };
        let message =
            "so that the motion gains energy: for a drag the rate is negative, as in gamma = -0.1 beside gamma*z";
        (rate > 0.0).then(|| format!("gamma is {gamma} and L_z, or -H_z, is {rate} at the start, {message}"))
    }

    /// The error with the position in the file that it concerns.
    pub fn explain(&self, error: &RuntimeError) -> SceneError {
        use InputError as E;
        let spans = &self.spans;
        let span = match error {
            RuntimeError::NotRegular { .. }
            | RuntimeError::Formula(_)
            | RuntimeError::HamiltonianDimension { .. }
            | RuntimeError::ConstrainedDimension { .. }
            | RuntimeError::WithConstraints { .. }
            | RuntimeError::OfFewCoordinates { .. }
            | RuntimeError::OfLagrangians { .. } => spans.lagrangian,
            RuntimeError::HamiltonianUndefined
            | RuntimeError::Constraint { .. }
            | RuntimeError::Input(E::NoMomentum) => spans.start,
            RuntimeError::Input(error) => match error {
                E::Step { .. } | E::NoSteps | E::TooMany { .. } | E::Count { .. } => spans.step,
                E::Span { .. } => spans.time,
                E::Tolerance { .. } | E::Accuracy { .. } => spans.accuracy,
                E::Scale { .. } => spans.scales,
                E::NoIntegrator
                | E::Unclaimed { .. }
                | E::Hypothesis { .. }
                | E::NoTimeTransformation
                | E::Forced { .. }
                | E::Stages { .. } => spans.integrator,
                E::FalseClaim { .. } | E::KinksUnderConstraints => spans.lagrangian,
                E::Times { .. } => spans.rows,
                E::Constraint(_)
                | E::Undefined
                | E::FirstStep(_)
                | E::Sigma { .. }
                | E::TimeTransformation { .. }
                | E::EqualPoints => spans.start,
                _ => spans.run,
            },
            RuntimeError::ForceUndefined { .. } => spans.force,
            RuntimeError::Sensitivity(_) => spans.integrator,
            RuntimeError::Fit(error) => self.fit.as_ref().map_or(spans.run, |fit| fit.span_of(error)),
            RuntimeError::Length { what: "scales", .. } => spans.scales,
            RuntimeError::Length { .. } | RuntimeError::NotFinite { .. } | RuntimeError::Geometry(_) => spans.start,
            _ => spans.run,
        };
        let accumulation = failed_step(error).and_then(|cause| self.accumulation(cause));
        SceneError::at(&self.text, span, accumulation.unwrap_or_else(|| error.to_string()))
    }

    /// What is said of a step that fails where resets accumulate.
    pub fn accumulation(&self, cause: &StepError) -> Option<String> {
        let StepError::Accumulation { t } = cause else { return None };
        Some(format!(
            "resets accumulate at t = {t}: infinitely many of them occur before this time; end the run before it, or \
             let `rest` of the event assign the state from which the motion continues: the velocity of the surface, where \
             the motion then stays as in scenes/bouncing.toml, or a state that leaves it"
        ))
    }
}

/// The cause for which a step fails however short it is, of an accuracy that is not reached.
fn failed_step(error: &RuntimeError) -> Option<&StepError> {
    match error {
        RuntimeError::Input(InputError::Accuracy { cause: SelectionFailure::StepFailed { cause, .. }, .. }) => {
            Some(cause)
        }
        _ => None,
    }
}

/// The texts of columns and events.
fn expressions(file: &File) -> impl Iterator<Item = &String> {
    let columns = file.want.rows.iter().filter_map(|rows| rows.columns.as_ref()).flat_map(|columns| columns.iter());
    let events = file.want.events.iter().flat_map(|event| [&event.when].into_iter().chain(&event.columns));
    columns.chain(events).map(|text| &**text)
}

/// The values of a table of formulas.
fn values(table: &Option<Location<Named<String>>>) -> impl Iterator<Item = &str> {
    table.iter().flat_map(|table| &table.0).map(|(_, value)| value.as_str())
}

/// All formulas of a scene in which a table can be.
fn all_formulas(file: &File) -> Vec<&str> {
    let system = file.system.lagrangian.iter().chain(&file.system.hamiltonian).map(|text| text.as_str());
    let resets = file.want.events.iter().flat_map(|event| [&event.then, &event.rest]).flat_map(values);
    let fit = file.fit.iter().flat_map(|fit| fit.formulas());
    let others = expressions(file).map(String::as_str);
    let friction = file.friction.0.iter().flat_map(|(_, of)| of.formulas()).map(|text| text.as_str());
    system.chain(values(&file.force)).chain(friction).chain(others).chain(resets).chain(fit).collect()
}

/// Forces, constraints, tables, breaks and resets in one text.
fn additions(file: &File, tables: &[(Location<String>, Table)]) -> String {
    let pairs = |table: &Option<Location<Named<String>>>| {
        let all = table.iter().flat_map(|table| &table.0);
        all.map(|(name, value)| format!("{} = {}", **name, **value)).collect::<Vec<_>>()
    };
    let of_event = |event: &EventTable| {
        let rest = event.rest.as_ref().map(|_| pairs(&event.rest));
        format!("{:?} {:?} {rest:?}", pairs(&event.then), event.impact.as_deref())
    };
    let resets: Vec<String> = file.want.events.iter().map(of_event).collect();
    let breaks: Vec<f64> = file.run.breaks.iter().flat_map(|breaks| breaks.iter()).map(|t| **t).collect();
    let constraints: Vec<&str> =
        file.system.constraints.iter().flat_map(|all| all.iter()).map(|c| c.as_str()).collect();
    let constraints = if constraints.is_empty() {
        String::new()
    } else {
        format!(" {constraints:?} {}", set(&file.run.project).is_some())
    };
    let exact = if set(&file.run.exact).is_some() { " exact" } else { "" };
    let friction: Vec<String> = file
        .friction
        .0
        .iter()
        .map(|(name, of)| format!("{} {:?}", **name, of.formulas().map(|text| text.as_str()).collect::<Vec<_>>()))
        .collect();
    let friction = if friction.is_empty() { String::new() } else { format!(" {friction:?}") };
    format!(
        "{:?} {} {breaks:?} {resets:?}{constraints}{exact}{friction}",
        pairs(&file.force),
        tables::fingerprint(tables)
    )
}
