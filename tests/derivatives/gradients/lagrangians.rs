//! The Lagrangians of these tests beside the catalogue, as few types.

use crate::gradients::forces::Forces;
use crate::gradients::impacts::{Ceiling, Floor, Ground};
use crate::gradients::invalid_input::{Falling, Slope};
use crate::gradients::switches::{Bouncing, Kinked, Pushed, Region, Step, Wall};
use contact_geom::switching::{Breaks, Impacts};
use contact_geom::systems::{Kepler, TwoCoordinates, UniformField};
use contact_geom::{Forced, lagrangian_enum};

lagrangian_enum! {
    /// Smooth Lagrangians with one coordinate that the catalogue does not visit.
    pub enum SmoothLine<1> {
        Field(UniformField<1>),
        Falling(Falling),
    }
}
lagrangian_enum!(parametric SmoothLine<1> { Field, Falling });

lagrangian_enum! {
    /// Lagrangians with one coordinate and with switching functions or breaks.
    pub enum SwitchingLine<1> {
        Ball(Impacts<UniformField<1>, Floor>),
        BelowCeiling(Impacts<UniformField<1>, Ceiling>),
        Slope(Slope),
        Kinked(Kinked),
        Pushed(Breaks<Pushed>),
        Bouncing(Bouncing),
        Step(Step),
    }
}
lagrangian_enum!(parametric SwitchingLine<1> { Ball, BelowCeiling, Slope, Kinked, Pushed, Bouncing, Step });

lagrangian_enum! {
    /// Lagrangians with two coordinates and with switching functions.
    pub enum SwitchingPlane<2> {
        AboveGround(Impacts<UniformField<2>, Ground>),
        Corner(Impacts<Impacts<UniformField<2>, Floor>, Wall>),
        Region(Region),
    }
}
lagrangian_enum!(parametric SwitchingPlane<2> { AboveGround, Corner, Region });

lagrangian_enum! {
    /// Systems with two coordinates and with one or two forces.
    pub enum ForcedPlane<2> {
        Once(Forced<TwoCoordinates, Forces<2>>),
        Twice(Forced<Forced<TwoCoordinates, Forces<2>>, Forces<2>>),
        Kepler(Forced<Kepler<2>, Forces<2>>),
    }
}
lagrangian_enum!(parametric ForcedPlane<2> { Once, Twice, Kepler });
