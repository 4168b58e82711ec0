//! The observed orders of the schemes.

use super::{ActionSplitting, Outcome, SCHEMES, Splitting, distance, run};
use crate::rules::{Composition, Rule};
use crate::test_lagrangians::{Curved, InPlane, Inertia, OnLine, Tides};
use crate::{InputError, SplittingScheme, Stepper};
use contact_examples::systems::{Duffing, Kepler, Pendulum, QuadraticInZ};
use contact_geom::{Lagrangian, PhasePoint};

/// The time after which errors are measured.
const DURATION: f64 = 4.0;

/// The state after [`DURATION`] from a method that is independent of the splittings: a composition of order 10 of the
/// midpoint rule.
fn by_midpoint<const N: usize>(l: &impl Lagrangian<N>, start: PhasePoint<N>) -> Result<PhasePoint<N>, InputError> {
    let (steps, scheme) = (400, SplittingScheme::SOFRONIOU_SPALETTA_10);
    Ok(run(Composition::new(|h| Rule::MIDPOINT.of(l, h), &scheme, DURATION / steps as f64, 0.0, start)?, steps))
}

/// Asserts that the observed order of each scheme agrees with its order to 0.15: the slope of the error over the last
/// four of a sequence of finer resolutions above round-off. The reference is a run with small steps, which agrees with
/// another method.
fn assert_orders<const N: usize, S: Stepper>(
    name: &str,
    schemes: impl Iterator<Item = &'static SplittingScheme>,
    other_code: PhasePoint<N>,
    motion: impl Fn(&SplittingScheme, f64) -> Result<S, InputError>,
) -> Outcome {
    let exact = run(motion(&SplittingScheme::SOFRONIOU_SPALETTA_10, DURATION / 400.0)?, 400);
    assert!(distance(exact, other_code) < 2e-12, "{name}: {exact:?}, {other_code:?}");
    for scheme in schemes {
        let mut points: Vec<(f64, f64)> = Vec::new();
        let mut n = 8;
        while n < 300 {
            let error = distance(run(motion(scheme, DURATION / n as f64)?, n), exact);
            if error < 2e-13 {
                break;
            }
            points.push(((n as f64).ln(), error.ln()));
            n += 1 + n / 6;
        }
        assert!(points.len() >= 4, "{name} {}: {points:?}", scheme.name());
        let (first, last) = (points[points.len() - 4], points[points.len() - 1]);
        let slope = (first.1 - last.1) / (last.0 - first.0);
        let order = f64::from(scheme.order());
        assert!((slope - order).abs() < 0.15, "{name} {}: {slope}, {points:?}", scheme.name());
    }
    Ok(())
}

/// The schemes whose leading error is above round-off for a smooth motion; order 10 needs a less smooth one.
fn gentle() -> impl Iterator<Item = &'static SplittingScheme> {
    SCHEMES.iter().filter(|s| s.order() < 10)
}

#[test]
fn linear_drag_has_the_schemes_order() -> Outcome {
    let [pendulum, forced] = [OnLine::from(Pendulum { gamma: -0.1 }), Duffing::forced().into()];
    let (tides, inertia) = (OnLine::from(Tides), InPlane::from(Inertia));
    let (one, two) = (PhasePoint::new([1.0], [1.0], 0.2), PhasePoint::new([0.8, -0.5], [0.3, 0.6], 0.2));
    assert_orders("pendulum", gentle(), by_midpoint(&pendulum, one)?, |scheme, h| {
        Ok(Splitting::new(&pendulum, scheme, h, 0.0, one)?.compensated())
    })?;
    assert_orders("forced", gentle(), by_midpoint(&forced, one)?, |scheme, h| {
        Ok(Splitting::new(&forced, scheme, h, 0.0, one)?.compensated())
    })?;
    assert_orders("tides", gentle(), by_midpoint(&tides, one)?, |scheme, h| {
        Ok(Splitting::new(&tides, scheme, h, 0.0, one)?.compensated())
    })?;
    assert_orders("inertia", gentle(), by_midpoint(&inertia, two)?, |scheme, h| {
        Ok(Splitting::new(&inertia, scheme, h, 0.0, two)?.compensated())
    })
}

#[test]
fn all_orders_show_on_half_a_kepler_orbit() -> Outcome {
    let kepler = InPlane::from(Kepler { mu: 1.0, gamma: -0.1 });
    let start = PhasePoint::new([0.7, 0.0], [0.0, 1.3], 0.1);
    let high = SCHEMES.iter().filter(|s| s.order() >= 8);
    assert_orders("kepler", high, by_midpoint(&kepler, start)?, |scheme, h| {
        Ok(Splitting::new(&kepler, scheme, h, 0.0, start)?.compensated())
    })
}

#[test]
fn nonlinear_drag_has_the_schemes_order() -> Outcome {
    let compositions = || gentle().filter(|s| !s.is_nystrom());
    let [quadratic, curved] = [OnLine::from(QuadraticInZ { c: 0.4 }), Curved.into()];
    let start = PhasePoint::new([1.0], [1.0], 0.5);
    assert_orders("quadratic", compositions(), by_midpoint(&quadratic, start)?, |scheme, h| {
        Ok(ActionSplitting::new(&quadratic, scheme, h, 0.0, start)?.compensated())
    })?;
    assert_orders("curved", compositions(), by_midpoint(&curved, start)?, |scheme, h| {
        Ok(ActionSplitting::new(&curved, scheme, h, 0.0, start)?.compensated())
    })
}
