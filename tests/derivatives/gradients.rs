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
mod pendulum;
mod runs;
pub mod switches;

/// Whether systems of the catalogue with a number of coordinates are compared. Each type takes long to compile, and those
/// with three, Kepler's problem in space and a free chain, have the formulas of others with two and four.
const fn is_compared(coordinates: usize) -> bool {
    coordinates != 3
}
