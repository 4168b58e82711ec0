//! The forces of these tests as one type, and Lagrangians with them.

use crate::boundary_paths::forces::{Mixing, Quadratic, Wall};
use crate::common::forces::{AnyForce, Drag, Swirl, Undeclared};
use crate::integrators::forces::splittings::{FalseForce, SwirlAndDrag};
use crate::lagrangians::{One, Two};
use crate::paper::forces::Central;
use contact_geom::nalgebra::SVector;
use contact_geom::{Force, ForceStructure, Forced, Scalar, VelocityPoint, statements};

/// Defines an enum of forces, which is itself a force.
macro_rules! forces {
    ($(#[$of:meta])* $name:ident { $($variant:ident($force:ty)),* $(,)? }) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug)]
        pub enum $name {
            $($variant($force),)*
        }

        $(impl From<$force> for $name {
            fn from(force: $force) -> Self {
                $name::$variant(force)
            }
        })*

        impl<const N: usize> Force<N> for $name {
            fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
                match self { $($name::$variant(force) => force.value(t, x),)* }
            }
            fn structure(&self) -> ForceStructure<N> {
                match self { $($name::$variant(force) => Force::<N>::structure(force),)* }
            }
        }
    };
}

forces! {
    /// The forces.
    Applied {
        Any(AnyForce),
        Central(Central),
        OfStatements(statements::AnyForce),
        Drag(Drag),
        False(FalseForce),
        Mixing(Mixing),
        Quadratic(Quadratic),
        Swirl(Swirl),
        SwirlAndDrag(SwirlAndDrag),
        UndeclaredSwirl(Undeclared<Swirl>),
        Wall(Wall),
    }
}

/// A Lagrangian with one coordinate and a force.
pub fn forced_one(lagrangian: impl Into<One>, force: impl Into<Applied>) -> Forced<One, Applied> {
    Forced::new(lagrangian.into(), force.into())
}

/// A Lagrangian with two coordinates and a force.
pub fn forced_two(lagrangian: impl Into<Two>, force: impl Into<Applied>) -> Forced<Two, Applied> {
    Forced::new(lagrangian.into(), force.into())
}
