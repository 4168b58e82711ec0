//! The tables of a scene of a rigid body.

use super::file::{DirectionName, RowsTable, RunTable, Values};
use super::location::Location;
use super::quantities::Quantities;
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
