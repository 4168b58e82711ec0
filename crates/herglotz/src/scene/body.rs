//! Scenes of a rigid body.

use super::SceneError;
use super::body_overrides;
use super::checked::{check_version, finite};
use super::combinations::Combinations;
use super::file::{DirectionName, RowsTable, RunTable, Values, span_of_table};
use super::location::{Location, Span};
use super::output::{RowTimes, of_formula};
use super::quantities::Quantities;
use super::step_control::step_control;
use super::sweep::{self, Slot, SweptQuantity};
use crate::runtime::{Body, BodyEvent, BodyMotion, BodyTorque, Direction, RuntimeError};
use schemars::JsonSchema;
use serde::Deserialize;

/// A motion of a rigid body about a fixed point.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a scene of a rigid body")]
#[schemars(title = "Scene of a rigid body")]
pub(crate) struct BodyFile {
    /// The version of the format: 1.
    #[expect(dead_code, reason = "it is looked at before all else is read")]
    pub version: Option<Location<i64>>,
    /// The body.
    pub body: Location<BodyTable>,
    /// The initial state.
    pub start: Location<BodyStart>,
    /// The final time, and the accuracy, or the integrator and its steps: a Gauss method such as `gauss_4`, or a
    /// splitting such as `sofroniou_spaletta_10`.
    pub run: Location<RunTable>,
    /// The output.
    #[serde(default)]
    pub want: BodyWant,
    /// Numbers of the body, `inertia1`, `inertia2`, `inertia3`, `mass`, `centre1`, ..., `gravity1`, ..., `gamma`, or of
    /// the start, `start.omega1`, ..., `start.z`, over whose values `herglotz sweep` runs. With several of them all
    /// combinations are run; the last one varies fastest.
    #[serde(default)]
    pub sweep: Quantities<Values>,
}

/// The body.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `inertia`")]
pub(crate) struct BodyTable {
    /// The inertia tensor about the centre of mass, in the body: its principal moments about the axes of the body, or
    /// the rows of a symmetric matrix.
    pub inertia: Location<InertiaTable>,
    /// The mass.
    pub mass: Option<Location<f64>>,
    /// The centre of mass in the body, from the fixed point; by default it is the fixed point.
    pub centre: Option<Location<[f64; 3]>>,
    /// The acceleration of gravity, a vector in space, such as `[0.0, 0.0, -9.81]`.
    pub gravity: Option<Location<[f64; 3]>>,
    /// The rate of the linear drag, negative for dissipation: momenta scale by `e^(gamma t)`.
    pub gamma: Option<Location<f64>>,
    /// A torque that has no potential: its components along the axes of the body, expressions in `t`, the attitude `q_w`,
    /// `q_x`, `q_y`, `q_z`, the angular velocity in the body `omega1`, `omega2`, `omega3`, and `z`. It takes a Gauss method.
    pub torque: Option<Location<[String; 3]>>,
}

/// An inertia tensor.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "three principal moments, or three rows of three numbers")]
#[schemars(inline)]
pub(crate) enum InertiaTable {
    /// The principal moments about the axes of the body.
    Principal([f64; 3]),
    /// The rows of a symmetric matrix.
    Matrix([[f64; 3]; 3]),
}

/// The initial state.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `attitude` and `omega`")]
pub(crate) struct BodyStart {
    /// The attitude, which takes the body to space: a unit quaternion, the real part first; by default `[1, 0, 0, 0]`.
    pub attitude: Option<Location<[f64; 4]>>,
    /// The angular velocity in the body.
    pub omega: Location<[f64; 3]>,
    /// The time; by default 0.
    pub t: Option<Location<f64>>,
    /// The action; by default 0.
    pub z: Option<Location<f64>>,
}

/// The output of a rigid body.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `rows` and `events`")]
pub(crate) struct BodyWant {
    /// The rows of rows.csv; by default, all columns at the ends of 1000 equal intervals. The columns are `t`, the
    /// attitude `q_w`, `q_x`, `q_y`, `q_z`, the momentum in the body `Pi1`, `Pi2`, `Pi3`, the angular velocity in the
    /// body `omega1`, `omega2`, `omega3`, the momentum in space `M1`, `M2`, `M3`, the centre of mass in space `tip_x`,
    /// `tip_y`, `tip_z` (the end of the third axis where the centre is fixed), `energy` and `z`.
    pub rows: Option<Location<RowsTable>>,
    /// Functions of the columns whose sign changes are written to events.csv.
    #[serde(default)]
    pub events: Vec<BodyEventTable>,
}

/// A function of the state of a rigid body whose sign changes are located.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table with `when`")]
pub(crate) struct BodyEventTable {
    /// The function, an expression in the columns of rows except `energy`, such as `tip_z - 0.5`.
    pub when: Location<String>,
    /// Which sign changes count.
    #[serde(default)]
    pub direction: DirectionName,
    /// Whether the first sign change ends the motion.
    #[serde(default)]
    pub terminal: bool,
}

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
            let message = "a rigid body has no formula that could jump in time; remove `breaks`";
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
