//! Motions from the user's point of view: rows, events and progress, steps that are too long, many coordinates,
//! round-off.

pub mod accuracy;
pub mod claims;
pub mod coarse;
mod many_coordinates;
mod observed;
pub mod resolution;
pub mod rest;
pub mod round_off;
pub mod unresolved;
pub mod velocity;

use contact_geom::{Lagrangian, VelocityPoint};
use discrete_herglotz::{AnyIntegrator, InputError, Outcome, Problem, Steps, Until};

/// A whole run from t = 0 by given steps.
fn run_of<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    start: VelocityPoint<N>,
    span: f64,
    integrator: AnyIntegrator,
    steps: Steps,
) -> Result<Outcome, InputError> {
    Problem::new(lagrangian, 0.0, start)?.by(integrator).steps(steps).run(Until::Time(span))
}
