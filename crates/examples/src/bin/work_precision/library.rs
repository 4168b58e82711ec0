//! The methods of the library, set on the problems.

use crate::candidate::{Candidate, FlowStepper, stepped};
use crate::problems::{KEPLER, OSCILLATOR, PENDULUM, Problem, QUADRATIC, System};
use contact_geom::Lagrangian;
use discrete_herglotz::Midpoint;

/// The methods of the library for a problem, with or without the action.
pub fn candidates(problem: &Problem, z: bool) -> Vec<Box<dyn Candidate>> {
    match problem.system {
        System::Oscillator => general::<1>(OSCILLATOR, problem, z),
        System::Pendulum => general::<1>(PENDULUM, problem, z),
        System::Kepler => general::<2>(KEPLER, problem, z),
        System::Quadratic => general::<1>(QUADRATIC, problem, z),
    }
}

/// The methods for any Lagrangian. A flow of a discrete Lagrangian always has the action; without it, nobody looks.
fn general<const N: usize>(
    lagrangian: impl Lagrangian<N> + Copy + 'static,
    problem: &Problem,
    z: bool,
) -> Vec<Box<dyn Candidate>> {
    let at = problem.phase_point::<N>();
    let midpoint = stepped(
        ("midpoint", 2),
        (problem, z),
        move |h| Midpoint::new::<N>(lagrangian, h),
        move |ld| Ok(Box::new(FlowStepper::new(ld, at)?)),
    );
    vec![midpoint]
}
