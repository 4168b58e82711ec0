//! The Lagrangians and the forces of these tests, as few types.

use crate::boundary_paths::conjugate_points::Uncoupled;
use crate::boundary_paths::end_conditions::Driven;
use crate::boundary_paths::forces::{Mixing, Quadratic, Rolling, Wall};
use crate::common::forces::{Drag, Fall, Swirl};
use crate::common::lagrangians::Bratu;
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{OneCoordinate, TwoCoordinates, UniformField};
use contact_geom::{Force, ForceStructure, Forced, Scalar, VelocityPoint, lagrangian_enum};

lagrangian_enum! {
    /// Lagrangians with one coordinate.
    #[derive(Clone)]
    pub enum One<1> {
        Catalogue(OneCoordinate),
        Bratu(Bratu),
        Field(UniformField<1>),
        Fall(Fall),
    }
}

lagrangian_enum! {
    /// Lagrangians with two coordinates.
    #[derive(Clone, Copy)]
    pub enum Two<2> {
        Catalogue(TwoCoordinates),
        Uncoupled(Uncoupled),
        Driven(Driven),
        Rolling(Rolling),
    }
}

/// A system of the catalogue with one coordinate.
pub fn one(system: impl Into<OneCoordinate>) -> One {
    One::Catalogue(system.into())
}

/// A system of the catalogue with two coordinates.
pub fn two(system: impl Into<TwoCoordinates>) -> Two {
    Two::Catalogue(system.into())
}

/// Defines an enum of forces, which is itself a force.
macro_rules! forces {
    ($(#[$of:meta])* $name:ident<$n:literal> { $($force:ident),* }) => {
        $(#[$of])*
        #[derive(Clone, Copy)]
        pub enum $name {
            $($force($force),)*
        }

        $(impl From<$force> for $name {
            fn from(force: $force) -> Self {
                $name::$force(force)
            }
        })*

        impl Force<$n> for $name {
            fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<$n, T>) -> SVector<T, $n> {
                match self { $($name::$force(force) => force.value(t, x),)* }
            }
            fn structure(&self) -> ForceStructure<$n> {
                match self { $($name::$force(force) => force.structure(),)* }
            }
        }
    };
}

forces! {
    /// Forces with one coordinate.
    OneForce<1> { Quadratic, Drag, Swirl, Wall }
}

forces! {
    /// Forces with two coordinates.
    TwoForce<2> { Mixing, Drag }
}

/// A Lagrangian with one coordinate and a force.
pub fn forced_one(lagrangian: impl Into<One>, force: impl Into<OneForce>) -> Forced<One, OneForce> {
    Forced::new(lagrangian.into(), force.into())
}

/// A Lagrangian with two coordinates and a force.
pub fn forced_two(lagrangian: impl Into<Two>, force: impl Into<TwoForce>) -> Forced<Two, TwoForce> {
    Forced::new(lagrangian.into(), force.into())
}
