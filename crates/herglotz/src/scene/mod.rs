//! A scene: a system, an initial state, and the requested output.

mod ends;
mod error;
mod file;
mod lattice;
mod location;
mod members;
mod output;
mod overrides;
mod start;
mod sweep;

pub use ends::EndsScene;
pub use error::SceneError;
pub use lattice::LatticeScene;
pub use members::Members;
pub use sweep::Knob;

use crate::runtime::{
    AnyIntegrator, CatalogueEntry, Column, Crossing, Event, Formula, FormulaError, InputError, Motion, RuntimeError,
    Start, StepControl, Steps, System, check_parameters, in_words,
};
use file::{File, RunTable, SystemTable, VERSION};
use location::{Location, Span};
use output::{EventColumns, Events, RowTimes};
use serde::Deserialize;

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
    pub knobs: Vec<Knob>,
    /// The text of the formula.
    lagrangian: String,
    start: Start,
    end: f64,
    way: StepControl,
    rows: RowTimes,
    conformal_factor: bool,
    estimate: bool,
    scales: Option<Vec<f64>>,
    text: String,
    places: Places,
}

/// Positions in the file, for errors that are found after it has been read.
#[derive(Clone, Copy, Debug)]
struct Places {
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
        if let Some(lattice) = file::place_of_table(text, "lattice") {
            let message = "a lattice works only with `herglotz run`; the other commands are for systems of up to 16 \
                           coordinates";
            return Err(SceneError::at(text, lattice, message));
        }
        if let Some(ends) = file::place_of_table(text, "ends") {
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
        let way = way(text, run)?;
        let by = match way {
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
            knobs: sweep::read(text, &formula, &start, &file.sweep)?,
            rows: RowTimes::read(text, file.want.rows.as_ref(), (start.t, end))?,
            system: runs,
            expressions: expressions(&file).cloned().collect(),
            lagrangian: match (entry, &system.lagrangian) {
                (Some(entry), _) => entry.lagrangian.to_owned(),
                (None, own) => own.as_ref().map(|text| (**text).clone()).unwrap_or_default(),
            },
            start,
            end,
            way,
            conformal_factor: file.want.conformal_factor,
            estimate: file.want.estimate,
            scales: run.scales.as_deref().cloned(),
            text: text.to_owned(),
            places: Places {
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
        Motion { scales: self.scales.clone(), ..Motion::new(self.start.clone(), self.end, self.way) }
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
        let Crossing { t, event, q, v, p, z, columns } = crossing;
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
        Members::new(&self.knobs, &self.start)
    }

    /// A text of everything that determines the output, used to distinguish scenes.
    pub fn fingerprint(&self) -> String {
        let events = self.events.iter().map(|(name, e)| (name, e.direction, e.terminal, e.from)).collect::<Vec<_>>();
        let Scene { start, end, way, rows, conformal_factor, expressions, event_columns, .. } = self;
        let formula = self.system.formula();
        let (names, values) = (formula.coordinates(), formula.parameters().collect::<Vec<_>>());
        let of_system = format!("{} {names:?} {values:?}", self.lagrangian);
        format!(
            "{of_system} {start:?} {end:?} {way:?} {rows:?} {conformal_factor} {expressions:?} {events:?} {event_columns:?}"
        )
    }

    /// The error with the position in the file that it concerns.
    pub fn explain(&self, error: &RuntimeError) -> SceneError {
        use InputError as E;
        let places = &self.places;
        let span = match error {
            RuntimeError::NotRegular { .. } | RuntimeError::Formula(_) => places.lagrangian,
            RuntimeError::Input(error) => match error {
                E::Step { .. } | E::NoSteps | E::TooMany { .. } | E::Count { .. } => places.step,
                E::Span { .. } => places.time,
                E::Tolerance { .. } | E::Accuracy { .. } => places.accuracy,
                E::Scale { .. } => places.scales,
                E::NoIntegrator | E::Unclaimed { .. } | E::Hypothesis { .. } | E::Stages { .. } => places.integrator,
                E::FalseClaim { .. } => places.lagrangian,
                E::Times { .. } => places.rows,
                E::Undefined | E::FirstStep(_) | E::Sigma { .. } | E::TimeTransformation { .. } | E::EqualPoints => {
                    places.start
                }
                _ => places.run,
            },
            RuntimeError::Length { what: "scales", .. } => places.scales,
            RuntimeError::Length { .. } | RuntimeError::NotFinite { .. } | RuntimeError::Geometry(_) => places.start,
            _ => places.run,
        };
        SceneError::at(&self.text, span, error.to_string())
    }
}

/// Rejects a file of another version, before its new names are reported as unknown.
fn check_version(text: &str) -> Result<(), SceneError> {
    #[derive(Deserialize)]
    struct Versioned {
        version: Option<Location<i64>>,
    }
    // All other errors are left to the reader of the whole file.
    let Ok(Versioned { version: Some(version) }) = toml::from_str(text) else { return Ok(()) };
    if *version == VERSION {
        return Ok(());
    }
    let found = *version;
    let what = if found > VERSION { "requires a newer program; update it, or" } else { "does not exist;" };
    let message = format!("version {found} of scene files {what} write the scene for version {VERSION}");
    Err(SceneError::at(text, version.span(), message))
}

/// The entry of the catalogue that a scene names.
fn entry(text: &str, system: &Location<SystemTable>) -> Result<Option<&'static CatalogueEntry>, SceneError> {
    let refuse = |span, message: &str| Err(SceneError::at(text, span, message));
    match (&system.catalogue, &system.coordinates, &system.lagrangian) {
        (Some(name), None, None) => match CatalogueEntry::find(name) {
            Ok(entry) => Ok(Some(entry)),
            Err(error) => Err(SceneError::at(text, name.span(), error.to_string())),
        },
        (Some(name), ..) => refuse(name.span(), "give a `catalogue` or a `lagrangian` with `coordinates`, not both"),
        (None, Some(_), Some(_)) => Ok(None),
        (None, Some(_), None) => refuse(system.span(), "the system has no `lagrangian`; add it as a string in quotes"),
        (None, None, Some(_)) => {
            refuse(system.span(), "the system has no `coordinates`; add their names, as in coordinates = [\"x\"]")
        }
        (None, None, None) => {
            refuse(system.span(), "the system has neither a `lagrangian` with `coordinates` nor a `catalogue`; add \
                                   one of them")
        }
    }
}

/// The formula of a scene.
fn formula(
    text: &str,
    system: &Location<SystemTable>,
    entry: Option<&'static CatalogueEntry>,
) -> Result<Formula, SceneError> {
    for (name, value) in &system.parameters.0 {
        finite(text, value, name)?;
    }
    let at_system = |error: FormulaError| SceneError::at(text, system.span(), error.to_string());
    let Some(entry) = entry else {
        let (Some(coordinates), Some(lagrangian)) = (&system.coordinates, &system.lagrangian) else {
            return Err(SceneError::at(text, system.span(), "the system has no formula"));
        };
        let names: Vec<&str> = coordinates.iter().map(|name| name.as_str()).collect();
        let values: Vec<(&str, f64)> =
            system.parameters.0.iter().map(|(name, value)| (name.as_str(), **value)).collect();
        return Formula::parse(lagrangian, &names, &values).map_err(|error| match error {
            FormulaError::Parse(mut error) => {
                if error.message.starts_with("unknown name") && error.nearest.is_none() {
                    error.message += "; a parameter needs a value in `parameters` of [system]";
                }
                SceneError::in_string(text, lagrangian.span(), &error)
            }
            FormulaError::Name { ref name, .. } => {
                let of_parameters = system.parameters.0.iter().map(|(key, _)| key);
                let at = coordinates.iter().chain(of_parameters).rfind(|known| ***known == *name).map(Location::span);
                SceneError::at(text, at.unwrap_or(coordinates.span()), error.to_string())
            }
            FormulaError::Dimension { .. } => SceneError::at(text, coordinates.span(), error.to_string()),
            error => at_system(error),
        });
    };
    let mut formula = entry.formula().map_err(|error| SceneError::at(text, system.span(), error.to_string()))?;
    for (name, value) in &system.parameters.0 {
        let known = || entry.parameters.iter().map(|(parameter, _)| *parameter);
        if let Err(error) = formula.set(name, **value) {
            return Err(SceneError::unknown(text, name.span(), name, known(), error.to_string()));
        }
    }
    Ok(formula)
}

/// The texts of columns and events.
fn expressions(file: &File) -> impl Iterator<Item = &String> {
    let columns = file.want.rows.iter().filter_map(|rows| rows.columns.as_ref()).flat_map(|columns| columns.iter());
    let events = file.want.events.iter().flat_map(|event| [&event.when].into_iter().chain(&event.columns));
    columns.chain(events).map(|text| &**text)
}

/// Rejects parameters that occur neither in the formula nor in the texts of columns and events.
fn check_used(text: &str, formula: &Formula, system: &Location<SystemTable>, texts: &[&str]) -> Result<(), SceneError> {
    check_parameters(formula, texts).map_err(|error| {
        let named = |name: &str| system.parameters.0.iter().find(|(known, _)| **known == *name);
        let span = match &error {
            RuntimeError::UnusedParameter { name, .. } => named(name).map(|(name, _)| name.span()),
            _ => None,
        };
        SceneError::at(text, span.unwrap_or(system.span()), error.to_string())
    })
}

/// How a motion is advanced.
fn way(text: &str, run: &Location<RunTable>) -> Result<StepControl, SceneError> {
    let by = run.integrator.as_ref().map(|name| integrator(text, name)).transpose()?;
    let steps = match (&run.step, &run.steps) {
        (Some(_), Some(steps)) => {
            return Err(SceneError::at(
                text,
                steps.span(),
                "give the length `step` or the number `steps` of the steps, not both",
            ));
        }
        (Some(step), None) => Some(Steps::Size(positive(text, step, "step")?)),
        (None, Some(steps)) if **steps == 0 => {
            return Err(SceneError::at(text, steps.span(), "`steps` is 0; it must be at least 1"));
        }
        (None, Some(steps)) => Some(Steps::Count(**steps)),
        (None, None) => None,
    };
    let refuse = |span, message: &str| Err(SceneError::at(text, span, message));
    match (&run.accuracy, by, steps) {
        (Some(accuracy), by, None) => Ok(StepControl::Accuracy { wanted: positive(text, accuracy, "accuracy")?, by }),
        (None, Some(by), Some(steps)) => Ok(StepControl::Steps { by, steps }),
        (Some(accuracy), _, Some(_)) => {
            refuse(accuracy.span(), "give an `accuracy` or the steps, not both: the accuracy determines the step")
        }
        (None, None, Some(_)) => refuse(
            run.span(),
            "the run has steps but no `integrator`; add one, or give an `accuracy` instead of the steps",
        ),
        (None, Some(_), None) => refuse(run.span(), "the run has neither a `step` nor an `accuracy`; add one of them"),
        (None, None, None) => refuse(
            run.span(),
            "the run has no `accuracy`; add it, as in accuracy = 1e-9, or an `integrator` and a `step`",
        ),
    }
}

fn integrator(text: &str, name: &Location<String>) -> Result<AnyIntegrator, SceneError> {
    name.parse().map_err(|_| {
        let all: Vec<String> = AnyIntegrator::all().iter().map(ToString::to_string).collect();
        let message = format!("unknown integrator `{}`; `herglotz list integrators` prints the names", **name);
        SceneError::unknown(text, name.span(), name, all.iter().map(String::as_str), message)
    })
}

/// Checks that a number is finite.
fn finite(text: &str, x: &Location<f64>, name: &str) -> Result<f64, SceneError> {
    if x.is_finite() {
        return Ok(**x);
    }
    Err(SceneError::at(text, x.span(), format!("`{name}` is {:?}; it must be a finite number", **x)))
}

/// Checks that a number is positive and finite.
fn positive(text: &str, x: &Location<f64>, name: &str) -> Result<f64, SceneError> {
    if **x > 0.0 {
        return finite(text, x, name);
    }
    Err(SceneError::at(text, x.span(), format!("`{name}` is {:?}; it must be a positive number", **x)))
}

/// The JSON schema of scene files.
pub fn schema() -> serde_json::Value {
    /// A motion of a Lagrangian or of a lattice with the requested output, or a path between two ends.
    #[derive(schemars::JsonSchema)]
    #[schemars(title = "Scene", untagged)]
    #[expect(dead_code, reason = "it stands for its variants, which are read one by one")]
    enum AnyFile {
        System(File),
        Lattice(lattice::LatticeFile),
        Ends(ends::EndsFile),
    }
    schemars::schema_for!(AnyFile).to_value()
}
