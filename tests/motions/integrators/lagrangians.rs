//! The Lagrangians of these tests as one type for each number of coordinates, and their forces as one type, so that each
//! integrator is compiled once.

use crate::common::forces::{AnyForce, Drag, DragInLagrangian, Fall, Swirl, Undeclared};
use crate::common::lagrangians::WithStructure;
use crate::integrators::accuracy::Bench;
use crate::integrators::event_roots::Cubic;
use crate::integrators::events::{About, Driven, EndsAtZero, Well};
use crate::integrators::forces::splittings::{FalseForce, Free, Massive, SwirlAndDrag};
use crate::integrators::gauss::{Ends, InField};
use crate::integrators::gauss_stress::{IllConditioned, Masses};
use crate::integrators::round_off;
use crate::integrators::runs::ManyVelocities;
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{OneCoordinate, TwoCoordinates, UniformField};
use contact_geom::{Force, ForceStructure, Scalar, VelocityPoint, lagrangian_enum};

lagrangian_enum! {
    /// The Lagrangians with one coordinate.
    pub enum One<1> {
        Catalogue(OneCoordinate),
        OtherStructure(WithStructure<OneCoordinate>),
        ClosedGradient(round_off::WithStructure<OneCoordinate>),
        Bench(Bench),
        Cubic(Cubic),
        About(About),
        Driven(Driven),
        EndsAtZero(EndsAtZero),
        Well(Well),
        UniformField(UniformField<1>),
        InField(InField),
        ManyVelocities(ManyVelocities),
        Fall(Fall),
        FallOfOtherStructure(WithStructure<Fall>),
        DragInLagrangian(DragInLagrangian),
    }
}

lagrangian_enum! {
    /// The Lagrangians with two coordinates, without those that have a time transformation.
    pub enum Two<2> {
        Catalogue(TwoCoordinates),
        IllConditioned(IllConditioned),
        Masses(Masses),
        Ends(WithStructure<Ends>),
        Fall(Fall),
        Free(Free),
        Massive(Massive),
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

/// The forces.
#[derive(Clone, Copy)]
pub enum Applied {
    Any,
    Drag(Drag),
    Swirl,
    UndeclaredSwirl,
    SwirlAndDrag(Drag),
    False,
}

impl<const N: usize> Force<N> for Applied {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        match self {
            Applied::Any => AnyForce.value(t, x),
            Applied::Drag(drag) => drag.value(t, x),
            Applied::Swirl => Swirl.value(t, x),
            Applied::UndeclaredSwirl => Undeclared(Swirl).value(t, x),
            Applied::SwirlAndDrag(drag) => SwirlAndDrag(*drag).value(t, x),
            Applied::False => FalseForce.value(t, x),
        }
    }
    fn structure(&self) -> ForceStructure<N> {
        match self {
            Applied::Any => AnyForce.structure(),
            Applied::Drag(drag) => drag.structure(),
            Applied::Swirl => Swirl.structure(),
            Applied::UndeclaredSwirl => Undeclared(Swirl).structure(),
            Applied::SwirlAndDrag(drag) => SwirlAndDrag(*drag).structure(),
            Applied::False => FalseForce.structure(),
        }
    }
}
