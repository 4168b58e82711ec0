//! The Lagrangians of these tests as one type for each number of coordinates, so that each integrator is compiled once.
//! Those with switching functions are types of their own: they have further code in each step, which others do not need.
//! Kepler's problem is among them without its time transformation, which would be compiled for all.

use crate::boundary_paths::conjugate_points::Uncoupled;
use crate::boundary_paths::end_conditions;
use crate::boundary_paths::forces::Rolling;
use crate::common::forces::{DragInLagrangian, Fall};
use crate::common::lagrangians::{Bratu, WithGradientAndStructure, WithStructure};
use crate::ensembles::systems::{self, Bowl, HenonHeiles, Spring};
use crate::integrators::accuracy::Bench;
use crate::integrators::event_roots::{Ceiling, Cubic};
use crate::integrators::events::{About, Driven, EndsAtZero, Well};
use crate::integrators::forces::splittings::{Free, Massive};
use crate::integrators::gauss::{Ends, InField};
use crate::integrators::gauss_stress::{IllConditioned, Masses};
use crate::integrators::runs::ManyVelocities;
use crate::invalid_input::discrete::runs::Silent;
use crate::invalid_input::known_issues;
use crate::invalid_input::numbers::{Claiming, Everything};
use crate::invalid_input::refusals::GrowingDrag;
use crate::invalid_input::sentences::input::{FalselyQuadratic, Odd, Unstated};
use crate::invalid_input::sentences::steps::{Branching, QuadraticAtFirst, Switching};
use crate::motions::accuracy::Line;
use crate::motions::claims::Bump;
use crate::motions::coarse::{Kinked, Massless, Runaway, Shifted};
use crate::motions::resolution::{Linear, Pole, Pulse, Stretched, Units};
use crate::motions::rest::{Hill, Pushed, Resting};
use crate::motions::round_off::Slow;
use crate::motions::unresolved::Plane;
use crate::motions::velocity::{Charge, Oscillators};
use crate::path_branches::Crossed;
use crate::resets::Floor;
use crate::resets::breaks;
use crate::resets::campaign::{Flight, Slope};
use crate::resets::impacts::{self, High, Piston};
use crate::resets::runs::Walls;
use contact_examples::systems::{
    CoupledPlane, DoublePendulum, Duffing, HarmonicOscillator, Kepler, OneCoordinate, Pendulum, QuadraticInZ, System,
    TwoCoordinates, UniformField,
};
use contact_geom::switching::{Breaks, Impacts};
use contact_geom::{Lagrangian, lagrangian_enum};

lagrangian_enum! {
    /// One coordinate.
    #[derive(Clone, Copy, Debug)]
    pub enum One<1> {
        Catalogue(OneCoordinate),
        OtherStructure(WithStructure<OneCoordinate>),
        GradientAndOtherStructure(WithGradientAndStructure<OneCoordinate>),
        UniformField(UniformField<1>),
        Fall(Fall),
        FallOfOtherStructure(WithStructure<Fall>),
        DragInLagrangian(DragInLagrangian),
        Bratu(Bratu),
        About(About),
        Bench(Bench),
        Bowl(Bowl),
        Branching(Branching),
        Bump(Bump),
        Claiming(Claiming),
        Cubic(Cubic),
        Driven(Driven),
        EndsAtZero(EndsAtZero),
        Everything(Everything),
        FalselyQuadratic(FalselyQuadratic),
        GrowingDrag(GrowingDrag),
        Hill(Hill),
        InField(InField),
        Kinked(Kinked),
        Line(Line),
        Linear(Linear),
        ManyVelocities(ManyVelocities),
        NarrowPulse(known_issues::Pulse),
        Odd(Odd),
        Pole(Pole),
        Pulse(Pulse),
        Pushed(Pushed),
        QuadraticAtFirst(QuadraticAtFirst),
        Resting(Resting),
        RestingOfOtherStructure(WithStructure<Resting>),
        Runaway(Runaway),
        Shifted(Shifted),
        Silent(Silent),
        Slow(Slow),
        Spring(Spring),
        TwoSprings(systems::Branching),
        Unstated(Unstated),
        Well(Well),
    }
}

lagrangian_enum! {
    /// Two coordinates.
    #[derive(Clone, Copy, Debug)]
    pub enum Two<2> {
        Catalogue(TwoCoordinates),
        Kepler(WithGradientAndStructure<Kepler<2>>),
        KeplerOfOtherStructure(WithStructure<Kepler<2>>),
        Fall(Fall),
        Charge(Charge),
        Crossed(Crossed),
        Driven(end_conditions::Driven),
        Ends(WithStructure<Ends>),
        Free(Free),
        HenonHeiles(HenonHeiles),
        IllConditioned(IllConditioned),
        Masses(Masses),
        Massive(Massive),
        Massless(Massless),
        Oscillators(Oscillators),
        Plane(Plane),
        Rolling(Rolling),
        Stretched(Stretched),
        Uncoupled(Uncoupled),
        Units(Units),
    }
}

lagrangian_enum! {
    /// One coordinate, with switching functions or breaks.
    pub enum SwitchingOne<1> {
        Ball(Impacts<UniformField<1>, Floor>),
        BeforePiston(Impacts<UniformField<1>, Piston>),
        Pendulum(Impacts<Pendulum, Floor>),
        High(Impacts<High, Floor>),
        Pushed(Breaks<breaks::Pushed>),
        Ceiling(Ceiling),
        Switching(Switching),
    }
}

lagrangian_enum! {
    /// Two coordinates, with switching functions.
    pub enum SwitchingTwo<2> {
        Ball(Impacts<UniformField<2>, Floor>),
        Flight(Impacts<Flight, Slope>),
        Resting(impacts::Resting),
        Walls(Walls),
    }
}

/// A system of the catalogue with one coordinate.
pub fn one(system: impl Into<OneCoordinate>) -> One {
    One::Catalogue(system.into())
}

/// Kepler's problem, without its time transformation.
pub fn kepler(kepler: Kepler<2>) -> Two {
    Two::Kepler(WithGradientAndStructure(kepler, kepler.structure()))
}

/// A system of the catalogue with two coordinates.
pub fn two(system: impl Into<TwoCoordinates>) -> Two {
    Two::Catalogue(system.into())
}

/// A check of a system and of its Lagrangian.
pub trait KindVisitor {
    fn visit<const N: usize, S: System<N>, L: Lagrangian<N> + Copy>(&mut self, system: &S, lagrangian: L);
}

/// Visits one system of each kind of structure, for tests of integrators, which take long to compile: linear,
/// separable, time dependent, nonlinear in z, with a mass matrix that depends on q, and on q, v and z.
pub fn visit_kinds(visitor: &mut impl KindVisitor) {
    visitor.visit(&HarmonicOscillator::default(), one(HarmonicOscillator::default()));
    visitor.visit(&Kepler::default(), kepler(Kepler::default()));
    visitor.visit(&Duffing::forced(), one(Duffing::forced()));
    visitor.visit(&QuadraticInZ::default(), one(QuadraticInZ::default()));
    visitor.visit(&DoublePendulum::default(), two(DoublePendulum::default()));
    visitor.visit(&CoupledPlane::default(), two(CoupledPlane::default()));
}
