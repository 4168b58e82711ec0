//! What is asked of a motion.

use crate::{Column, Interrupt};
use discrete_herglotz::{AnyIntegrator, Steps};
use formula_lagrangian::Expression;

/// What a motion starts with beside its position.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialVelocity {
    /// The velocities.
    Velocity(Vec<f64>),
    /// The momenta `L_v`.
    Momentum(Vec<f64>),
    /// The momenta with velocities near those that belong to them, as at the end of another motion: where a momentum has several, these are
    /// the ones of it.
    MomentumNear {
        /// The momenta.
        p: Vec<f64>,
        /// The velocities.
        v: Vec<f64>,
    },
}

/// Where a motion starts: as many numbers in each vector as there are coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The time.
    pub t: f64,
    /// The position.
    pub q: Vec<f64>,
    /// The velocity, or the momentum.
    pub rate: InitialVelocity,
    /// The action.
    pub z: f64,
}

impl Start {
    /// At a time, a position, a velocity and an action.
    pub fn new(t: f64, q: impl Into<Vec<f64>>, v: impl Into<Vec<f64>>, z: f64) -> Self {
        Start { t, q: q.into(), rate: InitialVelocity::Velocity(v.into()), z }
    }
}

/// How a motion is advanced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepControl {
    /// To a relative error of (q, p) and v, by this integrator, or by one that is chosen for it.
    Accuracy {
        /// The error.
        wanted: f64,
        /// The integrator.
        by: Option<AnyIntegrator>,
    },
    /// By given steps.
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
    /// The start, every so many steps, and the end.
    Every(usize),
    /// These times, in the order of the motion.
    At(Vec<f64>),
}

/// Which changes of sign of an event count, in the sense of the motion.
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

/// A function of the state whose changes of sign are to be found.
#[derive(Clone, Debug)]
pub struct Event {
    /// The function.
    pub function: Expression,
    /// Which changes count.
    pub direction: Direction,
    /// Whether the first one ends the motion.
    pub terminal: bool,
    /// The time from which they count, in the sense of the motion, so that transients are left out; from the start where it is `None`, as
    /// it is of a terminal event.
    pub from: Option<f64>,
    /// What is evaluated at each, beside the state there. `sigma` and `log_factor` are known where `L_z` is constant.
    pub columns: Vec<Expression>,
}

impl Event {
    /// All changes of sign of a function, which do not end the motion, with nothing beside the state.
    pub fn new(function: Expression) -> Self {
        Event { function, direction: Direction::Both, terminal: false, from: None, columns: Vec::new() }
    }

    /// The function and the columns.
    pub(crate) fn expressions(&self) -> impl Iterator<Item = &Expression> {
        std::iter::once(&self.function).chain(&self.columns)
    }

    /// The same, to be changed.
    pub(crate) fn expressions_mut(&mut self) -> impl Iterator<Item = &mut Expression> {
        std::iter::once(&mut self.function).chain(&mut self.columns)
    }
}

/// A motion to be computed, with all that is to be recorded of it.
///
/// ```
/// use runtime_herglotz::{Column, Motion, Start, System, StepControl, OutputTimes};
/// let system = System::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", -0.1)])?;
/// let motion = Motion {
///     rows: Some(OutputTimes::At(vec![0.0, 5.0, 10.0])),
///     columns: vec![Column::Time, Column::Position(0), Column::Energy],
///     ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 10.0, StepControl::Accuracy { wanted: 1e-9, by: None })
/// };
/// let (outcome, rows) = system.record(&motion)?;
/// assert_eq!((outcome.t, rows.len()), (10.0, 3));
/// # Ok::<(), runtime_herglotz::RuntimeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Motion {
    /// Where it starts.
    pub start: Start,
    /// The time at which it ends, before or after that of the start.
    pub end: f64,
    /// How it is advanced.
    pub way: StepControl,
    /// The states that are recorded, as rows of the columns.
    pub rows: Option<OutputTimes>,
    /// What a row has.
    pub columns: Vec<Column>,
    /// The changes of sign that are to be found.
    pub events: Vec<Event>,
    /// Whether the outcome has the action.
    pub action: bool,
    /// Whether the outcome has the conformal factor.
    pub conformal_factor: bool,
    /// Whether the outcome has an estimate of its error: of given steps by a run with half of them, which costs twice as much.
    pub estimate: bool,
    /// The scale of each coordinate that errors are measured by; without it they are relative to the size of the whole state.
    pub scales: Option<Vec<f64>>,
    /// Whether every step is handed to [`RunMonitor::node`](crate::RunMonitor::node).
    pub nodes: bool,
    /// Whether it is refused where it could not be interrupted and [resumed](crate::System::resume).
    pub resumable: bool,
    /// Whether its plan, its check or its comparison is to end; the motion itself is ended by its [`RunMonitor`](crate::RunMonitor).
    pub interrupt: Option<Interrupt>,
}

impl Motion {
    /// From a start to a time, with nothing recorded but the end.
    pub fn new(start: Start, end: f64, way: StepControl) -> Self {
        Motion {
            start,
            end,
            way,
            rows: None,
            columns: Vec::new(),
            events: Vec::new(),
            action: true,
            conformal_factor: false,
            estimate: false,
            scales: None,
            nodes: false,
            resumable: false,
            interrupt: None,
        }
    }
}
