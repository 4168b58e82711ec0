//! The systems of `contact_geom::systems::hamiltonian`, and Lane-Emden's equation to the surface, against published
//! numbers, closed forms, and the laws that they obey.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used, clippy::neg_cmp_op_on_partial_ord)]

#[path = "hamiltonian_systems/containers.rs"]
mod containers;
#[path = "hamiltonian_systems/lane_emden.rs"]
mod lane_emden;
#[path = "hamiltonian_systems/optimizers.rs"]
mod optimizers;
#[path = "hamiltonian_systems/rays.rs"]
mod rays;
#[path = "hamiltonian_systems/spin_orbit.rs"]
mod spin_orbit;
#[path = "hamiltonian_systems/systems.rs"]
mod systems;
#[path = "hamiltonian_systems/thermodynamics.rs"]
mod thermodynamics;
#[path = "hamiltonian_systems/thermostats.rs"]
mod thermostats;
#[path = "hamiltonian_systems/van_der_pol.rs"]
mod van_der_pol;
