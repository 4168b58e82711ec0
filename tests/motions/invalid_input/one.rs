//! The Lagrangians of these tests as one type, so that each integrator is compiled once.

use crate::invalid_input::discrete::runs::Silent;
use crate::invalid_input::known_issues::Pulse;
use crate::invalid_input::numbers::{Claiming, Everything};
use crate::invalid_input::refusals::GrowingDrag;
use crate::invalid_input::sentences::input::{FalselyQuadratic, Odd, Unstated};
use crate::invalid_input::sentences::steps::{Branching, Floor, QuadraticAtFirst, Switching};
use contact_geom::lagrangian_enum;
use contact_geom::switching::Impacts;
use contact_geom::systems::{OneCoordinate, UniformField};

lagrangian_enum! {
    /// The Lagrangians with one coordinate.
    #[derive(Clone, Copy, Debug)]
    pub enum One<1> {
        Catalogue(OneCoordinate),
        Everything(Everything),
        Claiming(Claiming),
        Silent(Silent),
        Pulse(Pulse),
        GrowingDrag(GrowingDrag),
        FalselyQuadratic(FalselyQuadratic),
        QuadraticAtFirst(QuadraticAtFirst),
        Unstated(Unstated),
        Branching(Branching),
        Odd(Odd),
    }
}

lagrangian_enum! {
    /// The Lagrangians with declared switching functions.
    pub enum Switched<1> {
        Switching(Switching),
        Ball(Impacts<UniformField<1>, Floor>),
    }
}

pub const EVERYTHING: One = One::Everything(Everything);
pub const CLAIMING: One = One::Claiming(Claiming);

/// A system of the catalogue.
pub fn one(system: impl Into<OneCoordinate>) -> One {
    One::Catalogue(system.into())
}
