//! Torques on rigid bodies that have no potential.

use crate::RuntimeError;
use contact_geom::Scalar;
use contact_geom::groups::{GroupForce, Rotation, Rotations};
use contact_geom::nalgebra::SVector;
use formula_lagrangian::{Expression, Formula};
use std::fmt::{Debug, Formatter};
use std::sync::Arc;

/// The names of the coordinates of a torque.
const NAMES: [&str; 7] = ["q_w", "q_x", "q_y", "q_z", "omega1", "omega2", "omega3"];

/// A torque in the body, by the principle of Lagrange, d'Alembert and Herglotz: its virtual work is added to the variation
/// of the action. The motion is then not contact.
///
/// ```
/// use herglotz_runtime::BodyTorque;
/// let brake_and_thrust = BodyTorque::parse(["-0.1*omega1", "0.2*cos(t)", "0"])?;
/// assert_eq!(brake_and_thrust.text()[0], "-0.1*omega1");
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
#[derive(Clone)]
pub struct BodyTorque(Arc<Components>);

/// The components with their texts, and the times of their kinks and jumps.
struct Components([(String, Expression); 3], Vec<f64>);

impl BodyTorque {
    /// The torque whose components along the axes of the body are expressions in the time t, the attitude q_w, q_x, q_y,
    /// q_z, the angular velocity in the body omega1, omega2, omega3, and the action z.
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] with the position in the text; [`RuntimeError::Argument`] for derivatives and quantities
    /// that a torque has not. Steps end at its kinks and jumps at times that the text names, as at those of
    /// `if(t > 2, if(t < 2.1, 50, 0), 0)`.
    pub fn parse(components: [&str; 3]) -> Result<Self, RuntimeError> {
        let names = Formula::parse("0", &NAMES, &[])?;
        let parsed = |text: &str| -> Result<(String, Expression), RuntimeError> {
            let function = names.expression(text)?;
            // The names are those of a Lagrangian that is not used, whose energy and momenta are no quantities of the body.
            let is_word = |c: char| c.is_alphanumeric() || c == '_';
            let mut words = text.split(|c| !is_word(c));
            let unknown = words.find(|word| ["energy", "sigma", "log_factor"].contains(word) || word.starts_with("p_"));
            match unknown {
                None if !function.has_velocity() => Ok((text.to_owned(), function)),
                unknown => {
                    let what = unknown.map_or("a derivative".to_owned(), |name| format!("`{name}`"));
                    let names = NAMES.join(", ");
                    let why = format!("contains {what}, which a torque has not; its names are t, {names} and z");
                    Err(RuntimeError::argument("torque", why))
                }
            }
        };
        let [a, b, c] = components;
        let components = [parsed(a)?, parsed(b)?, parsed(c)?];
        let mut breaks = Vec::new();
        for (_, component) in &components {
            breaks.extend(component.breaks()?);
        }
        Ok(BodyTorque(Arc::new(Components(components, breaks))))
    }

    /// The times of kinks and jumps that the text names.
    pub(super) fn breaks(&self) -> &[f64] {
        &self.0.1
    }

    /// The three components, as they are written.
    pub fn text(&self) -> [&str; 3] {
        self.0.0.each_ref().map(|(text, _)| text.as_str())
    }
}

/// The text.
impl Debug for BodyTorque {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.text())
    }
}

/// Of the text.
impl PartialEq for BodyTorque {
    fn eq(&self, other: &Self) -> bool {
        self.text() == other.text()
    }
}

impl GroupForce<Rotations, 3> for BodyTorque {
    fn value<T: Scalar>(&self, t: T, g: &Rotation<T>, omega: &SVector<T, 3>, z: T) -> SVector<T, 3> {
        let q = [g.w, g.u[0], g.u[1], g.u[2], omega[0], omega[1], omega[2]];
        let rest = [T::zero(); NAMES.len()];
        let [a, b, c] = self.0.0.each_ref().map(|(_, function)| function.at(t, &q, &rest, z));
        SVector::from([a, b, c])
    }
}
