//! Contact Gauss collocation by its own entry point: steps in chunks, dense output, events.

use super::flows::{is_conformal, step_solves_its_equations};
use super::problem::Problem;
use super::random_numbers::RandomNumbers;
use super::verdict::{Checked, Kind, Verdict, Wrong, ended, ensure, refused};
use crate::gauss_steppers::GaussSteppers;
use contact_geom::{
    ChartVector, legendre,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{
    AnyIntegrator, Event, Events, RunSupport, Start, Status, StepDetails, StepFailure, Stepper, Steps, Until,
    gauss::Gauss,
};

pub fn gauss<const N: usize>(problem: &Problem<N>, random: &mut RandomNumbers) -> Checked {
    let Problem { system, t0, start, .. } = problem;
    let (stages, h, steps) = (1 + random.below(16), random.scale(1e-3, 1.0), 1 + random.below(20));
    let state = legendre(system, *t0, start);
    let gauss = match Gauss::new(system.clone(), stages, h) {
        Ok(gauss) => gauss,
        Err(error) => return Ok(refused(&error)),
    };
    let stepper = || gauss.stepper(*t0, state, start.v);
    let mut whole = match stepper() {
        Ok(stepper) => stepper,
        Err(error) => return Ok(refused(&error)),
    };
    let all = whole.advance(steps);
    let end = whole.state();
    ensure(end.is_finite(), Kind::NotFinite, || format!("gauss_{stages}: {end:?}"))?;

    // The same in chunks, with dense output between them.
    let Ok(mut parts) = stepper() else { return Ok(Verdict::NoReference) };
    let (mut taken, mut halted) = (0, Ok(()));
    let mut last = (*t0, state);
    while taken < steps && halted.is_ok() {
        let chunk = (1 + random.below(4)).min(steps - taken);
        halted = parts.advance(chunk).map_err(|halt| StepFailure { taken: taken + halt.taken, ..halt });
        taken += chunk;
        if halted.is_ok() {
            check_dense_output::<N>(&parts, stages, random)?;
            if chunk == 1 && random.chance(0.1) {
                step_solves_its_equations(&gauss, last.0, &last.1, &parts.state().fixed())?;
            }
            last = (parts.time(), parts.state().fixed());
        }
    }
    ensure(halted == all && parts.state() == end, Kind::ObservedDiffers, || {
        format!("gauss_{stages}: {all:?} and {halted:?}, {end:?} and {:?}", parts.state())
    })?;
    if random.chance(0.2) {
        is_conformal(&gauss, *t0, &state, &start.v)?;
    }

    // Without the action the motion is the same to the bit, up to the first failure of either.
    let Ok(mut bare) = gauss.stepper_without_action(*t0, state, start.v) else { return Ok(Verdict::NoReference) };
    let without = bare.advance(steps);
    let same = match (all, without) {
        (Ok(()), Ok(())) => bare.state().q == end.q && bare.state().p == end.p,
        (all, without) => all.is_err() && without.is_err(),
    };
    ensure(same, Kind::ObservedDiffers, || {
        format!("gauss_{stages} without the action: {all:?} and {without:?}, {end:?} and {:?}", bare.state())
    })?;

    with_events(problem, (stages, h, steps), random)?;
    Ok(match all {
        _ if whole.unresolved().is_some() => Verdict::Flagged,
        Ok(()) => Verdict::Right,
        Err(halt) => ended(&halt.cause),
    })
}

/// A run with an event where the first coordinate crosses a level: the states of the crossings are on the level, the
/// times are in order, and the run is the same as without the event.
fn with_events<const N: usize>(
    problem: &Problem<N>,
    (stages, h, steps): (usize, f64, usize),
    random: &mut RandomNumbers,
) -> Result<(), Wrong> {
    let Problem { system, t0, start, .. } = problem;
    let level = start.q[0] + random.between(-0.5, 0.5);
    let event = Event::new(|_, x| x.q[0] - level);
    let event = match random.below(3) {
        0 => event,
        1 => event.rising(),
        _ => event.falling(),
    };
    let terminal = random.chance(0.3);
    let mut events = Events::new([if terminal { event.terminal() } else { event }]);
    // A run is refused more often than a stepper, since it checks the declared structure along the whole span.
    let Ok(posed) = problem.posed() else { return Ok(()) };
    let by_steps = posed.by(AnyIntegrator::Gauss { stages }).steps(Steps::Size(h)).observe(&mut events);
    let Ok(plan) = by_steps.plan(Until::Steps(steps)) else { return Ok(()) };
    // The step size may differ from h in the last digit.
    let of_run = plan.step_size();
    let (Ok(outcome), Ok(gauss)) = (by_steps.run(Until::Steps(steps)), Gauss::new(system.clone(), stages, of_run))
    else {
        return ensure(false, Kind::RoutesDiffer, || format!("gauss_{stages}: a plan and no run"));
    };
    let at = posed.state();
    let Ok(mut stepper) = gauss.stepper(*t0, *at, start.v) else {
        return ensure(false, Kind::RoutesDiffer, || format!("gauss_{stages}: a run and no stepper"));
    };
    let without = stepper.advance(steps);
    let (state, end) = (outcome.state(), stepper.state());
    let mut before = *t0;
    for crossing in &events.crossings {
        let off = (crossing.state.q[0] - level).abs();
        // The rounding of the sums of a step of up to 16 terms, and the motion in the spacing of the time.
        let size = ChartVector::from(crossing.state.fixed::<N>()).amax()
            + ChartVector::from(end.fixed::<N>()).amax()
            + ChartVector::from(*at).amax()
            + 1.0;
        let from_there =
            discrete_herglotz::Problem::new(system, crossing.t, Start::Momentum(crossing.state.fixed(), start.v));
        let speed = from_there.map_or(f64::INFINITY, |from_there| from_there.start().v[0].abs());
        let bound = f64::EPSILON * (1e3 * size + 4.0 * crossing.t.abs() * speed);
        ensure(off <= bound && crossing.t >= before, Kind::Residual, || {
            format!("gauss_{stages}: a crossing at t = {} is {off:.1e} off, not {bound:.1e}", crossing.t)
        })?;
        before = crossing.t;
    }
    match outcome.status {
        Status::Completed => ensure(without.is_ok() && state == end, Kind::ObservedDiffers, || {
            format!("gauss_{stages}: with events {state:?}, without {end:?}")
        }),
        Status::Stopped { t, .. } => {
            let there = events.crossings.last().map(|c| (c.t, &c.state)) == Some((t, &state)) && t == outcome.t;
            ensure(terminal && there, Kind::RoutesDiffer, || format!("gauss_{stages}: {outcome:?}"))
        }
        // The failure is that of the run, or an earlier one: a part of a step cannot be taken.
        Status::Failed { step, cause, .. } => {
            let same = without == Err(StepFailure { taken: step, cause });
            let before = without.map_or_else(|halt| halt.taken, |()| steps) >= step && step > 0;
            ensure((same || before) && state.check().is_ok(), Kind::ObservedDiffers, || {
                format!("gauss_{stages}: {outcome:?} with events, {without:?} without")
            })
        }
        // The plan has taken all steps and checked the structure.
        _ => ensure(false, Kind::RoutesDiffer, || format!("gauss_{stages}: {outcome:?}")),
    }
}

/// The dense output of the last step: at its ends it is the states, and between them finite.
fn check_dense_output<const N: usize>(
    stepper: &discrete_herglotz::gauss::GaussStepper<'_>,
    stages: usize,
    random: &mut RandomNumbers,
) -> Result<(), Wrong> {
    let Some(curve) = stepper.dense() else {
        return ensure(false, Kind::RoutesDiffer, || "no dense output after a step".into());
    };
    let (from, to) = curve.span();
    let within = curve.at(from + (to - from) * random.between(0.0, 1.0));
    let (end, state) = (curve.at(to).fixed::<N>(), stepper.state().fixed::<N>());
    let apart = ChartVector::from(end).minus(state.into());
    // The times are `t0 + k h`, from a start that may be ten units away.
    let spacing = 64.0 * f64::EPSILON * (1.0 + to.abs());
    ensure(within.is_finite() && (to - stepper.time()).abs() <= spacing, Kind::NotFinite, || {
        format!("gauss_{stages}: {within:?} between {from} and {to}")
    })?;
    // In a step that is too long, and flagged, the stages are so large that their sums lose all digits.
    if stepper.unresolved().is_some() {
        return Ok(());
    }
    // Sums of up to 16 terms with weights to 33, of the largest numbers in the step; and the motion in the spacing of
    // the time.
    let places: Vec<_> =
        (0..=16).map(|i| ChartVector::from(curve.at(from + (to - from) * f64::from(i) / 16.0).fixed::<N>())).collect();
    let fastest = (0..=16)
        .map(|i| max_abs_or_nan(curve.velocity(from + (to - from) * f64::from(i) / 16.0).iter().copied()))
        .fold(0.0, max_or_nan);
    let changes = places.windows(2).map(|p| p[1].minus(p[0]).amax()).fold(0.0, max_or_nan) * 16.0;
    let size = places.iter().map(ChartVector::amax).fold((to - from) * fastest, max_or_nan);
    let bound = 1e4 * f64::EPSILON * size + spacing * max_or_nan(fastest, changes / (to - from));
    ensure(apart.amax() <= bound, Kind::RoutesDiffer, || {
        format!(
            "gauss_{stages}, {:?}, h = {:.1e}: the curve ends {apart:?} from the state {state:?}, sigma {:e}, bound {bound:.1e}",
            stepper.route(),
            to - from,
            stepper.sigma()
        )
    })
}
