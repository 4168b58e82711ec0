//! The Lagrangians of these tests, as one type for each number of coordinates.

use crate::resets::Floor;
use crate::resets::breaks::Pushed;
use crate::resets::campaign::{Flight, Slope};
use crate::resets::impacts::{High, Piston, Resting};
use crate::resets::runs::Walls;
use contact_geom::lagrangian_enum;
use contact_geom::switching::{Breaks, Impacts};
use contact_geom::systems::{Pendulum, UniformField};

lagrangian_enum! {
    /// One coordinate.
    pub enum Line<1> {
        Ball(Impacts<UniformField<1>, Floor>),
        BeforePiston(Impacts<UniformField<1>, Piston>),
        Pendulum(Impacts<Pendulum, Floor>),
        High(Impacts<High, Floor>),
        Pushed(Breaks<Pushed>),
    }
}

lagrangian_enum! {
    /// Two coordinates.
    pub enum Plane<2> {
        Ball(Impacts<UniformField<2>, Floor>),
        Flight(Impacts<Flight, Slope>),
        Resting(Resting),
        Walls(Walls),
    }
}
