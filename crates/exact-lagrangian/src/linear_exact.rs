//! Exact discrete Lagrangians of linear motions.

use contact_geom::statements::ClosedFlow;
use contact_geom::systems::{FreeParticle, HarmonicOscillator};
use contact_geom::{DiscretePoint, Scalar, Triple};
use discrete_herglotz::{DiscreteLagrangian, InputError, StepError};

/// The exact discrete Lagrangian of a system on R whose motion is linear in `(q, v)` and known in closed form.
///
/// The initial velocity of the motion from `q0` to `q1` in time `h` is linear in the two points; the action along it is
/// that of the closed form. For the free particle this is
/// `gamma (q1 - q0)^2 e^(gamma h) / (2 (e^(gamma h) - 1)) + z0 (e^(gamma h) - 1)`: the paper's section 5 with the sign of
/// `z0` corrected. The value is a difference of actions, so its round-off is `eps |z0|`; that of its derivatives is relative.
#[derive(Clone, Copy, Debug)]
pub struct LinearExact<F> {
    motion: F,
    h: f64,
    /// The initial velocities of the motions from 1 to 0 and from 0 to 1.
    velocity_from: f64,
    velocity_to: f64,
}

impl LinearExact<FreeParticle> {
    /// That of the free particle with drag.
    ///
    /// # Errors
    /// [`InputError::Step`] unless `h` is positive and finite.
    pub fn free_particle(gamma: f64, h: f64) -> Result<Self, InputError> {
        let motion = FreeParticle { gamma };
        Self::through(motion, h, [motion.velocity_through(1.0, 0.0, h), motion.velocity_through(0.0, 1.0, h)])
    }
}

impl LinearExact<HarmonicOscillator> {
    /// That of the damped harmonic oscillator.
    ///
    /// # Errors
    /// [`InputError::Step`] unless `h` is positive and finite; [`InputError::FirstStep`] at a conjugate point, where the
    /// two positions do not determine the motion.
    pub fn oscillator(gamma: f64, h: f64) -> Result<Self, InputError> {
        let motion = HarmonicOscillator { gamma };
        Self::through(motion, h, [motion.velocity_through(1.0, 0.0, h), motion.velocity_through(0.0, 1.0, h)])
    }
}

impl<F> LinearExact<F> {
    fn through(motion: F, h: f64, velocities: [Option<f64>; 2]) -> Result<Self, InputError> {
        if !(h > 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        let [Some(velocity_from), Some(velocity_to)] = velocities else {
            return Err(InputError::FirstStep(StepError::Singular { pivot: 0.0 }));
        };
        Ok(LinearExact { motion, h, velocity_from, velocity_to })
    }
}

impl<F: ClosedFlow> DiscreteLagrangian<1> for LinearExact<F> {
    fn step_size(&self) -> f64 {
        self.h
    }

    fn value<T: Scalar>(&self, _t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
        let v0 = x.q0 * T::from(self.velocity_from) + x.q1 * T::from(self.velocity_to);
        Ok(self.motion.flow(self.h, &Triple { x: x.q0, y: v0, z: x.z0 }).z - x.z0)
    }
}
