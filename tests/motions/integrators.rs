//! Integrators: steppers, runs, dense output and events, over the catalogue of systems.

pub mod accuracy;
mod conformal_steppers;
mod dense_output;
pub mod event_roots;
pub mod events;
mod every_run;
pub mod forces;
pub mod gauss;
mod gauss_catalogue;
pub mod gauss_stress;
mod round_off;
pub mod runs;
mod transformed_time;
