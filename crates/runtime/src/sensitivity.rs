//! Derivatives of motions.

use crate::member_derivatives::of_expression;
use crate::{Motion, RunMonitor, RuntimeError, System, velocity_name};
use discrete_herglotz::sensitivity::{SensitivityError, Variable};
use discrete_herglotz::{Status, UnresolvedStep};
use formula_lagrangian::{Expression, nearest_name};

/// A state of a motion, or the derivative of one.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionState {
    /// The time; for a derivative 0.
    pub t: f64,
    /// The position.
    pub q: Vec<f64>,
    /// The velocity; NaN where no velocity corresponds to the momentum.
    pub v: Vec<f64>,
    /// The momentum.
    pub p: Vec<f64>,
    /// The action.
    pub z: f64,
}

/// The partial derivatives of a number in a state of a motion; those in the velocity and in the momentum are added.
#[derive(Clone, Debug, PartialEq)]
pub struct StateCovector {
    /// In the time. It counts at the end of a motion only: other times are fixed.
    pub t: f64,
    /// In the position.
    pub q: Vec<f64>,
    /// In the velocity.
    pub v: Vec<f64>,
    /// In the momentum.
    pub p: Vec<f64>,
    /// In the action.
    pub z: f64,
}

impl StateCovector {
    /// No dependence on a state of n coordinates.
    pub fn zero(n: usize) -> Self {
        StateCovector { t: 0.0, q: vec![0.0; n], v: vec![0.0; n], p: vec![0.0; n], z: 0.0 }
    }
}

/// The derivatives of a motion with respect to variables; see [`System::sensitivity`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Sensitivity {
    /// How the motion ended. Where it was not completed there are rows up to its end only.
    pub status: Status,
    /// The first step that was found not to resolve the motion.
    pub unresolved: Option<UnresolvedStep>,
    /// The state at each time that was reached.
    pub states: Vec<MotionState>,
    /// The derivatives of each of these states, in the order of the variables.
    pub rows: Vec<Vec<MotionState>>,
    /// The largest derivative along the motion divided by the largest one at its end, at least one: round-off of the
    /// derivatives is amplified by it.
    pub growth: f64,
}

/// The gradient of a number with respect to the variables of a motion; see [`System::gradient`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Gradient {
    /// In the initial position.
    pub q: Vec<f64>,
    /// In the initial velocity, or in the initial momentum where that was given.
    pub velocity: Vec<f64>,
    /// In the initial action.
    pub z: f64,
    /// In the parameters, in their order.
    pub parameters: Vec<f64>,
    /// In the initial time, for a fixed final time and a fixed number of steps.
    pub t0: f64,
    /// In the final time, for a fixed number of steps.
    pub t_end: f64,
    /// The largest derivative along the motion divided by the one at its start, at least one: round-off of the gradient
    /// is amplified by it.
    pub growth: f64,
}

/// A number that depends on a motion, with its gradient.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LossGradient {
    /// How the motion ended.
    pub status: Status,
    /// The value and the gradient; `None` where the motion was not completed.
    pub loss: Option<(f64, Gradient)>,
}

/// A function of states of a motion: its value, and its partial derivatives in each of them.
pub type Loss<'l> = dyn FnMut(&[MotionState]) -> (f64, Vec<StateCovector>) + 'l;

impl System {
    /// Runs a motion, and differentiates its states at some times, which are in the order of the motion, with respect to
    /// variables, by the tangents of its steps. The variables are given by name: coordinates `x`, velocities `x'` or,
    /// where the start is given by its momentum, momenta `p_x`, also `q[0]` and `v[0]`; the action `z`; parameters; the initial time `t0` for a
    /// fixed end; and the final time `t_end`. The number of steps is fixed, also where they are chosen for an accuracy.
    ///
    /// ```
    /// use herglotz_runtime::{Motion, Start, StepControl, System};
    /// let pendulum = System::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)])?;
    /// let start = Start::new(0.0, [1.0], [0.0], 0.0);
    /// let motion = Motion::new(start, 10.0, StepControl::Accuracy { error: 1e-10, by: None });
    /// let found = pendulum.sensitivity(&motion, &["gamma", "theta"], &[10.0], &mut ())?;
    /// println!("d theta/d gamma = {}, d theta/d theta_0 = {}", found.rows[0][0].q[0], found.rows[0][1].q[0]);
    /// let error = pendulum.sensitivity(&motion, &["gama"], &[10.0], &mut ()).unwrap_err();
    /// assert!(error.to_string().ends_with("did you mean `gamma`?"));
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`run`](Self::run); [`RuntimeError::UnknownVariable`]; [`RuntimeError::Sensitivity`] for integrators and
    /// motions without tangents.
    pub fn sensitivity(
        &self,
        motion: &Motion,
        variables: &[&str],
        times: &[f64],
        monitor: &mut dyn RunMonitor,
    ) -> Result<Sensitivity, RuntimeError> {
        let variables = variables.iter().map(|name| self.variable(name)).collect::<Result<Vec<_>, _>>()?;
        check_events(motion)?;
        self.kernel.sensitivity(motion, &variables, times, monitor)
    }

    /// Runs a motion, and computes the value and the gradient of a loss of its states at some times, by the adjoint of
    /// its steps. The gradient is that of the steps that were taken, to round-off. A motion that was not completed has
    /// no gradient.
    ///
    /// # Errors
    /// Those of [`sensitivity`](Self::sensitivity), and [`RuntimeError::Sensitivity`] where the loss or its derivative
    /// is not finite.
    pub fn gradient(
        &self,
        motion: &Motion,
        times: &[f64],
        loss: &mut Loss<'_>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LossGradient, RuntimeError> {
        check_events(motion)?;
        self.kernel.gradient(motion, times, loss, monitor)
    }

    /// The same for an expression of the state at the end, as
    /// [`Formula::expression`](formula_lagrangian::Formula::expression) makes it.
    ///
    /// ```
    /// use herglotz_runtime::{Motion, Start, StepControl, System};
    /// let spring = System::parse("x'^2/2 - k*x^2/2 + gamma*z", &["x"], &[("k", 1.0), ("gamma", -0.1)])?;
    /// let start = Start::new(0.0, [1.0], [0.0], 0.0);
    /// let motion = Motion::new(start, 10.0, StepControl::Accuracy { error: 1e-10, by: None });
    /// let miss = spring.formula().expression("(x - 0.5)^2 + k^2")?;
    /// if let Some((value, gradient)) = spring.end_gradient(&motion, &miss, &mut ())?.loss {
    ///     println!("{value}, in k {}, in gamma {}", gradient.parameters[0], gradient.parameters[1]);
    /// }
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient).
    pub fn end_gradient(
        &self,
        motion: &Motion,
        loss: &Expression,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LossGradient, RuntimeError> {
        let mut explicit = Vec::new();
        let mut of_end = |states: &[MotionState]| {
            let Some(end) = states.last() else { return (f64::NAN, Vec::new()) };
            let (value, covector, parameters) = of_expression(loss, end);
            explicit = parameters;
            (value, vec![covector])
        };
        let mut found = self.gradient(motion, &[motion.end], &mut of_end, monitor)?;
        if let Some((_, gradient)) = &mut found.loss {
            gradient.parameters.iter_mut().zip(&explicit).for_each(|(sum, more)| *sum += more);
        }
        Ok(found)
    }

    /// The variable with a name.
    pub(crate) fn variable(&self, name: &str) -> Result<Variable, RuntimeError> {
        let coordinates = self.formula().coordinates();
        let velocities: Vec<String> = coordinates.iter().map(|name| velocity_name(name)).collect();
        let momenta: Vec<String> = coordinates.iter().map(|name| format!("p_{name}")).collect();
        let parameters: Vec<&str> = self.formula().parameters().map(|(name, _)| name).collect();
        let at = |names: &[String]| names.iter().position(|known| known == name);
        if let Some(i) = at(&coordinates) {
            return Ok(Variable::Position(i));
        }
        if let Some(i) = at(&velocities) {
            return Ok(Variable::Velocity(i));
        }
        if parameters.contains(&name) {
            return Ok(Variable::Parameter(name.to_owned()));
        }
        if let Some(i) = at(&momenta) {
            return Ok(Variable::Momentum(i));
        }
        // Any coordinates and velocities by their index, as in formulas.
        let indexed = |array: &str| (0..coordinates.len()).find(|i| name == format!("{array}[{i}]"));
        if let Some(i) = indexed("q") {
            return Ok(Variable::Position(i));
        }
        if let Some(i) = indexed("v") {
            return Ok(Variable::Velocity(i));
        }
        match name {
            "z" => Ok(Variable::Action),
            "t0" => Ok(Variable::StartTime),
            "t_end" => Ok(Variable::EndTime),
            _ => {
                let own = coordinates.iter().chain(&velocities).map(String::as_str);
                let all: Vec<&str> = own.chain(parameters).chain(["z", "t0", "t_end"]).collect();
                let nearest = nearest_name(name, all.iter().copied().chain(momenta.iter().map(String::as_str)));
                Err(RuntimeError::UnknownVariable {
                    name: name.to_owned(),
                    nearest: nearest.map(str::to_owned),
                    known: all.join(", "),
                })
            }
        }
    }
}

/// Rejects motions whose end is a time that depends on the variables.
pub(crate) fn check_events(motion: &Motion) -> Result<(), RuntimeError> {
    if motion.events.iter().any(|event| event.terminal) {
        let why = "has a terminal event, and derivatives of motions that end at an event are not implemented; remove the \
                   event, or differentiate a motion to a fixed time";
        return Err(RuntimeError::argument("motion", why));
    }
    Ok(())
}

/// The message on a motion without derivatives, without Rust names.
pub(crate) fn in_words(error: &SensitivityError) -> String {
    match error {
        SensitivityError::Input(error) => crate::in_words(error),
        SensitivityError::NoTangent { method, case } => format!(
            "derivatives of motions by {method}{case} are not implemented; Gauss methods such as \"gauss_8\" have those in all \
             variables, splittings and quadrature rules such as \"strang\" and \"midpoint\" in most, the latter for a Lagrangian \
             without kinks, jumps and resets along the motion"
        ),
        error => error.to_string(),
    }
}
