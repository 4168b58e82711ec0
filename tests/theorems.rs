//! The theorems, one file each, over every system and every discretisation.

mod common;

mod bad_input;
mod derivatives;
mod exact_series;
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
mod s37_free_particle;
mod s38_oscillator;
mod steps;
