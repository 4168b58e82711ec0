//! Step-size selection for a requested error, by trial runs.

mod by_doubled_steps;
mod comparison_grid;
mod converge;
mod defect_history;
mod divided;
mod ended;
mod energy_law;
pub(crate) mod equilibrium_round_off;
mod estimate;
mod evaluation_cost;
mod failure;
pub(crate) mod first_guess;
mod last_digit;
pub(crate) mod limits;
mod matrices;
mod pair;
mod reference;
mod rest;
mod select;
#[cfg(test)]
mod tests;
mod track;
mod transformation_gain;
mod trial_end;
mod trial_runs;
mod velocities;

pub(crate) use select::{select_equal_steps, select_steps};
