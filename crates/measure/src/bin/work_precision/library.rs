//! The methods of the library, set on the problems.

use crate::candidate::{Candidate, of_library};
use crate::problems::{KEPLER, OSCILLATOR, PENDULUM, Problem, QUADRATIC, System};
use contact_geom::Lagrangian;
use discrete_herglotz::AnyIntegrator;

/// The integrators of the library that apply to a problem, with or without the action. A flow of a discrete Lagrangian always
/// has the action; without it, nobody looks.
pub fn candidates(problem: &Problem, z: bool) -> Vec<Box<dyn Candidate>> {
    match problem.system {
        System::Oscillator => of(&OSCILLATOR, problem, z),
        System::Pendulum => of(&PENDULUM, problem, z),
        System::Kepler => of::<_, 2>(&KEPLER, problem, z),
        System::Quadratic => of(&QUADRATIC, problem, z),
    }
}

fn of<L: Lagrangian<N>, const N: usize>(lagrangian: &'static L, problem: &Problem, z: bool) -> Vec<Box<dyn Candidate>> {
    // Those of one step size: by a clock the number of steps is found by the run.
    let fixed = |integrator: &AnyIntegrator| !matches!(integrator, AnyIntegrator::Clocked { .. });
    let applicable = |integrator: &AnyIntegrator| fixed(integrator) && integrator.check(lagrangian).is_ok();
    let chosen = AnyIntegrator::all().into_iter().filter(applicable);
    chosen.map(|integrator| of_library(lagrangian, integrator, problem, z)).collect()
}

/// The integrators that are measured where none is named: one or two of each kind, as many as a diagram's legend holds.
pub const DIAGRAMS: [&str; 10] = [
    "midpoint",
    "strang",
    "blanes_moan_6",
    "kahan_li_8",
    "sofroniou_spaletta_10",
    "midpoint_by_kahan_li_8",
    "gauss_4",
    "gauss_8",
    "gauss_12",
    "gauss_16",
];

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
