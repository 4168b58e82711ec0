//! Runs with fixed steps by every integrator, compared with the motion and with runs of shorter steps.

use super::problem::{Problem, integrators};
use super::random_numbers::RandomNumbers;
use super::system::RandomSystem;
use super::truth::{NoTruth, truth};
use super::verdict::{Checked, Kind, Verdict, Wrong, ended, ensure, refused};
use contact_geom::{ChartVector, OneParameterGroup, Symmetry, VelocityPoint, legendre};
use discrete_herglotz::{DiscreteLagrangian, Outcome, Plan, Row, Rows, Run, Status, Steps, solve::Solver};
use exact_lagrangian::ExactLagrangian;

/// The error, relative to the size of the motion, below which a run agrees with its motion.
const FOUND: f64 = 0.1;

/// The error above which a single step counts as wrong.
const ORDER_ONE: f64 = 1.0;

/// The condition above which a motion has no answer to compare with.
const CHAOTIC: f64 = 1e7;

/// The largest number of steps of a run, and of a run to compare it with.
const STEPS: usize = 200;
const REFINED: usize = 1 << 12;

/// The outputs of a run in addition to its final `(q, p)`.
#[derive(Clone, Debug)]
struct Outputs<const N: usize> {
    action: bool,
    conformal_factor: bool,
    /// The steps between two rows.
    rows: Option<usize>,
    /// The momentum of this group in each row.
    momentum: Option<Symmetry<N>>,
}

impl<const N: usize> Outputs<N> {
    fn of<'p, 'o>(
        &self,
        run: Run<'p, 'o, discrete_herglotz::Problem<'p, RandomSystem<N>, N>>,
    ) -> Run<'p, 'o, discrete_herglotz::Problem<'p, RandomSystem<N>, N>> {
        let run = if self.action { run } else { run.without_action() };
        if self.conformal_factor { run.with_conformal_factor() } else { run }
    }

    fn rows(&self) -> Option<Rows<'_>> {
        let rows = Rows::every(self.rows?).ok()?;
        let rows = if self.action { rows } else { rows.without_action() };
        Some(match &self.momentum {
            Some(group) => rows.column("J", |_, x| group.momentum(&x.q.fixed(), &x.p.fixed())),
            None => rows,
        })
    }
}

/// Draws the outputs of a run, runs it and checks the result.
pub fn fixed<const N: usize>(problem: &Problem<N>, random: &mut RandomNumbers) -> Checked {
    let Problem { system, t0, start, span, .. } = problem;
    let integrator = random.pick(&integrators());
    let count = (random.scale(1.0, STEPS as f64).round() as usize).max(1);
    let h = span / count as f64;
    let steps = if random.chance(0.5) { Steps::Count(count) } else { Steps::Size(h) };
    let momentum = if N == 2 && random.chance(0.2) { Symmetry::rotation(0, 1).ok() } else { None };
    let outputs = Outputs {
        action: random.chance(0.6),
        conformal_factor: random.chance(0.3),
        rows: random.chance(0.3).then(|| 1 + random.below(20)),
        momentum,
    };
    let posed = match problem.posed() {
        Ok(posed) => posed,
        Err(error) => return Ok(refused(&error)),
    };
    let plan = match outputs.of(posed.by(integrator).steps(steps)).plan(problem.until()) {
        Ok(plan) => plan,
        Err(error) => return Ok(refused(&error)),
    };
    let mut stepper = match plan.stepper() {
        Ok(stepper) => stepper,
        Err(error) => return Ok(refused(&error)),
    };
    let mut rows = outputs.rows();
    let run = outputs.of(posed.by(integrator).steps(steps));
    let run = if let Some(rows) = &mut rows { run.observe(rows) } else { run };
    let outcome = match run.run(problem.until()) {
        Ok(outcome) => outcome,
        Err(error) => return Ok(refused(&error)),
    };
    finite(&outcome, rows.iter().flat_map(|rows| &rows.rows))?;
    let Outcome { status, z, rests_from, .. } = outcome;
    let (q, p) = (outcome.q.fixed::<N>(), outcome.p.fixed::<N>());
    if let Status::Failed { cause, step, t } = status {
        ensure(t == outcome.t, Kind::RoutesDiffer, || format!("failed at t = {t}, ended at {}", outcome.t))?;
        ensure(step == outcome.steps, Kind::RoutesDiffer, || format!("step {step} failed after {}", outcome.steps))?;
        return Ok(ended(&cause));
    }
    // No step is taken after the motion has come to rest.
    let rests = rests_from.is_some();
    ensure(rests || outcome.steps == plan.count(), Kind::RoutesDiffer, || {
        format!("{} steps of {}", outcome.steps, plan.count())
    })?;
    let late = (outcome.t - (t0 + span)).abs();
    ensure(late <= 4.0 * f64::EPSILON * (t0.abs() + span), Kind::RoutesDiffer, || format!("ends {late:e} late"))?;

    // The same run without observers.
    let halted = stepper.advance(plan.count());
    let bare = stepper.state();
    let same = halted.is_ok() && (rests || bare.q == q && bare.p == p && z.is_none_or(|z| z == bare.z));
    ensure(same, Kind::ObservedDiffers, || {
        let apart = larger_of(&(bare.q.fixed::<N>() - q), &(bare.p.fixed::<N>() - p));
        format!("{integrator}: {apart:e} between a run with {outputs:?} and one without, {halted:?}")
    })?;
    if outcome.unresolved.is_some() {
        return Ok(Verdict::Flagged);
    }

    let truth = match truth(system, *t0, start, *span) {
        Ok(truth) if truth.condition < CHAOTIC => truth,
        Err(NoTruth::Ends(t)) if t < t0 + span * (1.0 - 1e-6) => {
            let what = format!("{integrator} with {count} steps: the motion ends at t = {t}, the run at {}", outcome.t);
            return Err(Wrong { kind: Kind::BeyondTheEnd, what });
        }
        Ok(_) | Err(_) => return Ok(Verdict::NoReference),
    };
    let error = truth.error(&q, &p, z);
    // The rounding of a run that solves nonlinear equations, or has a momentum among its outputs, of some hundred units
    // a run.
    let floor = truth.rounding(*t0, count);
    if error <= floor {
        return Ok(Verdict::Right);
    }
    // Steps that are too long do not show the order, but the error must decrease.
    let finer = Outputs { conformal_factor: false, ..outputs };
    let mut ends = vec![Some((q, p, z))];
    let mut errors = vec![error];
    let mut refined = 2 * count;
    let small_enough = |error: f64, first: f64| error <= 0.7 * first.min(FOUND) || error <= floor;
    while refined <= REFINED && (errors.len() == 1 || !small_enough(errors[errors.len() - 1], error)) {
        // A poor step may continue where a good one refuses to.
        let run = finer.of(posed.by(integrator).steps(Steps::Count(refined))).run(problem.until()).ok();
        let end = run.filter(|o| o.status == Status::Completed).map(|o| (o.q.fixed(), o.p.fixed(), o.z));
        errors.push(end.as_ref().map_or(f64::INFINITY, |(q, p, z)| truth.error(q, p, *z)));
        ends.push(end);
        refined *= 2;
    }
    let last = errors[errors.len() - 1];
    if !small_enough(last, error) {
        // Runs that agree with each other, and not with the motion, converge to a wrong limit.
        let settled = match &ends[ends.len() - 2..] {
            [Some((q, p, _)), Some((fine_q, fine_p, _))] => {
                truth.error(&(fine_q - q + truth.end.q), &(fine_p - p + truth.end.p), None) <= 0.1 * last
            }
            _ => false,
        };
        ensure(!settled, Kind::DoesNotConverge, || {
            format!(
                "{integrator} from {count} steps, doubled: errors {errors:?}, condition {:.1e}, false_claim {:?}, bump_time {:.1e}",
                truth.condition,
                system.false_claim,
                system.bump_time(start),
            )
        })?;
        return Ok(Verdict::NoReference);
    }
    if error <= FOUND {
        return Ok(Verdict::Right);
    }
    let (step, worst) = worst_step(problem, &plan, truth.size)?;
    ensure(worst <= ORDER_ONE, Kind::UnflaggedStep, || {
        format!(
            "{integrator}, h = {h:.2e}: step {step} of {count} is wrong by {worst:.1e} sizes of the motion; at the end {error:.1e}"
        )
    })?;
    Ok(Verdict::Coarse)
}

fn larger_of<const N: usize>(
    a: &contact_geom::nalgebra::SVector<f64, N>,
    b: &contact_geom::nalgebra::SVector<f64, N>,
) -> f64 {
    contact_geom::numbers::max_abs_or_nan(a.iter().chain(b).copied())
}

/// Fails for an outcome with a number that is not finite; a factor may underflow or overflow in one step.
fn finite<'r>(outcome: &Outcome, rows: impl Iterator<Item = &'r Row>) -> Result<(), Wrong> {
    let end = outcome.q.iter().chain(&outcome.p).copied().chain(outcome.z).chain([outcome.t]);
    let rows = rows.flat_map(|r| r.q.iter().chain(&r.p).copied().chain(r.z).chain(r.columns.clone()).chain([r.t]));
    let good = end.chain(rows).all(f64::is_finite) && outcome.log_factor.is_none_or(|f| !f.is_nan());
    ensure(good, Kind::NotFinite, || format!("{outcome:?}"))
}

/// The number of steps without a reference motion, or with one that takes too long, after which the comparison ends.
const LOST: usize = 4;

/// The step of a run with the largest distance from the motion through its start, in units of the size of the motion,
/// up to the first step that is [wrong](ORDER_ONE): after that the motion may run away and take long to compute.
fn worst_step<const N: usize>(
    problem: &Problem<N>,
    plan: &Plan<'_>,
    [size_q, size_p, _]: [f64; 3],
) -> Result<(usize, f64), Wrong> {
    let none = (0, 0.0);
    let (Ok(mut stepper), Ok(exact)) =
        (plan.stepper(), ExactLagrangian::<_, N>::new(problem.system.clone(), plan.step_size()))
    else {
        return Ok(none);
    };
    let start: VelocityPoint<N> = problem.start;
    let (mut from, mut guess, mut worst, mut lost) = (legendre(&problem.system, problem.t0, &start), start.v, none, 0);
    for k in 0..plan.count() {
        let t = stepper.time();
        if stepper.advance(1).is_err() {
            return Ok(worst);
        }
        let to = stepper.state().fixed::<N>();
        // Where the motion from the start of a step is not defined up to its end, the step should not exist.
        let error = match exact.forward(t, &from, &guess, &mut Solver::default()) {
            Ok(motion) => {
                guess = motion.velocity;
                let apart = ChartVector::from(motion.end).minus(to.into());
                contact_geom::numbers::max_or_nan(
                    contact_geom::numbers::max_abs_or_nan(apart.x.iter().copied()) / size_q,
                    contact_geom::numbers::max_abs_or_nan(apart.y.iter().copied()) / size_p,
                )
            }
            Err(_) => {
                lost += 1;
                0.0
            }
        };
        if error > worst.1 {
            worst = (k, error);
        }
        if worst.1 > ORDER_ONE || lost > LOST {
            return Ok(worst);
        }
        from = to;
    }
    Ok(worst)
}
