//! Second derivatives of runs, against differences of first ones, closed forms and each other.

mod closed_form;
mod differences;
mod invalid_input;
pub mod systems;
