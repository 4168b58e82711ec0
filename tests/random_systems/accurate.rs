//! Runs with an accuracy: the true error is at most ten times the requested one, or the run is refused.

use super::problem::{Problem, integrators};
use super::random_numbers::RandomNumbers;
use super::truth::{NoTruth, truth};
use super::verdict::{Checked, Kind, Verdict, Wrong, ended, ensure, refused};
use discrete_herglotz::Status;

/// The largest number of steps of a case.
const STEPS: usize = 200_000;

pub fn accurate<const N: usize>(problem: &Problem<N>, random: &mut RandomNumbers) -> Checked {
    let Problem { system, t0, start, span, .. } = problem;
    // Twelve digits by a rule of order 1 or 2 would take too many steps; the accuracy depends on the order.
    let integrator = random.pick(&integrators());
    let least: f64 = if integrator.order() <= 2 { 1e-4 } else { 1e-10 };
    let tolerance = random.scale(least, 1e-2);
    let action = random.chance(0.5);
    let posed = match problem.posed() {
        Ok(posed) => posed,
        Err(error) => return Ok(refused(&error)),
    };
    let run = posed.by(integrator).accuracy(tolerance);
    let run = if action { run } else { run.without_action() };
    let plan = match run.plan(problem.until()) {
        Ok(plan) => plan,
        Err(error) => return Ok(refused(&error)),
    };
    if plan.count() > STEPS {
        return Ok(Verdict::NoReference);
    }
    let outcome = match plan.run() {
        Ok(outcome) => outcome,
        Err(error) => return Ok(refused(&error)),
    };
    let numbers = outcome.q.iter().chain(&outcome.p).copied().chain(outcome.z);
    ensure(numbers.into_iter().all(f64::is_finite), Kind::NotFinite, || format!("{outcome:?}"))?;
    if let Status::Failed { cause, .. } = outcome.status {
        return Ok(ended(&cause));
    }
    let truth = match truth(system, *t0, start, *span) {
        Ok(truth) => truth,
        Err(NoTruth::Ends(t)) if t < t0 + span * (1.0 - 1e-6) => {
            let what = format!("{integrator} to {tolerance:.1e}: the motion ends at t = {t}, the run at {}", outcome.t);
            return Err(Wrong { kind: Kind::BeyondTheEnd, what });
        }
        Err(_) => return Ok(Verdict::NoReference),
    };
    let error = truth.error_at_end(&outcome.q.fixed(), &outcome.p.fixed());
    let floor = truth.rounding(*t0, plan.count());
    if 10.0 * tolerance < floor {
        return Ok(Verdict::NoReference);
    }
    ensure(error <= 10.0 * tolerance, Kind::AboveTolerance, || {
        format!(
            "{integrator}: error {error:.1e} where {tolerance:.1e} was requested, {} steps, condition {:.1e}, false_claim {:?}, bump_time {:.1e}",
            plan.count(),
            truth.condition,
            system.false_claim,
            system.bump_time(start),
        )
    })?;
    Ok(Verdict::Right)
}
