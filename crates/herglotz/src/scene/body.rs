//! Scenes of a rigid body.

use super::SceneError;
use super::body_file::{BodyEventTable, BodyFile, InertiaTable};
use super::body_overrides;
use super::checked::{check_version, finite};
use super::combinations::Combinations;
use super::file::{DirectionName, RowsTable, span_of_table};
use super::location::{Location, Span};
use super::output::{RowTimes, of_formula};
use super::step_control::step_control;
use super::sweep::{self, Slot, SweptQuantity};
use crate::runtime::{Body, BodyEvent, BodyMotion, BodyTorque, Direction, RuntimeError};

/// A scene of a rigid body that has been read and validated.
pub struct BodyScene {
    /// The body.
    pub body: Body,
    /// The motion, with its rows and events.
    pub motion: BodyMotion,
    /// The functions of the events, as they are written.
    pub events: Vec<String>,
    /// The columns of rows.csv, by their numbers in [`Body::COLUMNS`].
    pub columns: Vec<usize>,
    /// The swept quantities with their values.
    pub swept: Vec<SweptQuantity>,
    rows: RowTimes,
    text: String,
    spans: [(&'static str, Span); 9],
    run: Span,
}

impl BodyScene {
    /// Whether a text is a scene with `[body]`.
    pub fn is_one(text: &str) -> bool {
        span_of_table(text, "body").is_some()
    }

    /// Reads a scene file with `[body]`.
    ///
    /// ```
    /// let scene = herglotz::BodyScene::read(r#"
    ///     [body]
    ///     inertia = [1.0, 2.0, 3.0]
    ///     gamma = -0.1
    ///     [start]
    ///     omega = [1.0, 0.5, 0.25]
    ///     [run]
    ///     time = 10.0
    ///     accuracy = 1e-9
    /// "#)?;
    /// assert_eq!(scene.body.gamma, -0.1);
    /// # Ok::<(), herglotz::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text.
    pub fn read(text: &str) -> Result<Self, SceneError> {
        Self::read_with(text, &[])
    }

    /// Reads a scene file with `[body]` and overrides some of its values: numbers such as `gamma=-0.2`, `mass=2`,
    /// `inertia1=0.5` and `start.omega3=10`, vectors such as `start.omega=[0.0, 0.0, 10.0]`, and those of the run as in
    /// [`Scene::read_with`](super::Scene::read_with).
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text, or in the override.
    pub fn read_with(text: &str, changes: &[String]) -> Result<Self, SceneError> {
        check_version(text)?;
        let mut file: BodyFile = toml::from_str(text).map_err(|error| SceneError::of_format(text, &error))?;
        changes.iter().try_for_each(|change| body_overrides::apply(&mut file, change))?;
        let BodyFile { body: table, start, run, want, .. } = &file;
        let number = |x: &Option<Location<f64>>, name: &str| match x {
            Some(x) => finite(text, x, name),
            None => Ok(0.0),
        };
        let mut body = Body {
            inertia: match *table.inertia {
                InertiaTable::Principal(moments) => Body::principal(moments),
                InertiaTable::Matrix(rows) => rows,
            },
            mass: number(&table.mass, "mass")?,
            centre: table.centre.as_ref().map_or([0.0; 3], |x| **x),
            gravity: table.gravity.as_ref().map_or([0.0; 3], |x| **x),
            gamma: number(&table.gamma, "gamma")?,
            torque: None,
        };
        let of = |x: Option<Span>, otherwise: Span| x.unwrap_or(otherwise);
        let step = run.step.as_ref().map(Location::span).or(run.steps.as_ref().map(Location::span));
        let spans = [
            ("inertia", table.inertia.span()),
            ("mass", of(table.mass.as_ref().map(Location::span), table.span())),
            ("centre", of(table.centre.as_ref().map(Location::span), table.span())),
            ("gravity", of(table.gravity.as_ref().map(Location::span), table.span())),
            ("attitude", of(start.attitude.as_ref().map(Location::span), start.span())),
            ("omega", start.omega.span()),
            ("step", of(step, run.span())),
            ("accuracy", of(run.accuracy.as_ref().map(Location::span), run.span())),
            ("torque", of(table.torque.as_ref().map(Location::span), table.span())),
        ];
        let explain = |error: RuntimeError| explain(text, &spans, run.span(), &error);
        if let Some(torque) = &table.torque {
            let components = torque.each_ref().map(String::as_str);
            body.torque = Some(BodyTorque::parse(components).map_err(|error| match error {
                RuntimeError::Formula(_) => SceneError::at(text, torque.span(), format!("`torque`: {error}")),
                error => explain(error),
            })?);
        }
        // Invalid bodies are refused before all else.
        body.lagrangian().map_err(explain)?;
        if let Some(scales) = &run.scales {
            let message = "the errors of a rigid body are an angle and a relative momentum, which need no `scales`; \
                           remove them";
            return Err(SceneError::at(text, scales.span(), message));
        }
        if let Some(breaks) = &run.breaks {
            let message = "steps of a rigid body end at the times that its `torque` names, as in `if(t > 2, 50, 0)`; \
                           remove `breaks`";
            return Err(SceneError::at(text, breaks.span(), message));
        }
        let end = finite(text, &run.time, "time")?;
        let t = number(&start.t, "t")?;
        let row_times = RowTimes::read(text, want.rows.as_ref(), (t, end))?;
        let motion = BodyMotion {
            t,
            z: number(&start.z, "z")?,
            rows: Some(row_times.when(t, end)),
            events: want.events.iter().map(|event| read_event(text, event)).collect::<Result<_, _>>()?,
            ..BodyMotion::new(
                start.attitude.as_ref().map_or([1.0, 0.0, 0.0, 0.0], |x| **x),
                *start.omega,
                end,
                step_control(text, run)?,
            )
        };
        let columns = columns(text, want.rows.as_ref())?;
        let events = want.events.iter().map(|event| (*event.when).clone()).collect();
        let swept = sweep::read_of_body(text, &file.sweep)?;
        Ok(BodyScene {
            body,
            motion,
            events,
            columns,
            swept,
            rows: row_times,
            text: text.into(),
            spans,
            run: run.span(),
        })
    }

    /// The combinations of the swept values.
    pub fn combinations(&self) -> Combinations<'_> {
        Combinations::new(&self.swept)
    }

    /// The body and the motion of a member of the sweep, without rows.
    pub fn member(&self, index: usize) -> (Body, BodyMotion) {
        let (mut body, mut motion) = (self.body.clone(), BodyMotion { rows: None, ..self.motion.clone() });
        for (swept, value) in self.combinations().at(index) {
            if let Slot::Body(quantity) = swept.slot {
                quantity.put(value, &mut body, &mut motion);
            }
        }
        (body, motion)
    }

    /// A text of everything that determines the output, used to distinguish scenes.
    pub fn fingerprint(&self) -> String {
        let BodyScene { body, motion, events, columns, .. } = self;
        let BodyMotion { t, attitude, omega, z, end, step_control, events: of_motion, .. } = motion;
        let directions: Vec<_> = of_motion.iter().map(|event| (event.direction, event.terminal)).collect();
        format!(
            "{body:?} {t:?} {attitude:?} {omega:?} {z:?} {end:?} {step_control:?} {:?} {columns:?} {events:?} \
             {directions:?}",
            self.rows
        )
    }

    /// The error with the position in the file that it concerns.
    pub fn explain(&self, error: &RuntimeError) -> SceneError {
        explain(&self.text, &self.spans, self.run, error)
    }
}

/// The columns of the rows, by number.
fn columns(text: &str, rows: Option<&Location<RowsTable>>) -> Result<Vec<usize>, SceneError> {
    let Some(names) = rows.and_then(|rows| rows.columns.as_ref()) else {
        return Ok((0..Body::COLUMNS.len()).collect());
    };
    let of = |name: &Location<String>| {
        Body::COLUMNS.iter().position(|known| *known == name.trim()).ok_or_else(|| {
            let message =
                format!("unknown column `{}`; the columns of a rigid body are {}", **name, Body::COLUMNS.join(", "));
            SceneError::unknown(text, name.span(), name, Body::COLUMNS.iter().copied(), message)
        })
    };
    names.iter().map(of).collect()
}

fn read_event(text: &str, table: &BodyEventTable) -> Result<BodyEvent, SceneError> {
    let mut event = BodyEvent::parse(&table.when).map_err(|error| of_formula(text, table.when.span(), &error))?;
    event.direction = match table.direction {
        DirectionName::Rising => Direction::Rising,
        DirectionName::Falling => Direction::Falling,
        DirectionName::Both => Direction::Both,
    };
    event.terminal = table.terminal;
    Ok(event)
}

/// The error with the position of the argument that it names.
fn explain(text: &str, spans: &[(&'static str, Span)], otherwise: Span, error: &RuntimeError) -> SceneError {
    let place = |name: &str| {
        // An entry of a vector is at its list.
        let name = name.split('[').next().unwrap_or(name);
        spans.iter().find(|(known, _)| *known == name).map_or(otherwise, |(_, span)| *span)
    };
    let span = match error {
        RuntimeError::Argument { argument, .. } => place(argument),
        RuntimeError::NotFinite { what, .. } => place(what),
        _ => otherwise,
    };
    SceneError::at(text, span, error.to_string())
}
