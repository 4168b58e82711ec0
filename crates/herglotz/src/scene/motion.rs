//! Scenes of motions from an initial state.

use super::checked::{check_version, finite};
use super::file::{self, File};
use super::location::{Location, Span};
use super::members::Members;
use super::output::{self, EventColumns, Events, RowTimes};
use super::step_control::step_control;
use super::sweep::{self, SweptQuantity};
use super::system::{check_used, entry, formula};
use super::{SceneError, overrides, start};
use crate::runtime::{Column, Crossing, Event, InputError, Motion, RuntimeError, Start, StepControl, System, in_words};

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
    /// The text of the formula.
    lagrangian: String,
    start: Start,
    end: f64,
    step_control: StepControl,
    rows: RowTimes,
    conformal_factor: bool,
    estimate: bool,
    scales: Option<Vec<f64>>,
    text: String,
    spans: Spans,
}

/// Positions in the file, for errors that are found after it has been read.
#[derive(Clone, Copy, Debug)]
struct Spans {
    lagrangian: Span,
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
        check_version(text)?;
        if let Some(lattice) = file::span_of_table(text, "lattice") {
            let message = "a lattice works only with `herglotz run`; the other commands are for systems of up to 16 \
                           coordinates";
            return Err(SceneError::at(text, lattice, message));
        }
        if let Some(ends) = file::span_of_table(text, "ends") {
            let message = "a path between ends works only with `herglotz run`; the other commands are for motions \
                           from a start";
            return Err(SceneError::at(text, ends, message));
        }
        let mut file: File = toml::from_str(text).map_err(|error| SceneError::of_format(text, &error))?;
        let entry = entry(text, &file.system)?;
        for text_of_change in changes {
            overrides::apply(&mut file, entry, text_of_change)?;
        }
        let formula = formula(text, &file.system, entry)?;
        let system = &file.system;
        let texts: Vec<&str> = expressions(&file).map(String::as_str).collect();
        check_used(text, &formula, system, &texts)?;
        let lagrangian = system.lagrangian.as_ref().map_or(system.span(), Location::span);
        let runs = System::new(&formula).map_err(|error| output::of_formula(text, lagrangian, &error))?;
        let run = &file.run;
        let header = file.start.as_ref().map_or(system.span(), Location::span);
        let start = start::read(text, &formula, file.start.as_deref(), entry, header)?;
        let end = finite(text, &run.time, "time")?;
        let step_control = step_control(text, run)?;
        let by = match step_control {
            StepControl::Accuracy { by, .. } => by,
            StepControl::Steps { by, .. } => Some(by),
        };
        if let (Some(by), Some(name)) = (by, &run.integrator) {
            let refused = |error: InputError| SceneError::at(text, name.span(), in_words(&error));
            runs.check_integrator(by).map_err(refused)?;
        }
        let constant_rate = runs.structure().has_constant_rate();
        let events = Events::read(text, (&formula, constant_rate), &file.want.events, (start.t, end))?;
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
            rows: RowTimes::read(text, file.want.rows.as_ref(), (start.t, end))?,
            system: runs,
            expressions: expressions(&file).cloned().collect(),
            lagrangian: match (entry, &system.lagrangian) {
                (Some(entry), _) => entry.lagrangian.to_owned(),
                (None, own) => own.as_ref().map(|text| (**text).clone()).unwrap_or_default(),
            },
            start,
            end,
            step_control,
            conformal_factor: file.want.conformal_factor,
            estimate: file.want.estimate,
            scales: run.scales.as_deref().cloned(),
            text: text.to_owned(),
            spans: Spans {
                lagrangian,
                start: header,
                run: run.span(),
                time: run.time.span(),
                accuracy: run.accuracy.as_ref().map_or(run.span(), Location::span),
                scales: run.scales.as_ref().map_or(run.span(), Location::span),
                integrator: run.integrator.as_ref().map_or(run.span(), Location::span),
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
        Motion { scales: self.scales.clone(), ..Motion::new(self.start.clone(), self.end, self.step_control) }
    }

    /// The columns of events.csv after the name of the event: the state there, and the columns of the events.
    pub fn columns_of_events(&self) -> Vec<String> {
        output::state_of_event(self.system.formula())
            .into_iter()
            .chain(self.event_columns.names.iter().cloned())
            .collect()
    }

    /// The coordinates and the columns of the first event, by name.
    pub fn columns_of_first_event(&self) -> Vec<String> {
        let EventColumns { names, of_event } = &self.event_columns;
        let own = of_event.first().into_iter().flatten().filter_map(|place| names.get(*place));
        self.system.formula().coordinates().into_iter().chain(own.cloned()).collect()
    }

    /// The numbers of a sign change in these columns; `None` in columns of other events.
    pub fn numbers_of_event(&self, crossing: &Crossing) -> Vec<Option<f64>> {
        let Crossing { t, event, q, v, p, z, columns, .. } = crossing;
        let of_state = [*t].into_iter().chain(q.iter().chain(v).chain(p).copied()).chain([*z]).map(Some);
        let EventColumns { names, of_event } = &self.event_columns;
        let own = of_event.get(*event).map(Vec::as_slice).unwrap_or_default();
        let place = |column: usize| own.iter().position(|known| *known == column);
        of_state.chain((0..names.len()).map(|column| columns.get(place(column)?).copied())).collect()
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
        let Scene { start, end, step_control, rows, conformal_factor, expressions, event_columns, .. } = self;
        let formula = self.system.formula();
        let (names, values) = (formula.coordinates(), formula.parameters().collect::<Vec<_>>());
        let of_system = format!("{} {names:?} {values:?}", self.lagrangian);
        format!(
            "{of_system} {start:?} {end:?} {step_control:?} {rows:?} {conformal_factor} {expressions:?} {events:?} {event_columns:?}"
        )
    }

    /// The error with the position in the file that it concerns.
    pub fn explain(&self, error: &RuntimeError) -> SceneError {
        use InputError as E;
        let spans = &self.spans;
        let span = match error {
            RuntimeError::NotRegular { .. } | RuntimeError::Formula(_) => spans.lagrangian,
            RuntimeError::Input(error) => match error {
                E::Step { .. } | E::NoSteps | E::TooMany { .. } | E::Count { .. } => spans.step,
                E::Span { .. } => spans.time,
                E::Tolerance { .. } | E::Accuracy { .. } => spans.accuracy,
                E::Scale { .. } => spans.scales,
                E::NoIntegrator
                | E::Unclaimed { .. }
                | E::Hypothesis { .. }
                | E::NoTimeTransformation
                | E::Stages { .. } => spans.integrator,
                E::FalseClaim { .. } => spans.lagrangian,
                E::Times { .. } => spans.rows,
                E::Undefined | E::FirstStep(_) | E::Sigma { .. } | E::TimeTransformation { .. } | E::EqualPoints => {
                    spans.start
                }
                _ => spans.run,
            },
            RuntimeError::Length { what: "scales", .. } => spans.scales,
            RuntimeError::Length { .. } | RuntimeError::NotFinite { .. } | RuntimeError::Geometry(_) => spans.start,
            _ => spans.run,
        };
        SceneError::at(&self.text, span, error.to_string())
    }
}

/// The texts of columns and events.
fn expressions(file: &File) -> impl Iterator<Item = &String> {
    let columns = file.want.rows.iter().filter_map(|rows| rows.columns.as_ref()).flat_map(|columns| columns.iter());
    let events = file.want.events.iter().flat_map(|event| [&event.when].into_iter().chain(&event.columns));
    columns.chain(events).map(|text| &**text)
}
