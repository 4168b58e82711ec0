//! Linear drag without a potential is a change of time.

use contact_geom::groups::GroupError;

/// The change of time of a system without a potential, `L = T(q, v) + gamma z` with T quadratic in v: geodesics of any
/// Riemannian manifold with linear drag.
///
/// `v'` along the geodesic is gamma v, so that a motion follows the free one: `q(t) = q_free(tau)`,
/// `v(t) = e^(gamma t) v_free(tau)`, `p(t) = e^(gamma t) p_free(tau)`, `z(t) = e^(gamma t) (z0 + T0 tau)`, with
/// `tau = (e^(gamma t) - 1)/gamma`. For `gamma < 0` the motion comes to rest after the length of the free motion over
/// the time `-1/gamma`.
///
/// ```
/// use exact_lagrangian::groups::ChangeOfTime;
/// let drag = ChangeOfTime::new(-0.5)?;
/// assert!((drag.free_time(1e3) - 2.0).abs() < 1e-15); // the length of the path is finite
/// assert_eq!(ChangeOfTime::new(0.0)?.free_time(3.0), 3.0);
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangeOfTime {
    gamma: f64,
}

impl ChangeOfTime {
    /// The change of time of the rate gamma, negative for dissipation.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`].
    pub fn new(gamma: f64) -> Result<Self, GroupError> {
        if gamma.is_finite() {
            Ok(ChangeOfTime { gamma })
        } else {
            Err(GroupError::NonFinite { what: "the rate gamma", value: gamma })
        }
    }

    /// The time tau of the free motion, `(e^(gamma t) - 1)/gamma`.
    pub fn free_time(&self, t: f64) -> f64 {
        if self.gamma == 0.0 { t } else { (self.gamma * t).exp_m1() / self.gamma }
    }

    /// The factor `e^(gamma t)` of velocities and momenta, the conformal factor of the flow.
    pub fn factor(&self, t: f64) -> f64 {
        (self.gamma * t).exp()
    }

    /// The action `e^(gamma t) (z0 + T0 tau)`, with the kinetic energy T0 at the start.
    pub fn action(&self, t: f64, z0: f64, kinetic: f64) -> f64 {
        self.factor(t) * (z0 + kinetic * self.free_time(t))
    }
}
