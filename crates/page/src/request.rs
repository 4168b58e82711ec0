//! Requests, and answers that are errors.

use crate::host;
use herglotz::runtime::{Interrupt, RuntimeError};
use herglotz::{AnyScene, Scene, SceneError};
use serde::Deserialize;
use serde_json::{Value, json};

/// The time after which a computation is ended, in milliseconds.
const LONGEST: f64 = 10_000.0;

/// By which method motions are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum By {
    /// The integrators of this project.
    #[default]
    Herglotz,
    /// The classical Runge-Kutta method.
    RungeKutta,
}

/// A request to one of the functions.
#[derive(Debug, Deserialize)]
pub struct Request {
    /// The text of the scene.
    pub scene: String,
    /// Values that are changed, such as `gamma=-0.2` and `start.x=1`.
    #[serde(default)]
    pub changes: Vec<String>,
    /// The method.
    #[serde(default)]
    pub by: By,
    /// The number of evaluations of the vector field that the Runge-Kutta method has.
    #[serde(default)]
    pub evaluations: u64,
    /// The integrator, by its name, and the number of its steps, if they are known from a run before.
    #[serde(default)]
    pub steps: Option<(String, usize)>,
    /// The coordinate in whose plane of position and momentum a cloud is.
    #[serde(default)]
    pub coordinate: usize,
    /// The radii of a cloud in the position and in the momentum.
    #[serde(default)]
    pub radii: [f64; 2],
    /// The number of the members of a cloud.
    #[serde(default)]
    pub members: usize,
    /// The number of times at which a cloud is shown, after the start.
    #[serde(default)]
    pub times: usize,
}

impl Request {
    /// Reads a request.
    pub fn read(text: &str) -> Result<Self, Value> {
        serde_json::from_str(text).map_err(|error| refusal(&format!("the request is not understood: {error}")))
    }

    /// The scene with its changes.
    pub fn any(&self) -> Result<AnyScene, Value> {
        AnyScene::read_in(&self.scene, &self.changes, "".as_ref()).map_err(|error| at(&error))
    }

    /// The scene, which must be of a formula.
    pub fn formula(&self, what: &str) -> Result<Box<Scene>, Value> {
        match self.any()? {
            AnyScene::Motion(scene) => Ok(scene),
            _ => Err(refusal(&format!("{what} is of systems with a formula and a start only"))),
        }
    }
}

/// The answer of a function of a request.
pub fn answer(text: &str, of: impl FnOnce(&Request) -> Result<Value, Value>) -> Value {
    Request::read(text).and_then(|request| of(&request)).unwrap_or_else(|error| error)
}

/// An error without a position.
pub fn refusal(message: &str) -> Value {
    json!({ "error": { "message": message } })
}

/// An error with its position in the scene, or in one of the changes.
pub fn at(error: &SceneError) -> Value {
    let found = &error.error;
    json!({ "error": {
        "message": found.message,
        "nearest": found.nearest,
        "line": found.line,
        "column": found.column,
        "length": found.length,
        "of_change": error.file.is_some(),
    } })
}

/// The error of a motion.
pub fn of_motion(scene: &Scene) -> impl Fn(RuntimeError) -> Value {
    |error| at(&scene.explain(&error))
}

/// The time at which a computation that begins now is ended.
#[derive(Clone, Copy)]
pub struct Deadline(f64);

impl Deadline {
    pub fn new() -> Self {
        Deadline(host::now() + LONGEST)
    }

    pub fn is_over(self) -> bool {
        host::now() > self.0
    }

    /// The same for what is computed before a motion starts.
    pub fn interrupt(self) -> Interrupt {
        Interrupt::when(move || self.is_over())
    }
}
