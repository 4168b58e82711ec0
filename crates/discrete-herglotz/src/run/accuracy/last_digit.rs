//! What an error in the last digit of the start becomes along a motion.
//!
//! Runs with different steps have the same start, and near an unstable equilibrium also the same first roundings: they
//! may agree with each other while that digit alone determines the motion. A run from a neighbouring start tells.

use crate::integration::{InitialState, SystemProblem};
use crate::run::accuracy::limits::{
    CERTAIN_ROUND_OFF, MAX_REGULAR_GROWTH, MIN_MEASURED_ERROR, ROUND_OFF_OF_A_STEP, UNSEEN_GROWTH,
};
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_end::TrialEnd;
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::run::request::Request;
use crate::switching::has_switching_functions;
use crate::{InputError, Point, SelectionFailure, State, Vector};
use contact_geom::numbers::max_abs_or_nan;

/// The relative changes of the start: upward and downward.
const CHANGES: [f64; 2] = [1.0 + f64::EPSILON, 1.0 - f64::EPSILON];

/// The factor by which the distance of two runs grows from one tenth of the span to a later one, beyond the square of the
/// time with which the errors of equal steps accumulate in a regular motion. Infinite if the runs are equal, which tell
/// nothing.
pub(crate) fn growth_of_distances(distances: &[f64]) -> f64 {
    // Equal states may differ below their last digit.
    const LEAST: f64 = f64::EPSILON * f64::EPSILON;
    if distances.iter().all(|d| *d == 0.0) {
        return f64::INFINITY;
    }
    let (mut growth, mut smallest) = (1.0_f64, f64::INFINITY);
    for (i, distance) in distances.iter().enumerate() {
        let squared = ((i + 1) * (i + 1)) as f64;
        growth = growth.max(distance / squared / smallest);
        smallest = smallest.min(distance.max(LEAST) / squared);
    }
    growth
}

impl<'p> Request<'p> {
    /// The same from a start whose numbers are multiplied by a factor; zeros remain. `None` if no motion starts there.
    fn with_start_times(&self, factor: f64) -> Option<Self> {
        let SystemProblem { system, t0, start, state, from_momentum, interrupt, .. } = &self.problem;
        let changed = |x: &Vector| x * factor;
        let start = if *from_momentum || system.hints().hamiltonian {
            let state = State { q: changed(&state.q), p: changed(&state.p), z: state.z * factor };
            InitialState::Momentum(state, start.v.clone())
        } else {
            InitialState::Velocity(Point { q: changed(&start.q), v: changed(&start.v), z: start.z * factor })
        };
        let problem = SystemProblem::checked(system.clone(), *t0, start).ok()?;
        Some(Request { problem: SystemProblem { interrupt: *interrupt, ..problem }, ..self.clone() })
    }
}

impl<'p> TrialRuns<'_, 'p> {
    /// The distances of (q, p) between a run and the same run from a neighbouring start, whichever of two is nearer: one
    /// of them may lie beyond a surface or the domain of L. The distance is infinite from where a run fails, whose steps
    /// are those of a run that does not. `None` if neither starts, or the budget is exhausted. The second start is tried
    /// if the first one is further away than `allowed`.
    fn distances_of_neighbour(
        &mut self,
        of: &Track,
        allowed: f64,
        run: impl Fn(&mut TrialRuns<'_, 'p>) -> Result<TrialEnd, InputError>,
    ) -> Result<Option<Vec<f64>>, InputError> {
        // The last digit of a position may be a large part of the velocity of a motion that hardly moves.
        let of = Track { speed: f64::INFINITY, ..of.clone() };
        let mut nearest: Option<(f64, Vec<f64>)> = None;
        for factor in CHANGES {
            let Some(request) = self.request.with_start_times(factor) else { continue };
            let mut trials =
                TrialRuns { request: &request, collocation: self.collocation.clone(), completed: Vec::new(), ..*self };
            let ending = run(&mut trials);
            (self.left, self.reserve) = (trials.left, trials.reserve);
            let distances = match ending {
                Ok(TrialEnd::Completed(track)) => track.distances(&of),
                Ok(TrialEnd::StepFailed { part, .. }) => {
                    let tenths = of.states.len();
                    let is_before = |i: usize| (i + 1) as f64 <= part * tenths as f64;
                    (0..tenths).map(|i| if is_before(i) { 0.0 } else { f64::INFINITY }).collect()
                }
                Ok(TrialEnd::Interrupted) | Err(InputError::Interrupted) => return Err(InputError::Interrupted),
                _ => continue,
            };
            let largest = max_abs_or_nan(distances.iter().copied());
            if largest <= allowed {
                return Ok(Some(distances));
            }
            if nearest.as_ref().is_none_or(|(other, _)| largest < *other) {
                nearest = Some((largest, distances));
            }
        }
        Ok(nearest.map(|(_, distances)| distances))
    }

    /// The same distances. Where they exceed `allowed`, they are not those that the iterations of the run have left.
    fn distances_at_round_off(
        &mut self,
        of: &Track,
        allowed: f64,
        run: impl Fn(&mut TrialRuns<'_, 'p>) -> Result<TrialEnd, InputError>,
    ) -> Result<Option<Vec<f64>>, InputError> {
        let distances = self.distances_of_neighbour(of, allowed, &run)?;
        let exceeds = distances.as_ref().is_some_and(|found| !found.iter().all(|distance| *distance <= allowed));
        if self.of_iterations > 0.0
            && exceeds
            && let TrialEnd::Completed(exact) = run(self)?
        {
            return self.distances_of_neighbour(&exact, allowed, run);
        }
        Ok(distances)
    }

    /// The error that a change of the last digit of the start causes, where the distances of two runs that agree do not
    /// exclude that it matters; otherwise 0. `run` repeats the coarse one.
    ///
    /// It may exceed the requested error where the motion has resets: the flights between impacts are exact, and what is
    /// measured of a chaotic one, as its exponents, is that of a neighbouring start. The outcome is flagged then.
    ///
    /// # Errors
    /// [`SelectionFailure::IllConditioned`] if it exceeds the requested error of a motion without resets.
    pub fn error_of_last_digit(
        &mut self,
        [coarse, fine]: [&Track; 2],
        run: impl Fn(&mut TrialRuns<'_, 'p>) -> Result<TrialEnd, InputError>,
    ) -> Result<f64, InputError> {
        let State { q, p, .. } = &self.request.problem.state;
        // A motion that remains at its start is exact.
        let moves = coarse.states.iter().any(|x| x[0] != *q || x[1] != *p);
        let growth = growth_of_distances(&coarse.distances(fine));
        // What may have grown unseen is counted where there is growth at all.
        let unseen = if growth > MAX_REGULAR_GROWTH { UNSEEN_GROWTH } else { 1.0 };
        if !moves || f64::EPSILON * growth * unseen <= MIN_MEASURED_ERROR * self.wanted {
            return Ok(0.0);
        }
        let wanted = self.wanted;
        // Some units in the last place are no growth.
        let allowed = wanted.max(CERTAIN_ROUND_OFF);
        let Some(distances) = self.distances_at_round_off(coarse, allowed, run)? else { return Ok(0.0) };
        let distance = max_abs_or_nan(distances.iter().copied());
        if distance <= allowed {
            return Ok(distance.min(wanted));
        }
        let SystemProblem { system, t0, start, .. } = &self.request.problem;
        if system.hints().resets && has_switching_functions(&**system, *t0, start)? {
            return Ok(distance);
        }
        let kept = distances.iter().take_while(|d| **d <= allowed).count();
        let Request { problem, span, .. } = self.request;
        let t = problem.t0 + span * kept as f64 / distances.len() as f64;
        let cause = SelectionFailure::IllConditioned { distance, t };
        Err(InputError::Accuracy { wanted, reached: coarse.distance(fine), cause })
    }

    /// The cause for which runs do not agree, after a test whether the motion is chaotic: the round-off of the steps of
    /// the last coarse run, which `run` repeats, exceeds the requested error. Otherwise the runs do not converge.
    pub fn tested_cause(
        &mut self,
        cause: SelectionFailure,
        (steps, coarse, order): (usize, &Track, f64),
        run: impl Fn(&mut TrialRuns<'_, 'p>) -> Result<TrialEnd, InputError>,
    ) -> Result<SelectionFailure, InputError> {
        let SelectionFailure::Chaos { .. } = cause else { return Ok(cause) };
        let roundings = ROUND_OFF_OF_A_STEP / f64::EPSILON * (steps as f64).sqrt();
        let allowed = self.wanted / roundings;
        let distances = self.distances_at_round_off(coarse, allowed, run)?;
        let grows = distances.is_none_or(|distances| !distances.iter().all(|d| *d <= allowed));
        Ok(if grows { cause } else { SelectionFailure::Order { order } })
    }
}

#[cfg(test)]
mod tests {
    use super::growth_of_distances;

    #[test]
    fn regular_motions_have_no_growth() {
        let by = |d: fn(f64) -> f64| growth_of_distances(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0].map(d));
        assert_eq!(by(|_| 1e-9), 1.0);
        assert_eq!(by(|t| 1e-12 * t), 1.0);
        assert!(by(|t| 1e-12 * t * t) < 1.001);
        // e^(9 * 3) over the square of ten.
        let growth = by(|t| 1e-20 * f64::exp(3.0 * t));
        assert!((growth / (f64::exp(27.0) / 100.0) - 1.0).abs() < 1e-12, "{growth:e}");
        assert_eq!(by(|_| 0.0), f64::INFINITY);
        // No distance at first, and then one of round-off: it may have grown from anything.
        assert!(growth_of_distances(&[0.0, 1e-16]) > 1e14);
    }
}
