//! The Lagrangians of these tests as one type for each number of coordinates, so that the derivatives of each integrator
//! are compiled once. Those with switching functions are types of their own: they have further code in each step, which
//! others do not need. Tests of all systems of the catalogue visit the types of the catalogue.

use crate::gradients::forces::Forces;
use crate::gradients::impacts::{Ceiling, Floor, Ground};
use crate::gradients::invalid_input::{Falling, Slope};
use crate::gradients::switches::{Bouncing, Kinked, Pushed, Region, Step, Wall};
use contact_examples::systems::{Kepler, OneCoordinate, Pendulum, TwoCoordinates, UniformField};
use contact_geom::switching::{Breaks, Impacts};
use contact_geom::{Forced, lagrangian_enum};

/// One coordinate and a force.
pub type ForcedOne = Forced<OneCoordinate, Forces<1>>;

lagrangian_enum! {
    /// One coordinate, without forces.
    pub enum One<1> {
        Pendulum(Pendulum),
        Field(UniformField<1>),
        Falling(Falling),
    }
}
lagrangian_enum!(parametric One<1> { Pendulum, Field, Falling });

lagrangian_enum! {
    /// Two coordinates, with one or two forces, or with none.
    pub enum Two<2> {
        Kepler(Kepler<2>),
        Forced(Forced<TwoCoordinates, Forces<2>>),
        ForcedTwice(Forced<Forced<TwoCoordinates, Forces<2>>, Forces<2>>),
        ForcedKepler(Forced<Kepler<2>, Forces<2>>),
    }
}
lagrangian_enum!(parametric Two<2> { Kepler, Forced, ForcedTwice, ForcedKepler });

lagrangian_enum! {
    /// One coordinate, with switching functions or breaks.
    pub enum SwitchingOne<1> {
        Ball(Impacts<UniformField<1>, Floor>),
        BelowCeiling(Impacts<UniformField<1>, Ceiling>),
        Slope(Slope),
        Kinked(Kinked),
        Pushed(Breaks<Pushed>),
        Bouncing(Bouncing),
        Step(Step),
    }
}
lagrangian_enum!(parametric SwitchingOne<1> { Ball, BelowCeiling, Slope, Kinked, Pushed, Bouncing, Step });

lagrangian_enum! {
    /// Two coordinates, with switching functions.
    pub enum SwitchingTwo<2> {
        AboveGround(Impacts<UniformField<2>, Ground>),
        Corner(Impacts<Impacts<UniformField<2>, Floor>, Wall>),
        Region(Region),
    }
}
lagrangian_enum!(parametric SwitchingTwo<2> { AboveGround, Corner, Region });
