//! The theorems, one file each, over every system and every discretisation.

// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// What a test cannot go on without is a failure of it.
#![allow(clippy::unwrap_used)]

// The integrators use the rest of it.
#[allow(dead_code)]
mod common;

mod bad_input;
mod derivatives;
mod exact_composition;
mod exact_is_discrete;
mod exact_motion;
mod exact_series;
mod methods;
mod orders;
mod s01_contact_condition;
mod s02_reeb_field;
mod s03_hamiltonian_field;
mod s04_conformal_field;
mod s05_conformal_factor;
mod s06_energy_decay;
mod s07_regularity;
mod s08_herglotz_field;
mod s09_legendre;
mod s10_continuous_principle;
mod s11_dissipated_quantities;
mod s12_noether;
mod s13_action_differential;
mod s14_two_steps;
mod s15_herglotz_principle;
mod s16_vermeeren_bravetti_seri;
mod s17_local_diffeomorphisms;
mod s18_momentum_matching;
mod s19_flow_exists;
mod s20_three_expressions;
mod s21_discrete_forms;
mod s22_forms_related;
mod s23_flow_conformal;
mod s24_hamiltonian_flow_conformal;
mod s26_discrete_noether;
mod s27_multiplier;
mod s28_projected_flow;
mod s29_exponential_map;
mod s30_two_exponentials;
mod s31_projection;
mod s32_retraction;
mod s33_linear_equation;
mod s34_derivatives;
mod s35_legendre_transforms;
mod s36_exact_flow;
mod s37_free_particle;
mod s38_oscillator;
mod s40_error_orders;
mod steps;
