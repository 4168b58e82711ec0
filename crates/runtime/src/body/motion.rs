//! Requests for motions of rigid bodies.

use crate::{Body, Direction, Interrupt, OutputTimes, RuntimeError, StepControl};
use formula_lagrangian::{Expression, Formula};

/// The names of the coordinates of an event function: the columns between the time and the energy.
const NAMES: [&str; 16] = [
    "q_w", "q_x", "q_y", "q_z", "Pi1", "Pi2", "Pi3", "omega1", "omega2", "omega3", "M1", "M2", "M3", "tip_x", "tip_y",
    "tip_z",
];

impl Body {
    /// The columns of a row: the time, the attitude as a unit quaternion with the real part first, the body momentum
    /// Pi and the angular velocity omega in the body, the momentum M in space, the [tip](Self::tip) in space, the
    /// energy `Pi . J^-1 Pi/2 - m g . (R X) - gamma z`, and the action z.
    pub const COLUMNS: [&'static str; 19] = [
        "t", "q_w", "q_x", "q_y", "q_z", "Pi1", "Pi2", "Pi3", "omega1", "omega2", "omega3", "M1", "M2", "M3", "tip_x",
        "tip_y", "tip_z", "energy", "z",
    ];
}

/// A function of the [columns](Body::COLUMNS) without the energy, whose sign changes are located.
#[derive(Clone, Debug)]
pub struct BodyEvent {
    function: Expression,
    /// Which sign changes count, in the direction of the motion.
    pub direction: Direction,
    /// Whether the first sign change ends the motion.
    pub terminal: bool,
}

impl BodyEvent {
    /// All sign changes of a function, such as `tip_z - 0.5`; they do not end the motion.
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] with the position in the text; [`RuntimeError::Argument`] for velocities, `energy`,
    /// and the conformal factor, which are not known there.
    pub fn parse(function: &str) -> Result<Self, RuntimeError> {
        // The names are those of a Lagrangian that is not used, whose energy is no quantity of the body.
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let words = function.split(|c| !is_word(c));
        let derived = words.into_iter().find(|word| ["energy", "sigma", "log_factor"].contains(word));
        let momentum = NAMES.iter().map(|name| format!("p_{name}")).find(|name| function.contains(name.as_str()));
        if let Some(name) = derived.map(str::to_owned).or(momentum) {
            let why = format!("contains `{name}`, which an event of a rigid body has not; its names are {}", names());
            return Err(RuntimeError::argument("when", why));
        }
        let function = Formula::parse("0", &NAMES, &[])?.expression(function)?;
        if function.has_velocity() {
            let why = format!("contains a derivative; the names of an event of a rigid body are {}", names());
            return Err(RuntimeError::argument("when", why));
        }
        Ok(BodyEvent { function, direction: Direction::Both, terminal: false })
    }

    /// The value at a row of the [columns](Body::COLUMNS).
    pub fn value(&self, row: &[f64; 19]) -> f64 {
        let (t, z) = (row[0], row[18]);
        row.get(1..17).map_or(f64::NAN, |q| self.function.at(t, q, &[0.0; 16], z))
    }

    /// The partial derivatives at a row, in its columns.
    pub fn gradient(&self, row: &[f64; 19]) -> [f64; 19] {
        let (t, z) = (row[0], row[18]);
        let found = self.function.gradient_at(t, row.get(1..17).unwrap_or_default(), &[0.0; 16], z);
        let mut gradient = [0.0; 19];
        gradient.iter_mut().zip(std::iter::once(&found.t).chain(&found.q)).for_each(|(to, from)| *to = *from);
        gradient[18] = found.z;
        gradient
    }
}

fn names() -> String {
    format!("t, {} and z", NAMES.join(", "))
}

/// A motion of a rigid body to be computed, and what is recorded of it.
#[derive(Clone, Debug)]
pub struct BodyMotion {
    /// The initial time.
    pub t: f64,
    /// The initial attitude, a unit quaternion with the real part first: it takes the body to space.
    pub attitude: [f64; 4],
    /// The initial angular velocity in the body.
    pub omega: [f64; 3],
    /// The initial action.
    pub z: f64,
    /// The final time, before or after the initial time.
    pub end: f64,
    /// How the motion is advanced: Gauss collocation `gauss_s` or a splitting, with steps; or an accuracy of attitude
    /// (in radians) and momentum (relative), for which the number of steps is doubled until two runs agree.
    pub step_control: StepControl,
    /// The times at which rows of the [columns](Body::COLUMNS) are recorded.
    pub rows: Option<OutputTimes>,
    /// The events to be located.
    pub events: Vec<BodyEvent>,
    /// When to interrupt the trial runs for an accuracy, the derivatives and the search of a motion between two attitudes;
    /// the motion itself is ended by its [`RunMonitor`](crate::RunMonitor).
    pub interrupt: Option<Interrupt>,
}

impl BodyMotion {
    /// From an attitude and an angular velocity at t = 0, recording the final state only.
    pub fn new(attitude: [f64; 4], omega: [f64; 3], end: f64, step_control: StepControl) -> Self {
        let (rows, events, interrupt) = (None, Vec::new(), None);
        BodyMotion { t: 0.0, attitude, omega, z: 0.0, end, step_control, rows, events, interrupt }
    }
}
