//! Step-size selection for a requested error, by trial runs.

mod converge;
mod divided;
mod ended;
mod estimate;
mod failure;
mod first_guess;
pub(crate) mod noise;
mod reference;
mod rest;
mod select;
#[cfg(test)]
mod tests;
mod track;
mod trial_runs;
mod velocities;

pub(crate) use select::choose;
