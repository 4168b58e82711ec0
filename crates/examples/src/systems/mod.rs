//! The catalogue of mechanical systems with dissipation, one file each.
//!
//! Every theorem test of the workspace runs over all of them; a new system is tested once it is added to
//! [`visit_catalogue`].

mod as_one;
mod bodies;
mod chain;
mod charged_particle;
mod closed_form;
pub mod constrained;
mod coupled_in_z;
mod coupled_plane;
mod double_pendulum;
mod duffing;
mod free_particle;
pub mod hamiltonian;
mod harmonic_oscillator;
mod kepler;
mod lane_emden;
mod lienard;
mod parametric;
mod pendulum;
mod perturbed_kepler;
mod quadratic_in_z;
mod relativistic;
mod spherical_pendulum;
mod uniform_field;
mod van_der_pol;

pub use bodies::Bodies;
pub use chain::{Chain, Ends};
pub use charged_particle::ChargedParticle;
pub use coupled_in_z::CoupledInZ;
pub use coupled_plane::CoupledPlane;
pub use double_pendulum::DoublePendulum;
pub use duffing::Duffing;
pub use free_particle::FreeParticle;
pub use harmonic_oscillator::HarmonicOscillator;
pub use kepler::Kepler;
pub use lane_emden::LaneEmden;
pub use lienard::Lienard;
pub use pendulum::Pendulum;
pub use perturbed_kepler::PerturbedKepler;
pub use quadratic_in_z::QuadraticInZ;
pub use relativistic::Relativistic;
pub use spherical_pendulum::SphericalPendulum;
pub use uniform_field::UniformField;
pub use van_der_pol::VanDerPol;

pub use contact_geom::statements::System;

use as_one::systems;
use contact_geom::{PhasePoint, Scalar, Symmetry, VelocityPoint};
use parametric::parametric_fields;

systems! {
    /// The systems of the catalogue with one coordinate, as one type.
    ///
    /// A system's own type is faster: a kernel for this type selects the system at each evaluation.
    OneCoordinate<1> {
        FreeParticle: FreeParticle,
        HarmonicOscillator: HarmonicOscillator,
        Pendulum: Pendulum,
        Duffing: Duffing,
        LaneEmden: LaneEmden,
        QuadraticInZ: QuadraticInZ,
        CoupledInZ: CoupledInZ,
        Relativistic: Relativistic,
    }
}

systems! {
    /// The systems of the catalogue with two coordinates, as one type. [`Kepler`] has a time transformation and is not
    /// included.
    ///
    /// A system's own type is faster: a kernel for this type selects the system at each evaluation.
    TwoCoordinates<2> {
        UniformField: UniformField<2>,
        SphericalPendulum: SphericalPendulum,
        DoublePendulum: DoublePendulum,
        PerturbedKepler: PerturbedKepler,
        CoupledPlane: CoupledPlane,
        ChargedParticle: ChargedParticle,
        Chain: Chain<2>,
    }
}

/// A computation that is applied to systems of any dimension.
pub trait SystemVisitor {
    /// Applies the computation to one system.
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S);
}

/// Visits every regular system of the catalogue with its natural parameters. Systems of any dimension are visited in one,
/// so that generic code is compiled for three types only. [`Lienard`] and [`VanDerPol`] are not
/// included: they have a contact Hamiltonian, but no regular Lagrangian.
pub fn visit_catalogue(visitor: &mut impl SystemVisitor) {
    let one = |system: OneCoordinate, visitor: &mut _| SystemVisitor::visit(visitor, &system);
    let two = |system: TwoCoordinates, visitor: &mut _| SystemVisitor::visit(visitor, &system);
    one(FreeParticle::default().into(), visitor);
    two(UniformField::default().into(), visitor);
    one(HarmonicOscillator::default().into(), visitor);
    one(Pendulum::default().into(), visitor);
    one(Duffing::default().into(), visitor);
    one(Duffing::forced().into(), visitor);
    two(SphericalPendulum::default().into(), visitor);
    two(DoublePendulum::default().into(), visitor);
    visitor.visit(&Kepler::<3>::default());
    two(PerturbedKepler::default().into(), visitor);
    one(LaneEmden::default().into(), visitor);
    one(QuadraticInZ::default().into(), visitor);
    one(CoupledInZ::default().into(), visitor);
    two(CoupledPlane::default().into(), visitor);
    two(ChargedParticle::default().into(), visitor);
    one(Relativistic::default().into(), visitor);
    two(Chain::default().into(), visitor);
    two(Chain::free().into(), visitor);
}

/// The number of systems that [`visit_catalogue`] visits.
pub fn catalogue_size() -> usize {
    struct Count(usize);
    impl SystemVisitor for Count {
        fn visit<const N: usize, S: System<N>>(&mut self, _system: &S) {
            self.0 += 1;
        }
    }
    let mut count = Count(0);
    visit_catalogue(&mut count);
    count.0
}

/// The point of the interval `[low, high]` at the fraction `u` of its length.
fn between(low: f64, high: f64, u: f64) -> f64 {
    low + (high - low) * u
}

#[cfg(test)]
mod tests;
