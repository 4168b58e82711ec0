//! Integrators: steppers, runs, dense output and events, over the catalogue of systems.

mod accuracy;
mod conformal_steppers;
mod dense_output;
mod event_roots;
mod events;
mod every_run;
mod forces;
mod gauss;
mod gauss_catalogue;
mod gauss_stress;
mod lagrangians;
mod round_off;
mod runs;
mod transformed_time;
