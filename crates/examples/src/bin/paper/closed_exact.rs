//! The exact discrete Lagrangian of the free particle in closed form, as it should read and as it is printed.

use contact_geom::{DiscretePoint, Scalar};
use discrete_herglotz::{DiscreteLagrangian, StepError};

/// `L_h^e = gamma (q1 - q0)^2 e^(gamma h) / (2 e^(gamma h) - 2) +- z0 (e^(gamma h) - 1)`; paper, section 5, Example 1.
#[derive(Clone, Copy, Debug)]
pub struct ClosedExact {
    /// The rate, `gamma != 0`.
    gamma: f64,
    /// The time step.
    h: f64,
    /// The sign of the last term.
    sign: f64,
}

impl ClosedExact {
    /// With the sign `+`: then `D_z L_h^e = e^(gamma h) - 1`, as the theorem of section 4.2 demands.
    pub fn corrected(gamma: f64, h: f64) -> Self {
        ClosedExact { gamma, h, sign: 1.0 }
    }

    /// With the sign `-`, as printed: its `sigma_d` is `2 - e^(gamma h)`, not `e^(gamma h)`.
    pub fn printed(gamma: f64, h: f64) -> Self {
        ClosedExact { gamma, h, sign: -1.0 }
    }
}

impl DiscreteLagrangian<1> for ClosedExact {
    fn step_size(&self) -> f64 {
        self.h
    }

    fn value<T: Scalar>(&self, _t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
        let (growth, exponent) = ((self.gamma * self.h).exp_m1(), self.gamma * self.h);
        let dq = x.q1[0] - x.q0[0];
        Ok(dq * dq * (self.gamma * exponent.exp() / (2.0 * growth)) + x.z0 * (self.sign * growth))
    }
}
