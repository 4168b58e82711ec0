//! A rigid body about a fixed point, with gravity and linear drag.

use super::BodyTorque;
use crate::RuntimeError;
use contact_geom::groups::{Inertia, RigidBody, UniformGravity};
use contact_geom::nalgebra::{Matrix3, Vector3};

/// A rigid body that turns about a fixed point, with uniform gravity and linear drag:
///
/// `l = omega . J omega/2 + m g . (R X) + gamma z`
///
/// with the attitude R, the angular velocity omega in the body, and the inertia `J = I + m (|X|^2 1 - X X^T)` about the
/// fixed point. Momenta scale by `e^(gamma t)` where they are conserved without drag; gamma is negative for dissipation.
/// A torque that has no potential may act besides.
///
/// ```
/// use herglotz_runtime::{Body, BodyMotion, StepControl};
/// let body = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() };
/// let accuracy = StepControl::Accuracy { error: 1e-10, by: None };
/// let motion = BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 1.0 / 3.0], 10.0, accuracy);
/// let outcome = body.run(&motion, &mut ())?;
/// assert!((outcome.momentum[0] - 0.32881708137).abs() < 1e-9);
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// The inertia tensor I about the centre of mass, in the body.
    pub inertia: [[f64; 3]; 3],
    /// The mass m.
    pub mass: f64,
    /// The centre of mass X in the body, from the fixed point.
    pub centre: [f64; 3],
    /// The acceleration of gravity g, a vector in space.
    pub gravity: [f64; 3],
    /// The rate gamma.
    pub gamma: f64,
    /// A torque that has no potential.
    pub torque: Option<BodyTorque>,
}

impl Default for Body {
    /// A ball with the moment of inertia 1 about its centre of mass, which is fixed.
    fn default() -> Self {
        Body {
            inertia: Body::principal([1.0; 3]),
            mass: 0.0,
            centre: [0.0; 3],
            gravity: [0.0; 3],
            gamma: 0.0,
            torque: None,
        }
    }
}

impl Body {
    /// The inertia tensor with these principal moments about the axes of the body.
    pub fn principal([a, b, c]: [f64; 3]) -> [[f64; 3]; 3] {
        [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]
    }

    /// The point of the body whose path is recorded: the centre of mass X, or the end of the third axis where the
    /// centre of mass is fixed.
    pub fn tip(&self) -> [f64; 3] {
        if self.centre == [0.0; 3] { [0.0, 0.0, 1.0] } else { self.centre }
    }

    /// The Lagrangian, without the torque.
    ///
    /// # Errors
    /// [`RuntimeError::Argument`] and [`RuntimeError::NotFinite`] with the field.
    pub fn lagrangian(&self) -> Result<RigidBody<UniformGravity, 3>, RuntimeError> {
        let Body { inertia, mass, centre, gravity, gamma, .. } = *self;
        let numbers = |what: &str, x: &[f64; 3]| match x.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            Some((i, value)) => Err(RuntimeError::NotFinite { what: format!("{what}[{i}]"), value: *value }),
            None => Ok(()),
        };
        numbers("centre", &centre)?;
        numbers("gravity", &gravity)?;
        if !gamma.is_finite() {
            return Err(RuntimeError::NotFinite { what: "gamma".into(), value: gamma });
        }
        let [off_centre, heavy] = [centre, gravity].map(|x| x != [0.0; 3]);
        if !(mass >= 0.0 && mass.is_finite()) || off_centre && mass == 0.0 {
            let why = format!("is {mass}; with a `centre` of mass off the fixed point it must be a positive number");
            return Err(RuntimeError::argument("mass", why));
        }
        if heavy && !off_centre {
            let why = "has no effect, since the centre of mass is fixed; give the `centre` of mass in the body";
            return Err(RuntimeError::argument("gravity", why));
        }
        let of_inertia =
            |error: contact_geom::groups::GroupError| RuntimeError::argument("inertia", format!("is refused: {error}"));
        let matrix =
            Matrix3::from_fn(|i, j| Vector3::from(inertia.map(|row| row.get(j).copied().unwrap_or(f64::NAN)))[i]);
        let inertia = Inertia::new(matrix).and_then(|inertia| inertia.about(mass, centre)).map_err(of_inertia)?;
        let weight = gravity.map(|g| mass * g);
        RigidBody::rotating(&inertia, UniformGravity { weight, centre }, gamma).map_err(of_inertia)
    }
}
