//! The exact flow: motions in one piece and in several, exp_h and its inverse, the jets of the exact discrete
//! Lagrangian.

use super::flows::is_conformal;
use super::problem::Problem;
use super::random_numbers::RandomNumbers;
use super::truth::{NoTruth, truth};
use super::verdict::{Checked, Kind, Verdict, Wrong, ensure, exact as named};
use contact_geom::{ChartVector, legendre, numbers::max_or_nan};
use discrete_herglotz::{
    DiscreteLagrangian,
    theory::{derived_jet, legendre_plus},
};
use exact_lagrangian::{ExactLagrangian, herglotz_flow};

/// The condition above which rounding alone makes a comparison impossible.
const CHAOTIC: f64 = 1e9;

pub fn motion<const N: usize>(problem: &Problem<N>, random: &mut RandomNumbers) -> Checked {
    let Problem { system, t0, start, span, pace } = problem;
    // A shorter span for fast motions, so that they can be computed to the end.
    let span = &(span / pace);
    let motion = match herglotz_flow(system, *t0, start, *span) {
        Ok(motion) => motion,
        Err(error) => return Ok(named(&error)),
    };
    let end = ChartVector::from(motion.end);
    ensure(end.is_finite() && motion.sigma() >= 0.0, Kind::NotFinite, || format!("{motion:?}"))?;
    let truth = match truth(system, *t0, start, *span) {
        Ok(truth) if truth.condition < CHAOTIC => truth,
        Err(NoTruth::Ends(t)) => {
            let what =
                format!("herglotz_flow: in pieces the motion ends at t = {t}, in one go not before {}", t0 + span);
            return Err(Wrong { kind: Kind::BeyondTheEnd, what });
        }
        Ok(_) | Err(_) => return Ok(Verdict::NoReference),
    };
    let at = legendre(system, t0 + span, &motion.end);
    let error = truth.error(&at.q, &at.p, Some(at.z));
    // Some units of round-off for each panel; the pieces have as many in all.
    let bound = truth.rounding(*t0, max_or_nan(100.0, f64::from(motion.panels)) as usize);
    ensure(error <= bound, Kind::RoutesDiffer, || {
        format!(
            "herglotz_flow over {span:.2e}: {error:.1e} from the motion in pieces, condition {:.1e}",
            truth.condition
        )
    })?;
    // Backward, where motions that were damped grow.
    if random.chance(0.2)
        && let Ok(back) = herglotz_flow(system, t0 + span, &motion.end, -span)
    {
        ensure(ChartVector::from(back.end).is_finite(), Kind::NotFinite, || format!("back to {back:?}"))?;
    }
    Ok(Verdict::Right)
}

pub fn between_points<const N: usize>(problem: &Problem<N>, random: &mut RandomNumbers) -> Checked {
    let Problem { system, t0, start, pace, .. } = problem;
    let h = random.scale(1e-3, 1.0) / pace;
    let ld = match ExactLagrangian::<_, N>::new(system.clone(), h) {
        Ok(ld) => ld,
        Err(error) => return Ok(super::verdict::refused(&error)),
    };
    let x = match ld.exponential().at(*t0, start) {
        Ok(x) => x,
        Err(error) => return Ok(named(&error)),
    };
    ensure(x.check().is_ok(), Kind::NotFinite, || format!("{x:?}"))?;
    let found = match ld.retract(*t0, &x) {
        Ok(found) => found,
        Err(error) => return Ok(named(&error)),
    };
    // The motion may differ from the one drawn, but passes through both points.
    let again = match ld.exponential().at(*t0, &found.start) {
        Ok(again) => again,
        Err(error) => {
            let what = format!("the motion found between {x:?} has no end: {error}");
            return Err(Wrong { kind: Kind::RoutesDiffer, what });
        }
    };
    let missed = (again.q1 - x.q1).amax();
    let size = max_or_nan(x.q0.amax(), x.q1.amax()) + h * found.start.v.amax();
    // Far from t = 0 a force in time has the error of the rounding of the time, in units of its period.
    ensure(missed <= (1e-11 + 1e2 * f64::EPSILON * t0.abs()) * size, Kind::Residual, || {
        format!("h = {h:.1e}: the motion found misses by {missed:.1e}")
    })?;
    let (jet, plus) = match (ld.jet(*t0, &x), legendre_plus(&ld, *t0, &x)) {
        (Ok(jet), Ok(plus)) => (jet, plus),
        _ => return Ok(Verdict::NoReference),
    };
    let finite = [jet.value, jet.dz, jet.sigma()].into_iter().chain(jet.d1.iter().chain(&jet.d2).copied());
    ensure(finite.into_iter().all(f64::is_finite) && plus.check().is_ok(), Kind::NotFinite, || format!("{jet:?}"))?;
    if random.chance(0.2)
        && let Ok(derived) = derived_jet(&ld, *t0, &x)
    {
        let apart = max_or_nan((derived.d1 - jet.d1).amax(), (derived.d2 - jet.d2).amax());
        let size = max_or_nan(jet.d1.amax(), jet.d2.amax());
        // Positions determine the velocity between them up to eps/h.
        ensure(apart <= 1e-9 / h * size, Kind::RoutesDiffer, || {
            format!("h = {h:.1e}: the jet {jet:?}, by automatic differentiation {derived:?}")
        })?;
    }
    if random.chance(0.2) {
        let from = legendre(system, *t0, start);
        is_conformal(&ld, *t0, &from, &start.v)?;
    }
    Ok(Verdict::Right)
}
