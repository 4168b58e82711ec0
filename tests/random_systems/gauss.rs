//! Contact Gauss collocation by its own door: chunks, dense output, events.

use super::dice::Dice;
use super::flows::{is_conformal, step_solves_its_equations};
use super::problem::Problem;
use super::verdict::{Checked, Kind, Verdict, ended, ensure, refused};
use contact_geom::{PhasePoint, Triple, larger, largest, legendre};
use discrete_herglotz::{Direction, Event, EventStatus, Gauss, Halt, Stepper, run_with_events};

pub fn gauss<const N: usize>(problem: &Problem<N>, dice: &mut Dice) -> Checked {
    let Problem { system, t0, start, .. } = problem;
    let (stages, h, steps) = (1 + dice.below(16), dice.scale(1e-3, 1.0), 1 + dice.below(20));
    let state = legendre(system, *t0, start);
    let gauss = match Gauss::new(system, stages, h) {
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
    ensure(Triple::from(end).is_finite(), Kind::NotFinite, || format!("gauss_{stages}: {end:?}"))?;

    // The same in chunks, looked at between them.
    let Ok(mut parts) = stepper() else { return Ok(Verdict::NoReference) };
    let (mut taken, mut halted) = (0, Ok(()));
    let mut last = (*t0, state);
    while taken < steps && halted.is_ok() {
        let chunk = (1 + dice.below(4)).min(steps - taken);
        halted = parts.advance(chunk).map_err(|halt| Halt { taken: taken + halt.taken, ..halt });
        taken += chunk;
        if halted.is_ok() {
            looked_at(&parts, stages, dice)?;
            if chunk == 1 && dice.chance(0.1) {
                step_solves_its_equations(&gauss, last.0, &last.1, &parts.state())?;
            }
            last = (parts.time(), parts.state());
        }
    }
    ensure(halted == all && parts.state() == end, Kind::ObservedDiffers, || {
        format!("gauss_{stages}: {all:?} and {halted:?}, {end:?} and {:?}", parts.state())
    })?;
    if dice.chance(0.2) {
        is_conformal(&gauss, *t0, &state, &start.v)?;
    }

    // Without the action the motion is the same to the bit, up to where one of both ends.
    let Ok(mut bare) = gauss.stepper_without_action(*t0, state, start.v) else { return Ok(Verdict::NoReference) };
    let without = bare.advance(steps);
    let same = match (all, without) {
        (Ok(()), Ok(())) => bare.state().q == end.q && bare.state().p == end.p,
        (all, without) => all.is_err() && without.is_err(),
    };
    ensure(same, Kind::ObservedDiffers, || {
        format!("gauss_{stages} without the action: {all:?} and {without:?}, {end:?} and {:?}", bare.state())
    })?;

    let Ok(mut watched) = stepper() else { return Ok(Verdict::NoReference) };
    let level = state.q[0] + dice.between(-0.5, 0.5);
    let direction = dice.pick(&[Direction::Both, Direction::Rising, Direction::Falling]);
    let event = Event::new(|_, x: &PhasePoint<N>| x.q[0] - level).in_direction(direction);
    let terminal = dice.chance(0.3);
    let events = &mut [if terminal { event.terminal() } else { event }];
    let run = match run_with_events(&mut watched, steps, events) {
        Ok(run) => run,
        Err(error) => return Ok(refused(&error)),
    };
    let mut before = *t0;
    for crossing in &run.crossings {
        let off = (crossing.state.q[0] - level).abs();
        // The rounding of the curve's sums over up to 16 terms, and what the motion does in the spacing of its fractions.
        let size = Triple::from(crossing.state).amax() + Triple::from(end).amax() + Triple::from(state).amax() + 1.0;
        let bound = 1e3 * f64::EPSILON * size;
        ensure(off <= bound && crossing.t >= before, Kind::Residual, || {
            format!("gauss_{stages}: a crossing at t = {} is {off:.1e} off, not {bound:.1e}", crossing.t)
        })?;
        before = crossing.t;
    }
    match run.status {
        EventStatus::Completed => {
            let same = all.is_ok() && run.state == end;
            ensure(same, Kind::ObservedDiffers, || format!("with events {:?}, without {end:?}", run.state))?;
        }
        EventStatus::Terminated { .. } => {
            ensure(terminal && run.state.check().is_ok(), Kind::NotFinite, || format!("{run:?}"))?;
        }
        EventStatus::Failed(halt) => {
            ensure(all == Err(halt), Kind::ObservedDiffers, || format!("{halt:?} with events, {all:?} without"))?;
        }
        EventStatus::Undefined { .. } => {
            ensure(run.state.check().is_ok(), Kind::NotFinite, || format!("{run:?}"))?;
        }
    }
    Ok(match all {
        _ if whole.suspicion().is_some() => Verdict::Marked,
        Ok(()) => Verdict::Right,
        Err(halt) => ended(&halt.cause),
    })
}

/// The dense output of the last step: at its ends the states, between them finite.
fn looked_at<const N: usize>(
    stepper: &discrete_herglotz::GaussStepper<'_, &super::system::RandomSystem<N>, N>,
    stages: usize,
    dice: &mut Dice,
) -> Result<(), super::verdict::Wrong> {
    let Some(curve) = stepper.dense() else {
        return ensure(false, Kind::RoutesDiffer, || "no dense output after a step".into());
    };
    let (from, to) = curve.span();
    let within = curve.at(from + (to - from) * dice.between(0.0, 1.0));
    let (end, state) = (curve.at(to), stepper.state());
    let apart = Triple::from(end).minus(state.into());
    // The times are `t0 + k h`, from a start that may be ten units away.
    let spacing = 64.0 * f64::EPSILON * (1.0 + to.abs());
    ensure(Triple::from(within).is_finite() && (to - stepper.time()).abs() <= spacing, Kind::NotFinite, || {
        format!("gauss_{stages}: {within:?} between {from} and {to}")
    })?;
    // Of a step that is too long, which is marked, the stages are so large that their sums have no digits left.
    if stepper.suspicion().is_some() {
        return Ok(());
    }
    // Sums of up to 16 terms with weights to 33, of what is largest on the way; and what the motion does in the spacing of the time.
    let places: Vec<_> = (0..=16).map(|i| Triple::from(curve.at(from + (to - from) * f64::from(i) / 16.0))).collect();
    let fastest = (0..=16)
        .map(|i| largest(curve.velocity(from + (to - from) * f64::from(i) / 16.0).iter().copied()))
        .fold(0.0, larger);
    let changes = places.windows(2).map(|p| p[1].minus(p[0]).amax()).fold(0.0, larger) * 16.0;
    let size = places.iter().map(Triple::amax).fold((to - from) * fastest, larger);
    let bound = 1e4 * f64::EPSILON * size + spacing * larger(fastest, changes / (to - from));
    ensure(apart.amax() <= bound, Kind::RoutesDiffer, || {
        format!(
            "gauss_{stages}, {:?}, h = {:.1e}: the curve ends {apart:?} from the state {state:?}, sigma {:e}, bound {bound:.1e}",
            stepper.route(),
            to - from,
            stepper.sigma()
        )
    })
}
