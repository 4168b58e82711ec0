//! Derivatives of the motions of a system.

use crate::kernel::{Differentiated, of_expression};
use crate::{
    Event, EventAt, Loss, LossGradient, LyapunovExponents, Motion, MotionState, RunMonitor, RuntimeError, Sensitivity,
    System, velocity_name,
};
use discrete_herglotz::sensitivity::Variable;
use formula_lagrangian::{Expression, nearest_name};

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
        self.sensitivity_with_events(motion, variables, times, &[], monitor)
    }

    /// The same with the derivatives of the times of sign changes of events, which a [run](Self::run) of the motion has
    /// found, [resets](Event::reset) among them. Where a terminal event is one of them, the row at its time moves with it:
    /// its derivatives are those of the end of the motion.
    ///
    /// ```
    /// use herglotz_runtime::{Crossing, Event, EventAt, Motion, RunMonitor, Start, StepControl, System};
    /// struct Keep(Vec<EventAt>);
    /// impl RunMonitor for Keep {
    ///     fn crossing(&mut self, crossing: &Crossing) -> std::ops::ControlFlow<()> {
    ///         self.0.push(EventAt { event: crossing.event, t: crossing.t });
    ///         std::ops::ControlFlow::Continue(())
    ///     }
    /// }
    /// let fall = System::parse("x'^2/2 - g*x", &["x"], &[("g", 2.0)])?;
    /// let ground = Event { terminal: true, ..Event::new(fall.formula().expression("x")?) };
    /// let motion = Motion {
    ///     events: vec![ground],
    ///     ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 10.0, StepControl::Accuracy { error: 1e-10, by: None })
    /// };
    /// let mut found = Keep(Vec::new());
    /// fall.run(&motion, &mut found)?;
    /// // The time of the fall is sqrt(2 x / g).
    /// let slopes = fall.sensitivity_with_events(&motion, &["g", "x"], &[], &found.0, &mut ())?;
    /// assert!((slopes.event_times[0][0] + 0.25).abs() < 1e-9 && (slopes.event_times[0][1] - 0.5).abs() < 1e-9);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`sensitivity`](Self::sensitivity); [`RuntimeError::Argument`] for sign changes that the motion does not
    /// have, [`RuntimeError::Sensitivity`] for tangential ones.
    pub fn sensitivity_with_events(
        &self,
        motion: &Motion,
        variables: &[&str],
        times: &[f64],
        crossings: &[EventAt],
        monitor: &mut dyn RunMonitor,
    ) -> Result<Sensitivity, RuntimeError> {
        let variables = &variables.iter().map(|name| self.variable(name)).collect::<Result<Vec<_>, _>>()?;
        self.kernel.sensitivity(motion, Differentiated { variables, times, crossings }, monitor)
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
        check_events(&motion.events)?;
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

    /// Runs a motion, and computes its Lyapunov exponents by its tangent, made orthonormal after each step. They are
    /// those of the discrete motion.
    ///
    /// ```
    /// use herglotz_runtime::{AnyIntegrator, Motion, Start, StepControl, Steps, System};
    /// let well = System::parse("x'^2/2 + x^2/2 - x^4/4 + 0.3*x*cos(t) - z/4", &["x"], &[])?;
    /// let by = AnyIntegrator::Gauss { stages: 6 };
    /// let motion = Motion::new(Start::new(0.0, [0.5], [0.1], 0.0), 50.0, StepControl::Steps { by, steps: Steps::Size(0.1) });
    /// let found = well.lyapunov_exponents(&motion, &mut ())?;
    /// // The sum of a pair is the rate of the conformal factor.
    /// assert!((found.rate + 0.25).abs() < 1e-12 && found.pairing_defect.is_some_and(|defect| defect < 1e-12));
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`sensitivity`](Self::sensitivity).
    pub fn lyapunov_exponents(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LyapunovExponents, RuntimeError> {
        check_events(&motion.events)?;
        self.kernel.lyapunov_exponents(motion, monitor)
    }
}

/// Rejects motions whose end is a time that depends on the variables.
pub(super) fn check_events(events: &[Event]) -> Result<(), RuntimeError> {
    if events.iter().any(|event| event.terminal) {
        let why = "has a terminal event, and derivatives of motions that end at an event are not implemented; remove the \
                   event, or differentiate a motion to a fixed time";
        return Err(RuntimeError::argument("motion", why));
    }
    Ok(())
}
