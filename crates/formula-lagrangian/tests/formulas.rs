//! Lagrangians by formulas: language, derivatives, structure, forces, impacts, runs.

// In a test a missing value is a failure.
#![allow(missing_docs, clippy::panic, clippy::unwrap_used)]

mod accuracy;
mod cones;
mod constraints;
mod derivatives;
mod forces;
mod friction;
mod hamiltonians;
mod impacts;
mod invalid_input;
mod language;
mod no_allocation;
mod own_systems;
mod parametric;
mod random;
mod random_formulas;
mod resets;
mod runs;
mod structure;
mod switching;
mod symbols;
mod tables;
