//! Derivatives of the times of events.

use crate::sensitivity::parametric_system::Differentiable;
use crate::sensitivity::switch::{MIN_RATE, terms};
use crate::sensitivity::velocity_dependence::VelocityDependence;
use crate::sensitivity::{EndCovector, MotionState, SensitivityError, StateDerivative};
use crate::system::AtState;
use crate::{Components, Point, State, Vector};

/// The derivatives of the time of a zero of a function of the state; see [`MotionState::event_time`].
#[derive(Clone, Debug, PartialEq)]
pub struct EventTime {
    /// The partial derivatives of the time in the state at the fixed time of the zero.
    pub of_state: EndCovector,
    /// The rate of the function along the motion.
    pub rate: f64,
}

impl EventTime {
    /// The derivative of the time in a variable, from that of the state at a fixed time; `explicit` is the partial derivative
    /// of the function itself in the variable, 0 unless the variable is a parameter that the function contains.
    pub fn along(&self, state: &StateDerivative, explicit: f64) -> f64 {
        state.dot(&self.of_state) - explicit / self.rate
    }
}

impl StateDerivative {
    /// The derivative of the state at a time that moves with the derivative `dt`, from this one at a fixed time; `rates` are
    /// those of the state along the motion.
    pub fn at_moving_time(&self, rates: &StateDerivative, dt: f64) -> Self {
        StateDerivative {
            q: &self.q + &rates.q * dt,
            v: &self.v + &rates.v * dt,
            p: &self.p + &rates.p * dt,
            z: self.z + rates.z * dt,
        }
    }
}

impl MotionState {
    /// The rates of the state along the motion: `q' = v`, the acceleration `v'`, `p' = L_q + f + p L_z` and `z' = L`, where f
    /// contains the force of constraints, if there is one.
    ///
    /// # Errors
    /// [`SensitivityError::Step`] where L is not regular.
    pub fn rates(
        &self,
        problem: &Differentiable<'_>,
        of_constraints: Option<&Vector>,
    ) -> Result<StateDerivative, SensitivityError> {
        let failed = |cause| SensitivityError::Step { step: 0, cause };
        let state = State { q: self.q.clone(), p: self.p.clone(), z: self.z };
        let AtState { x, l, mut force, rate } = problem.system().at_state(self.t, &state, &self.v).map_err(failed)?;
        if let Some(of_constraints) = of_constraints {
            force += of_constraints;
        }
        let (q, p) = (x.v.clone(), force + &self.p * rate);
        let of_velocity = VelocityDependence::at(problem, self.t, &x, &self.p).map_err(failed)?;
        Ok(StateDerivative { v: of_velocity.along(&q, &p, l, None, 1.0), q, p, z: l })
    }

    /// The derivatives of the time of a zero of a function of the state, whose partial derivatives in this state are `of`:
    /// this is a state of the motion at a zero, such as that of a [`Crossing`](crate::Crossing), and the time of the zero
    /// has the derivative `dt = -dg / g'`, where dg is the derivative for a fixed time and g' the rate along the motion. The force
    /// of constraints is given where there are any.
    ///
    /// With the derivatives of the state at the fixed time t of the zero, of
    /// [`tangent_at`](crate::Run::tangent_at), it gives the derivatives of the time in the variables; with
    /// [`pullback_at`](crate::sensitivity::RecordedRun::pullback_at) those in the state are its gradient.
    ///
    /// ```
    /// use contact_examples::systems::Pendulum;
    /// use contact_geom::{Scalar, VelocityPoint};
    /// use discrete_herglotz::sensitivity::{DifferentiableProblem, EndState, Loss, Variable};
    /// use discrete_herglotz::{Problem, Steps, Until};
    /// struct Angle;
    /// impl Loss<1> for Angle {
    ///     fn value<T: Scalar>(&self, at: &EndState<1, T>) -> T {
    ///         at.q[0]
    ///     }
    /// }
    /// let pendulum = Pendulum { gamma: -0.1 };
    /// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
    /// let t = 1.703; // The time of a zero, from an observer `Events`.
    /// let variables = [Variable::Position(0)];
    /// let tangent = problem.steps(Steps::Size(0.1)).tangent_at(&variables, &[t], Until::Time(5.0))?;
    /// let row = &tangent.rows[0];
    /// let (_, of_angle) = row.state.differentiate(&Angle);
    /// let time = row.state.event_time((&problem.differentiable(), None), &of_angle)?;
    /// println!("dt/dq0 = {}", time.along(&row.columns[0], 0.0));
    /// # Ok::<(), discrete_herglotz::sensitivity::SensitivityError>(())
    /// ```
    ///
    /// # Errors
    /// [`SensitivityError::Grazing`] where the rate of the function is round-off, [`SensitivityError::Loss`] where its
    /// derivatives are not finite, and those of [`rates`](Self::rates).
    pub fn event_time(
        &self,
        (problem, of_constraints): (&Differentiable<'_>, Option<&Vector>),
        of: &EndCovector,
    ) -> Result<EventTime, SensitivityError> {
        if !of.is_finite() {
            return Err(SensitivityError::Loss { value: f64::NAN });
        }
        let rates = self.rates(problem, of_constraints)?;
        let rate = of.t + rates.dot(of);
        let field = Components { x: rates.q, y: rates.v, z: rates.z };
        // The terms over a unit of the time in which the state changes by its rates.
        let size = terms(of, (self.t, &self.point()), &field, 1.0)
            + of.p.iter().zip(&self.p).map(|(a, b)| (a * b).abs()).sum::<f64>();
        // Written so that a NaN is refused.
        if rate.abs() > MIN_RATE * size {
            let factor = -1.0 / rate;
            let EndCovector { q, v, p, z, .. } = of;
            let of_state = EndCovector { t: 0.0, q: q * factor, v: v * factor, p: p * factor, z: z * factor };
            Ok(EventTime { of_state, rate })
        } else {
            Err(SensitivityError::Grazing { t: self.t, rate })
        }
    }

    fn point(&self) -> Point {
        Point { q: self.q.clone(), v: self.v.clone(), z: self.z }
    }
}
