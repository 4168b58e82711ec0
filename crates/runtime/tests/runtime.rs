//! Motions by formula: runs, ensembles, paths, fits, derivatives, and systems of any number of coordinates.

#![allow(missing_docs)]

mod accuracy;
mod advice;
mod body;
mod divided_steps;
mod event_times;
mod fit;
mod friction;
mod jump_times;
mod lyapunov_of_impacts;
mod motions;
mod own_methods;
mod pairs;
mod path;
mod rest;
mod resting_contact;
mod rows_beside_kinks;
mod rows_of_divided_steps;
mod sensitive;
mod sensitivity;
mod sparse;
mod sums_of_terms;
