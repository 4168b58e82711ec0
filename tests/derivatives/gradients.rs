//! Derivatives of runs: tangents, gradients by the adjoint, and differences of runs.

mod agreement;
mod contact;
mod ensembles;
mod flows;
pub mod forces;
pub mod impacts;
pub mod invalid_input;
mod losses;
mod lyapunov;
mod memory;
mod pendulum;
mod runs;
pub mod switches;
