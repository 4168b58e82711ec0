//! The Lagrangians of the unit tests, as one type for each number of coordinates: each further type would compile all
//! integrators again, for every instruction set.

mod anharmonic;
mod coupled;
mod cubic;
mod curved;
mod even;
mod fall;
mod free;
mod inertia;
mod magnetic;
mod nearly_one;
mod one_sided;
mod oscillators;
mod quartic;
mod rate;
mod tides;
mod unstated;
mod whisper;

pub(crate) use anharmonic::Anharmonic;
pub(crate) use coupled::Coupled;
pub(crate) use cubic::Cubic;
pub(crate) use curved::Curved;
pub(crate) use even::Even;
pub(crate) use fall::Fall;
pub(crate) use free::Free;
pub(crate) use inertia::Inertia;
pub(crate) use magnetic::Magnetic;
pub(crate) use nearly_one::NearlyOne;
pub(crate) use one_sided::{How, OneSided};
pub(crate) use oscillators::Oscillators;
pub(crate) use quartic::Quartic;
pub(crate) use rate::Rate;
pub(crate) use tides::Tides;
pub(crate) use unstated::Unstated;
pub(crate) use whisper::Whisper;

use contact_examples::systems::{Duffing, Kepler, LaneEmden, Pendulum, QuadraticInZ};

contact_geom::lagrangian_enum! {
    /// Lagrangians with one coordinate.
    #[derive(Debug)]
    pub(crate) enum OnLine<1> {
        Anharmonic(Anharmonic),
        Cubic(Cubic),
        Curved(Curved),
        Duffing(Duffing),
        Even(Even),
        Fall(Fall),
        Free(Free),
        LaneEmden(LaneEmden),
        Magnetic(Magnetic),
        OneSided(OneSided),
        Pendulum(Pendulum),
        QuadraticInZ(QuadraticInZ),
        Quartic(Quartic),
        Rate(Rate),
        Tides(Tides),
        Unstated(Unstated),
    }
}

contact_geom::lagrangian_enum! {
    /// Lagrangians with two coordinates.
    #[derive(Debug)]
    pub(crate) enum InPlane<2> {
        Anharmonic(Anharmonic),
        Coupled(Coupled),
        Inertia(Inertia),
        Kepler(Kepler<2>),
        NearlyOne(NearlyOne),
        Oscillators(Oscillators),
        Whisper(Whisper),
    }
}
