//! The table of a rigid body.

use super::location::Location;
use schemars::JsonSchema;
use serde::Deserialize;

/// A rigid body about a fixed point.
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
