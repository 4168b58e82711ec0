//! Runs of one motion.

use super::WITHOUT_CONSTRAINTS;
use super::discrete;
use super::formula_system::FormulaSystem;
use super::recorder::Recorder;
use super::sized::{Sized, coordinates};
use crate::full::not_compiled;
use crate::{Motion, Outcome, Plan, PlanEntry, RunMonitor, RuntimeError, StepControl};
use contact_geom::nalgebra::SVector;
use discrete_herglotz::{Problem, ResumeState, Run, Steps, Until, Vector};
use formula_lagrangian::Formula;

/// What motions with a force lose, and why.
pub(crate) const LOSSES_WITH_FORCE: &[(&str, &str)] = &[
    (
        "contact flow",
        "a force f changes eta = dz - L_v dq at the rate L_z eta - f dq, where f dq is the virtual work of the force",
    ),
    ("momenta of symmetries", "they follow the conformal factor only if the force does no work along the symmetry"),
    ("discrete Lagrangian", "there is none with a force, and the theorems on discrete Herglotz equations do not apply"),
];

/// The run of a motion, without its observer.
///
/// # Errors
/// [`RuntimeError::Length`] where the number of scales is not the number of coordinates.
pub(super) fn of<'p, 'o, L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    problem: &'p Problem<'p, L, N>,
    motion: &Motion,
) -> Result<Run<'p, 'o, Problem<'p, L, N>>, RuntimeError> {
    let by = match motion.step_control {
        StepControl::Accuracy { by, .. } => by,
        StepControl::Steps { by, .. } => Some(by),
    };
    if let Some(method) = &motion.method {
        // Written so that it is not compiled for Hamiltonians.
        if const { !discrete::has_custom::<L, N>() } {
            return Err(discrete::no_custom());
        } else {
            let by = discrete::custom::<L, N>(method, &system.0)?;
            let run = match motion.step_control {
                StepControl::Accuracy { error, .. } => problem.by(by).accuracy(error),
                StepControl::Steps { steps, .. } => problem.by(by).steps(steps),
            };
            return scaled(system, run, motion);
        }
    }
    let run = match (motion.step_control, system.0.constrained(by)?) {
        (StepControl::Accuracy { error, .. }, Some(method)) => problem.by(method).accuracy(error),
        (StepControl::Steps { steps, .. }, Some(method)) => problem.by(method).steps(steps),
        (_, None) if const { !L::IS_FREE } => return Err(not_compiled(WITHOUT_CONSTRAINTS)),
        (StepControl::Accuracy { error, by: None }, None) => problem.accuracy(error),
        (StepControl::Accuracy { error, by: Some(by) }, None) => problem.by(L::by(by)?).accuracy(error),
        (StepControl::Steps { by, steps }, None) => problem.by(L::by(by)?).steps(steps),
    };
    scaled(system, run, motion)
}

/// A run with what a motion requests of it, and with its scales.
fn scaled<'p, 'o, L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    run: Run<'p, 'o, Problem<'p, L, N>>,
    motion: &Motion,
) -> Result<Run<'p, 'o, Problem<'p, L, N>>, RuntimeError> {
    let scales = motion.scales.as_ref().map(|scales| system.vector("scales", scales)).transpose()?;
    // Additional coordinates are at rest, and any size will do.
    let n = system.0.formula().dimension();
    let whole = |scales: SVector<f64, N>| Vector::from_fn(N, |i| if i < n { scales[i] } else { 1.0 });
    Ok(requested(run, motion, scales.map(whole)))
}

/// A run with what a motion requests of it.
pub(super) fn requested<'p, 'o, P>(run: Run<'p, 'o, P>, motion: &Motion, scales: Option<Vector>) -> Run<'p, 'o, P> {
    let run = if motion.action { run } else { run.without_action() };
    let run = if motion.conformal_factor { run.with_conformal_factor() } else { run };
    let run = if motion.exact { run.with_exact_states() } else { run };
    let run = if motion.estimate { run.with_error_estimate() } else { run };
    match scales {
        Some(scales) => run.scales(scales),
        None => run,
    }
}

/// A given step that differs from that of the plan by less, relative to its size, is the same up to round-off.
const ROUND_OFF_OF_STEPS: f64 = 1e-9;

/// The first line of the plan of a formula in which z may have been meant to be a coordinate.
const ACTION_IS_NO_COORDINATE: &str = "z is the action and acts as drag: it is no coordinate beside x and y; \
                                       for a coordinate z, give the action another name, as in action = \"s\"";

/// Whether a formula has coordinates x and y, and depends on an action that is named z.
fn acts_as_drag(formula: &Formula) -> bool {
    let names = formula.coordinates();
    let has = |name: &str| names.iter().any(|coordinate| coordinate == name);
    has("x") && has("y") && formula.action() == "z" && formula.has_action()
}

pub(super) fn plan<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
) -> Result<Plan, RuntimeError> {
    let problem = system.problem_of(motion)?;
    let mut no_monitor = ();
    let mut recorder = Recorder::new(&system.0, motion, &mut no_monitor)?;
    let run = of(system, &problem, motion)?.observe(&mut recorder);
    plan_of(&run, motion, system.0.formula(), system.0.has_force())
}

/// The plan of a run.
pub(super) fn plan_of<P>(
    run: &Run<'_, '_, P>,
    motion: &Motion,
    formula: &Formula,
    has_force: bool,
) -> Result<Plan, RuntimeError> {
    let plan = run.plan(Until::Time(motion.end))?;
    let (mut text, mut items) = (plan.to_string(), plan.entries());
    if let StepControl::Steps { steps: Steps::Size(given), .. } = motion.step_control
        && (plan.step_size().abs() / given.abs() - 1.0).abs() > ROUND_OFF_OF_STEPS
    {
        let (found, given) = (plan.step_size().abs(), given.abs());
        let line = format!("the steps of {given} became {found}: equal steps that fill the span\n");
        let first = text.find('\n').map_or(text.len(), |end| end + 1);
        text.insert_str(first, &line);
    }
    if acts_as_drag(formula) {
        text.insert_str(0, &format!("{ACTION_IS_NO_COORDINATE}\n"));
    }
    if has_force {
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

pub(super) fn run<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    monitor: &mut dyn RunMonitor,
    from: Option<ResumeState>,
) -> Result<Outcome, RuntimeError> {
    let problem = system.problem_of(motion)?;
    let mut recorder = Recorder::new(&system.0, motion, monitor)?;
    let run = of(system, &problem, motion)?.observe(&mut recorder);
    outcome_of(run, motion, from, system.0.formula().dimension())
}

/// The outcome of a run, in the n coordinates of a formula.
pub(super) fn outcome_of<P>(
    run: Run<'_, '_, P>,
    motion: &Motion,
    from: Option<ResumeState>,
    n: usize,
) -> Result<Outcome, RuntimeError> {
    let run = match from {
        Some(from) => run.resume(from),
        None => run,
    };
    let outcome = run.run(Until::Time(motion.end))?;
    Ok(Outcome {
        status: outcome.status,
        unresolved: outcome.unresolved,
        steps: outcome.steps,
        rests_from: outcome.rests_from,
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
