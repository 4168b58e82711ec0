//! Requests for a motion.

use crate::{Column, FormulaMethod, Interrupt};
use discrete_herglotz::{AnyIntegrator, Steps};
use formula_lagrangian::Expression;

/// Initial velocities or momenta of a motion.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialVelocity {
    /// The velocities.
    Velocity(Vec<f64>),
    /// The momenta `L_v`.
    Momentum(Vec<f64>),
    /// The momenta, with velocities close to those that correspond to them, as at the end of another motion. Where the
    /// Legendre transformation is not injective, they select the branch.
    MomentumNear {
        /// The momenta.
        p: Vec<f64>,
        /// The velocities.
        v: Vec<f64>,
    },
}

/// Initial state of a motion; each vector has one entry per coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The time.
    pub t: f64,
    /// The position.
    pub q: Vec<f64>,
    /// The velocity, or the momentum.
    pub velocity: InitialVelocity,
    /// The action.
    pub z: f64,
}

impl Start {
    /// At a time, a position, a velocity and an action.
    pub fn new(t: f64, q: impl Into<Vec<f64>>, v: impl Into<Vec<f64>>, z: f64) -> Self {
        Start { t, q: q.into(), velocity: InitialVelocity::Velocity(v.into()), z }
    }
}

/// How a motion is advanced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepControl {
    /// To a relative error of (q, p) and of v, with this integrator or with one that is chosen automatically.
    Accuracy {
        /// The error.
        error: f64,
        /// The integrator.
        by: Option<AnyIntegrator>,
    },
    /// With given steps.
    Steps {
        /// The integrator.
        by: AnyIntegrator,
        /// Their length or number.
        steps: Steps,
    },
}

/// Which states are recorded.
#[derive(Clone, Debug, PartialEq)]
pub enum OutputTimes {
    /// The start, the steps whose number is a multiple of this one, and the end.
    Every(usize),
    /// These times, in the order of the motion.
    At(Vec<f64>),
}

/// Which sign changes of an event function count, in the direction of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both.
    #[default]
    Both,
}

/// A function of time and state whose sign changes are located. Those of a mode of friction or of resting contact, as
/// `slip_x` or `contact_x` by itself, are its changes, at each of which the state is that after it.
#[derive(Clone, Debug)]
pub struct Event {
    /// The function.
    pub function: Expression,
    /// Which sign changes count.
    pub direction: Direction,
    /// Whether the first sign change ends the motion.
    pub terminal: bool,
    /// The time from which sign changes count, in the direction of the motion, so that transients are left out. `None`
    /// means from the start, and is required of a terminal event.
    pub from: Option<f64>,
    /// Expressions that are evaluated at each sign change, in addition to the state there. `sigma` and `log_factor` are
    /// known where `L_z` is constant.
    pub columns: Vec<Expression>,
    /// The number of a reset of the formula, in the order of [`Formula::with_reset`](crate::Formula): the
    /// crossings of the event are then the occurrences of this reset, and its function and direction are not used.
    pub reset: Option<usize>,
}

impl Event {
    /// All sign changes of a function; they do not end the motion, and only the state is recorded.
    pub fn new(function: Expression) -> Self {
        Event { function, direction: Direction::Both, terminal: false, from: None, columns: Vec::new(), reset: None }
    }

    /// The function and the columns.
    pub(crate) fn expressions(&self) -> impl Iterator<Item = &Expression> {
        std::iter::once(&self.function).chain(&self.columns)
    }

    /// The function and the columns, mutable.
    pub(crate) fn expressions_mut(&mut self) -> impl Iterator<Item = &mut Expression> {
        std::iter::once(&mut self.function).chain(&mut self.columns)
    }
}

/// A motion to be computed, and what is recorded of it.
///
/// ```
/// use herglotz_runtime::{Column, Motion, Start, System, StepControl, OutputTimes};
/// let system = System::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", -0.1)])?;
/// let motion = Motion {
///     rows: Some(OutputTimes::At(vec![0.0, 5.0, 10.0])),
///     columns: vec![Column::Time, Column::Position(0), Column::Energy],
///     ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 10.0, StepControl::Accuracy { error: 1e-9, by: None })
/// };
/// let (outcome, rows) = system.record(&motion)?;
/// assert_eq!((outcome.t, rows.len()), (10.0, 3));
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Motion {
    /// The initial state.
    pub start: Start,
    /// The final time, before or after the initial time.
    pub end: f64,
    /// How the motion is advanced.
    pub step_control: StepControl,
    /// A discrete Lagrangian of one's own in the place of the integrator.
    pub method: Option<FormulaMethod>,
    /// The times at which rows of the columns are recorded.
    pub rows: Option<OutputTimes>,
    /// The columns of a row.
    pub columns: Vec<Column>,
    /// The events to be located.
    pub events: Vec<Event>,
    /// Whether the action is in the outcome.
    pub action: bool,
    /// Whether the conformal factor is in the outcome.
    pub conformal_factor: bool,
    /// Whether an error estimate is in the outcome. For given steps it takes a second run with twice as many steps of
    /// half the length, which costs twice as much as the run.
    pub estimate: bool,
    /// The scale of each coordinate by which errors are measured; without it errors are relative to the size of the
    /// whole state.
    pub scales: Option<Vec<f64>>,
    /// Whether a start that violates the constraints of the formula is moved to them; otherwise it is refused.
    pub project: bool,
    /// Whether the states between the ends of steps, of rows and events, are computed by steps of the integrator that end
    /// there, so that the map to each of them is conformally contact; otherwise they are on polynomials, which are as
    /// accurate and take less time.
    pub exact: bool,
    /// Whether every step is passed to [`RunMonitor::node`](crate::RunMonitor::node).
    pub nodes: bool,
    /// Whether the motion is refused if it could not be interrupted and [resumed](crate::System::resume).
    pub resumable: bool,
    /// When to interrupt the plan, the check or the comparison of the motion; the motion itself is ended by its
    /// [`RunMonitor`](crate::RunMonitor).
    pub interrupt: Option<Interrupt>,
}

impl Motion {
    /// From a start to a time, recording the final state only.
    pub fn new(start: Start, end: f64, step_control: StepControl) -> Self {
        Motion {
            start,
            end,
            step_control,
            method: None,
            rows: None,
            columns: Vec::new(),
            events: Vec::new(),
            action: true,
            conformal_factor: false,
            estimate: false,
            scales: None,
            project: false,
            exact: false,
            nodes: false,
            resumable: false,
            interrupt: None,
        }
    }
}
