//! Sweeps: a candidate solves its problem repeatedly, with decreasing steps or tolerances.

use crate::candidate::{Candidate, Control, Run, RunError};
use crate::problems::Problem;
use crate::row::{Action, Origin, Row};

/// The minimum number of runs from which a median is taken.
const MIN_RUNS: usize = 7;

/// Short runs are repeated until they have taken this many seconds in total, or this many times.
const REPEATS: (f64, usize) = (0.02, 200);

/// The coarsest step tried, in time units: about a period of the problems.
const MAX_STEP_SIZE: f64 = 6.5;

/// The largest number of steps tried.
const MAX_STEPS: f64 = 1e8;

/// Once the error is below this value, two steps that do not reduce it end a sweep: the rest of the error is round-off.
const ROUND_OFF_BELOW: f64 = 1e-9;

/// The tolerances tried are 10^-k for k in this range.
const TOLERANCES: std::ops::RangeInclusive<i32> = 3..=15;

/// The resolution and the time limit of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Whether the numbers of steps are powers of two only.
    pub quick: bool,
}

impl Effort {
    /// A run that takes longer than this, in seconds, is the last of its sweep.
    fn bound(self) -> f64 {
        if self.quick { 0.02 } else { 0.05 }
    }

    /// The factors that multiply powers of two to give the numbers of steps.
    fn factors(self) -> &'static [f64] {
        if self.quick { &[1.0] } else { &[1.0, 1.25, 1.5625] }
    }
}

/// The results of a sweep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sweep {
    /// A row for each run with a final state, in the order of the sweep.
    pub rows: Vec<Row>,
    /// For each run without a final state: the step or tolerance, and the cause.
    pub failed: Vec<(f64, String)>,
}

/// The steps or tolerances of a candidate, from coarse to fine.
///
/// Numbers of steps are 2^k times 1, 5/4 and 25/16, where the duration has such factors too, so that each step size is a
/// double and the steps end at the final time exactly. A rounded step size would miss it by up to 1e-13, which would be
/// visible in small errors.
fn controls(control: Control, problem: &Problem, effort: Effort) -> Vec<f64> {
    let duration = problem.duration;
    match control {
        Control::Step => (0..)
            .flat_map(|k| effort.factors().iter().map(move |factor| 2f64.powi(k) * factor))
            .skip_while(|steps| duration / steps > MAX_STEP_SIZE)
            .take_while(|steps| *steps <= MAX_STEPS)
            .map(|steps| duration / steps)
            .filter(|h| (duration / h).round().mul_add(*h, -duration) == 0.0)
            .collect(),
        Control::Tolerance => {
            TOLERANCES.map(|k| 10f64.powi(-k)).filter(|t| *t <= problem.coarsest_tolerance()).collect()
        }
    }
}

/// Solves the problem often enough for a median of the run time; all other results are the same in every run.
pub fn timed(candidate: &dyn Candidate, control: f64) -> Result<Run, RunError> {
    let mut run = candidate.run(control)?;
    let mut seconds = vec![run.seconds];
    let mut total = run.seconds;
    while seconds.len() < MIN_RUNS || (total < REPEATS.0 && seconds.len() < REPEATS.1) {
        let again = candidate.run(control)?.seconds;
        seconds.push(again);
        total += again;
    }
    seconds.sort_by(f64::total_cmp);
    run.seconds = seconds.get(seconds.len() / 2).copied().unwrap_or(run.seconds);
    Ok(run)
}

/// Measures a candidate from coarse to fine, until a run is slow or the error no longer decreases.
pub fn sweep(candidate: &dyn Candidate, origin: Origin, problem: &Problem, z: Action, effort: Effort) -> Sweep {
    let mut sweep = Sweep::default();
    let (mut last, mut strikes) = (f64::INFINITY, 0);
    let control = candidate.control();
    for value in controls(control, problem, effort) {
        let run = match timed(candidate, value) {
            Ok(run) => run,
            Err(error) => {
                sweep.failed.push((value, error.to_string()));
                continue;
            }
        };
        let (error, seconds) = (problem.error(&run.state), run.seconds);
        if error.is_finite() {
            sweep.rows.push(Row {
                problem: problem.name,
                method: candidate.name().into(),
                origin,
                order: Some(candidate.order()),
                z,
                h: (control == Control::Step).then_some(value),
                steps: run.steps,
                evaluations: run.evaluations,
                error,
                error_z: problem.error_z(&run.state),
                seconds,
            });
        } else {
            sweep.failed.push((value, "the final state is not finite".into()));
        }
        strikes += u32::from(error < ROUND_OFF_BELOW && error >= last);
        last = error;
        if seconds > effort.bound() || (control == Control::Step && strikes == 2) {
            break;
        }
    }
    sweep
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problems::PROBLEMS;

    #[test]
    fn steps_end_at_the_final_time_exactly() {
        for problem in &PROBLEMS {
            for quick in [true, false] {
                let steps = controls(Control::Step, problem, Effort { quick });
                assert!(steps[0] <= MAX_STEP_SIZE && steps[0] > MAX_STEP_SIZE / 2.0);
                assert!(steps.windows(2).all(|pair| pair[1] < pair[0] && pair[1] >= pair[0] / 2.0));
                for h in steps {
                    let count = (problem.duration / h).round();
                    assert_eq!(count.mul_add(h, -problem.duration), 0.0, "{}: {h:e}", problem.name);
                }
            }
        }
    }

    #[test]
    fn tolerances_are_powers_of_ten() {
        let of = |problem| controls(Control::Tolerance, problem, Effort { quick: false });
        assert_eq!((of(&PROBLEMS[0])[0], of(&PROBLEMS[0]).len()), (1e-3, 13));
        assert_eq!((of(&PROBLEMS[2])[0], of(&PROBLEMS[2]).len()), (1e-6, 10));
    }
}
