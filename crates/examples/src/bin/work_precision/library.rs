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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidate::{Control, RunError};
    use crate::problems::PROBLEMS;

    #[test]
    fn the_midpoint_rule_is_of_second_order() -> Result<(), RunError> {
        let problem = &PROBLEMS[3];
        for z in [false, true] {
            let mut all = candidates(problem, z);
            all.retain(|candidate| candidate.name() == "midpoint");
            assert_eq!(all.len(), 1);
            let (coarse, fine) = (all[0].run(problem.duration / 3200.0)?, all[0].run(problem.duration / 6400.0)?);
            let ratio = problem.error(&coarse.state) / problem.error(&fine.state);
            assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
            assert_eq!((coarse.steps, fine.steps, fine.state.len()), (3200, 6400, if z { 3 } else { 2 }));
            // At least one iteration a step, and the jet after it.
            assert!(fine.evaluations >= 2 * fine.steps);
        }
        Ok(())
    }

    #[test]
    fn steps_are_refused_or_fail_with_a_reason() {
        let all = candidates(&PROBLEMS[1], true);
        for candidate in all.iter().filter(|candidate| candidate.control() == Control::Step) {
            assert!(candidate.run(-1.0).is_err() && candidate.run(f64::NAN).is_err(), "{}", candidate.name());
        }
    }
}
