//! Contact Hamiltonian systems given by H, one file each: systems without a regular Lagrangian, thermodynamics,
//! thermostats, rays, optimizers. [`Lienard`](super::Lienard) and [`VanDerPol`](super::VanDerPol) are of this kind too.
//!
//! Each type is a [`ContactHamiltonian`](contact_geom::ContactHamiltonian), or a [`VectorField`](contact_geom::VectorField) that
//! [`Lifted`](contact_geom::Lifted) makes one, and has natural initial data, `initial()`.

mod bregman;
mod contact_thermostat;
mod containers;
mod gas;
mod heated_oscillator;
mod nose;
mod objective;
mod piston;
mod ray;
mod relativistic_descent;
mod spin_orbit;

pub use bregman::{Bregman, Kinetic};
pub use contact_thermostat::{Bath, ContactThermostat, TimeOfEnergy};
pub use containers::{Containers, ThermalCoordinates};
pub use gas::Gas;
pub use heated_oscillator::HeatedOscillator;
pub use nose::{Nose, NoseHoover, NosePoincare, ScaleOfTime};
pub use objective::{Objective, Quartic};
pub use piston::Piston;
pub use ray::{Medium, Ray};
pub use relativistic_descent::RelativisticDescent;
pub use spin_orbit::SpinOrbit;

#[cfg(test)]
mod tests;
