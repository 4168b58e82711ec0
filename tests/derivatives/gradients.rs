//! Derivatives of runs: tangents, gradients by the adjoint, and differences of runs.

mod agreement;
mod contact;
mod ensembles;
mod flows;
mod forces;
mod impacts;
mod invalid_input;
mod lagrangians;
mod losses;
mod lyapunov;
mod pendulum;
mod runs;
mod switches;
