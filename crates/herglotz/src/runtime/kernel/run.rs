//! Runs of one motion.

use super::recorder::Recorder;
use super::sized::{Sized, coordinates};
use crate::runtime::system::LOSSES_WITH_FORCE;
use crate::runtime::{Motion, Outcome, Plan, PlanEntry, RunMonitor, RuntimeError, StepControl};
use contact_geom::Lagrangian;
use discrete_herglotz::{Problem, ResumeState, Run, Until};
use formula_lagrangian::FormulaLagrangian;

/// The run of a motion, without its observer.
///
/// # Errors
/// [`RuntimeError::Length`] where the number of scales is not the number of coordinates.
pub(super) fn of<'p, 'o, const N: usize>(
    system: &Sized<N>,
    problem: &'p Problem<'p, FormulaLagrangian<N>, N>,
    motion: &Motion,
) -> Result<Run<'p, 'o, FormulaLagrangian<N>, N>, RuntimeError> {
    let run = match motion.step_control {
        StepControl::Accuracy { error, by: None } => problem.accuracy(error),
        StepControl::Accuracy { error, by: Some(by) } => problem.by(by).accuracy(error),
        StepControl::Steps { by, steps } => problem.by(by).steps(steps),
    };
    let run = if motion.action { run } else { run.without_action() };
    let run = if motion.conformal_factor { run.with_conformal_factor() } else { run };
    let run = if motion.estimate { run.with_error_estimate() } else { run };
    Ok(match &motion.scales {
        Some(scales) => run.scales(system.vector("scales", scales)?.into()),
        None => run,
    })
}

pub(super) fn plan<const N: usize>(system: &Sized<N>, motion: &Motion) -> Result<Plan, RuntimeError> {
    let problem = system.problem_of(motion)?;
    let mut no_monitor = ();
    let mut recorder = Recorder::new(&system.0, motion, &mut no_monitor)?;
    let run = of(system, &problem, motion)?.observe(&mut recorder);
    let plan = run.plan(Until::Time(motion.end))?;
    let (mut text, mut items) = (plan.to_string(), plan.entries());
    if Lagrangian::has_force(&system.0) {
        for (what, why) in LOSSES_WITH_FORCE {
            // The entries that are skipped are the last ones in the text.
            text += &format!("  {what}: {why}\n");
            items.push(PlanEntry::skipped(what, *why));
        }
    }
    Ok(Plan {
        text,
        integrator: plan.integrator().clone(),
        step_size: plan.step_size(),
        steps: plan.count(),
        error: plan.error(),
        items,
    })
}

pub(super) fn run<const N: usize>(
    system: &Sized<N>,
    motion: &Motion,
    monitor: &mut dyn RunMonitor,
    from: Option<ResumeState>,
) -> Result<Outcome, RuntimeError> {
    let problem = system.problem_of(motion)?;
    let mut recorder = Recorder::new(&system.0, motion, monitor)?;
    let run = of(system, &problem, motion)?.observe(&mut recorder);
    let run = match from {
        Some(from) => run.resume(from),
        None => run,
    };
    let (outcome, n) = (run.run(Until::Time(motion.end))?, system.0.formula().dimension());
    Ok(Outcome {
        status: outcome.status,
        unresolved: outcome.unresolved,
        steps: outcome.steps,
        t: outcome.t,
        q: coordinates(&outcome.q, n).to_vec(),
        p: coordinates(&outcome.p, n).to_vec(),
        v: outcome.v.map(|v| coordinates(&v, n).to_vec()),
        z: outcome.z,
        log_factor: outcome.log_factor,
        error_estimate: outcome.error_estimate,
        evaluations: outcome.evaluations,
    })
}
