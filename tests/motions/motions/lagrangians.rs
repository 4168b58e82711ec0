//! The Lagrangians of these tests as one type for each number of coordinates, so that each integrator is compiled once.

use super::accuracy::Line;
use super::claims::Bump;
use super::coarse::{Kinked, Massless, Runaway, Shifted};
use super::resolution::{Linear, Pole, Pulse, Stretched, Units};
use super::rest::{Hill, Pushed, Resting};
use super::round_off::Slow;
use super::unresolved::Plane;
use super::velocity::{Charge, Oscillators};
use crate::common::lagrangians::WithStructure;
use contact_geom::lagrangian_enum;
use contact_geom::systems::{OneCoordinate, TwoCoordinates};

lagrangian_enum! {
    /// The Lagrangians with one coordinate.
    pub enum One<1> {
        Catalogue(OneCoordinate),
        Line(Line),
        Bump(Bump),
        Runaway(Runaway),
        Kinked(Kinked),
        Shifted(Shifted),
        Pole(Pole),
        Pulse(Pulse),
        Linear(Linear),
        Resting(Resting),
        General(WithStructure<Resting>),
        Hill(Hill),
        Pushed(Pushed),
        Slow(Slow),
    }
}

lagrangian_enum! {
    /// The Lagrangians with two coordinates, without those that have a time transformation.
    pub enum Two<2> {
        Catalogue(TwoCoordinates),
        Massless(Massless),
        Stretched(Stretched),
        Units(Units),
        Plane(Plane),
        Charge(Charge),
        Oscillators(Oscillators),
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
