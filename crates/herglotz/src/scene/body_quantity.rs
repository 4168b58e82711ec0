//! The numbers of a rigid body and of its start that are set by name, and swept.

use crate::runtime::{Body, BodyMotion};

/// A number of a rigid body or of its start. The entries of vectors are counted from 0 here, and from 1 in their names,
/// as in the columns `omega1`, `omega2`, `omega3`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum BodyQuantity {
    /// An entry on the diagonal of the inertia tensor: a principal moment, where the axes of the body are principal.
    Inertia(usize),
    /// The mass.
    Mass,
    /// A coordinate of the centre of mass.
    Centre(usize),
    /// A component of the acceleration of gravity.
    Gravity(usize),
    /// The rate of the drag.
    Gamma,
    /// A component of the initial angular velocity.
    Omega(usize),
    /// The initial action.
    Action,
    /// The initial time.
    Time,
}

impl BodyQuantity {
    /// All of them with their names.
    pub const ALL: [(&'static str, BodyQuantity); 16] = [
        ("inertia1", BodyQuantity::Inertia(0)),
        ("inertia2", BodyQuantity::Inertia(1)),
        ("inertia3", BodyQuantity::Inertia(2)),
        ("mass", BodyQuantity::Mass),
        ("centre1", BodyQuantity::Centre(0)),
        ("centre2", BodyQuantity::Centre(1)),
        ("centre3", BodyQuantity::Centre(2)),
        ("gravity1", BodyQuantity::Gravity(0)),
        ("gravity2", BodyQuantity::Gravity(1)),
        ("gravity3", BodyQuantity::Gravity(2)),
        ("gamma", BodyQuantity::Gamma),
        ("start.omega1", BodyQuantity::Omega(0)),
        ("start.omega2", BodyQuantity::Omega(1)),
        ("start.omega3", BodyQuantity::Omega(2)),
        ("start.z", BodyQuantity::Action),
        ("start.t", BodyQuantity::Time),
    ];

    /// The quantity with a name.
    pub fn named(name: &str) -> Option<BodyQuantity> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, quantity)| *quantity)
    }

    /// Sets its value.
    pub fn put(self, value: f64, body: &mut Body, motion: &mut BodyMotion) {
        let entry = match self {
            BodyQuantity::Inertia(i) => body.inertia.get_mut(i).and_then(|row| row.get_mut(i)),
            BodyQuantity::Mass => Some(&mut body.mass),
            BodyQuantity::Centre(i) => body.centre.get_mut(i),
            BodyQuantity::Gravity(i) => body.gravity.get_mut(i),
            BodyQuantity::Gamma => Some(&mut body.gamma),
            BodyQuantity::Omega(i) => motion.omega.get_mut(i),
            BodyQuantity::Action => Some(&mut motion.z),
            BodyQuantity::Time => Some(&mut motion.t),
        };
        if let Some(entry) = entry {
            *entry = value;
        }
    }
}
