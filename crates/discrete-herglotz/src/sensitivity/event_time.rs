//! Derivatives of the times of events.

use crate::sensitivity::switch::{MIN_RATE, terms};
use crate::sensitivity::{EndCovector, Loss, MotionState, SensitivityError};
use crate::{Components, Point, StepError};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint, herglotz_field};

impl MotionState {
    /// The partial derivatives, in this state, of the time at which a function of the state is zero: this is a state of the
    /// motion at a zero, such as that of a [`Crossing`](crate::Crossing), and the time of the zero has the derivative
    /// `dt = -dg / g'`, where dg is the derivative for a fixed time and g' the rate along the motion.
    ///
    /// With the derivatives of the state at the fixed time t of the zero, of
    /// [`tangent_at`](crate::Run::tangent_at), their [`dot`](crate::sensitivity::StateDerivative::dot) products are the
    /// derivatives of the time in the variables; with
    /// [`pullback_at`](crate::sensitivity::RecordedRun::pullback_at) the result is its gradient.
    ///
    /// ```
    /// use contact_examples::systems::Pendulum;
    /// use contact_geom::{Scalar, VelocityPoint};
    /// use discrete_herglotz::{Problem, Steps, Until, sensitivity::{EndState, Loss, Variable}};
    /// struct Height;
    /// impl Loss<1> for Height {
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
    /// println!("dt/dq0 = {}", row.columns[0].dot(&row.state.event_time(&pendulum, &Height)?));
    /// # Ok::<(), discrete_herglotz::sensitivity::SensitivityError>(())
    /// ```
    ///
    /// # Errors
    /// [`SensitivityError::Grazing`] where the rate of the function is round-off, [`SensitivityError::Loss`] where its
    /// derivatives are not finite.
    pub fn event_time<L: Lagrangian<N>, const N: usize>(
        &self,
        lagrangian: &L,
        function: &impl Loss<N>,
    ) -> Result<EndCovector, SensitivityError> {
        let (value, of) = self.differentiate(function);
        if !of.is_finite() {
            return Err(SensitivityError::Loss { value });
        }
        let at = self.fixed::<N>();
        let x = VelocityPoint { q: at.q, v: at.v, z: at.z };
        let singular = |_| SensitivityError::Step { step: 0, cause: StepError::NonFinite };
        let field = Components::from(herglotz_field(lagrangian, self.t, &x).map_err(singular)?);
        let (_, slope) = lagrangian.with_gradient_and_force(self.t, &x);
        let of_p = of.p.dot(&(slope.x + &self.p * slope.z));
        let rate = of.t + of.q.dot(&field.x) + of.v.dot(&field.y) + of_p + of.z * field.z;
        // The terms over a unit of the time in which the state changes by its rates.
        let size = terms(&of, (self.t, &Point::from(x)), &field, 1.0)
            + of.p.iter().zip(&self.p).map(|(a, b)| (a * b).abs()).sum::<f64>();
        // Written so that a NaN is refused.
        if rate.abs() > MIN_RATE * size {
            let factor = -1.0 / rate;
            Ok(EndCovector { t: 0.0, q: of.q * factor, v: of.v * factor, p: of.p * factor, z: of.z * factor })
        } else {
            Err(SensitivityError::Grazing { t: self.t, rate })
        }
    }
}
