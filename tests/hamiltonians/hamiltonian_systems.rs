//! The systems of `contact_examples::systems::hamiltonian`, and Lane-Emden's equation to the surface, against published
//! numbers, closed forms, and the laws that they obey.

mod containers;
mod lane_emden;
mod optimizers;
mod rays;
mod spin_orbit;
mod systems;
mod thermodynamics;
mod thermostats;
mod van_der_pol;
