//! The steps of a splitting: conformal factors, round-off, and the bits of their results.

use super::{ActionSplitting, Outcome, SCHEMES, Splitting, Strang, run};
use crate::rules::{Composition, Flow, Rule};
use crate::test_lagrangians::{Curved, Fall, Free, InPlane, Inertia, OnLine, Quartic, Tides};
use crate::{InputError, SplittingScheme, State, StepError, StepFailure, Stepper};
use contact_examples::systems::{Duffing, LaneEmden};
use contact_geom::{Lagrangian, PhasePoint};

/// `sigma_d = e^(gamma h)`, and the number of evaluations is that of the stages.
#[test]
fn steps_are_what_they_say() -> Outcome {
    let (forced, start, h) = (Duffing::forced(), PhasePoint::new([1.0], [1.0], 0.2), 0.1);
    let system = OnLine::from(forced);
    for scheme in &SCHEMES {
        let mut motion = Splitting::new(&system, scheme, h, 0.5, start)?;
        assert_eq!((motion.sigma(), motion.evaluations(), motion.state()), (1.0, 1, start.into()));
        assert_eq!(motion.advance(10), Ok(()));
        assert_eq!(motion.sigma(), (forced.gamma * h).exp());
        assert_eq!(motion.evaluations(), 1 + 10 * scheme.stages() as u64);
        assert!((motion.time() - 1.5).abs() < 4.0 * f64::EPSILON);
    }
    Ok(())
}

/// The state after 700 steps (three chunks of a run) and `sigma_d` are bitwise the same whether the steps are taken at
/// once, one by one or in unequal parts, with the states read in between.
fn assert_same_bits<S: Stepper>(name: &str, start: impl Fn() -> Result<S, InputError>) -> Result<State, InputError> {
    let steps = 700;
    let in_parts = |part: usize| {
        let (mut motion, mut left) = (start()?, steps);
        while left > 0 {
            let part = part.min(left);
            assert_eq!(motion.advance(part), Ok(()), "{name}");
            assert!(motion.state().is_finite(), "{name}");
            left -= part;
        }
        Ok::<_, InputError>((motion.state(), motion.sigma(), motion.evaluations()))
    };
    let at_once = in_parts(steps)?;
    for part in [1, 7, 256, 300] {
        assert_eq!(in_parts(part)?, at_once, "{name}, {part} steps at a time");
    }
    Ok(at_once.0)
}

/// The results do not depend on what is observed, nor on whether the action is computed.
#[test]
fn what_is_observed_changes_no_bit() -> Outcome {
    fn linear<L: Lagrangian<N>, const N: usize>(name: &str, l: &L, h: f64, start: PhasePoint<N>) -> Outcome {
        for scheme in &SCHEMES {
            let plain = || Splitting::new(l, scheme, h, 0.5, start);
            let with = assert_same_bits(&format!("{name} by {}", scheme.name()), plain)?;
            let without = assert_same_bits(&format!("{name} without z"), || Ok(plain()?.without_action()))?;
            assert_eq!(without, State { z: start.z, ..with }, "{name} by {}", scheme.name());
            let with = assert_same_bits(&format!("{name} compensated"), || Ok(plain()?.compensated()))?;
            let without = assert_same_bits(&format!("{name} both"), || Ok(plain()?.compensated().without_action()))?;
            assert_eq!(without, State { z: start.z, ..with }, "{name} by {}", scheme.name());
        }
        Ok(())
    }
    let [forced, tides, curved] = [OnLine::from(Duffing::forced()), Tides.into(), Curved.into()];
    linear("forced", &forced, 0.05, PhasePoint::new([1.0], [1.0], 0.2))?;
    linear("tides", &tides, 0.05, PhasePoint::new([1.0], [1.0], 0.2))?;
    linear("inertia", &InPlane::from(Inertia), 0.05, PhasePoint::new([0.8, -0.5], [0.3, 0.6], 0.2))?;
    let start = PhasePoint::new([1.0], [1.0], 0.5);
    for scheme in SCHEMES.iter().filter(|s| !s.is_nystrom()) {
        let motion = || ActionSplitting::new(&curved, scheme, 0.05, 0.5, start);
        assert_same_bits(scheme.name(), motion)?;
        assert_same_bits(scheme.name(), || Ok(motion()?.compensated()))?;
    }
    let kahan_li = &SplittingScheme::KAHAN_LI_6;
    assert_same_bits("composition", || {
        Composition::new(|h| Rule::MIDPOINT.of(&curved, h), kahan_li, 0.05, 0.5, start)
    })?;
    let midpoint = Rule::MIDPOINT.of(&curved, 0.05)?;
    assert_same_bits("midpoint", || Flow::new(&midpoint, 0.5, start))?;
    let strang = Strang::new(&tides, 0.05, 0.5, &start)?;
    assert_same_bits("strang", || Flow::new(&strang, 0.5, start))?;
    Ok(())
}

/// The conformal factor of a time-dependent drag is the exponential of its integral over each step; for the rate `-2/t`
/// of Lane and Emden it is `(t/(t + h))^2`. The relative error of the quadrature is of the order of `(h/t)^13`.
#[test]
fn the_rate_of_a_drag_in_time_is_its_integral() -> Outcome {
    let ([system, tides], h, t0) = ([OnLine::from(LaneEmden::default()), Tides.into()], 0.05, 1.0);
    let start = PhasePoint::new([0.8], [-0.2], 0.1);
    for scheme in &SCHEMES {
        let mut motion = Splitting::new(&system, scheme, h, t0, start)?;
        let mut without_force = Splitting::new(&tides, scheme, h, t0, PhasePoint::new([0.0], [0.0], 1.0))?;
        let (mut factor, mut product) = (1.0, 1.0);
        for k in 0..20 {
            assert_eq!((motion.advance(1), without_force.advance(1)), (Ok(()), Ok(())));
            let t = t0 + h * f64::from(k);
            let exact = (t / (t + h)).powi(2);
            assert!((motion.sigma() / exact - 1.0).abs() <= 1e-14, "{} {t}: {}", scheme.name(), motion.sigma());
            factor *= motion.sigma();
            product *= without_force.sigma();
        }
        assert!((factor * 4.0 - 1.0).abs() <= 1e-13, "{}: {factor}", scheme.name());
        let integral = 0.2 * (20.0 * h) + 0.3 * (t0.cos() - (t0 + 20.0 * h).cos());
        assert!((product / (-integral).exp() - 1.0).abs() <= 1e-14, "{}: {product}", scheme.name());
    }
    Ok(())
}

/// `sigma_d` of a nonlinear drag is the product of the factors of its steps, here the ratio of the momenta of a free
/// motion.
#[test]
fn the_rate_of_a_nonlinear_drag_is_the_product_of_its_factors() -> Outcome {
    let free = OnLine::from(Free);
    for scheme in SCHEMES.iter().filter(|s| !s.is_nystrom()) {
        let mut motion = ActionSplitting::new(&free, scheme, 0.2, 0.0, PhasePoint::new([0.0], [1.0], 0.5))?;
        let mut product = 1.0;
        for _ in 0..5 {
            assert_eq!(motion.advance(1), Ok(()));
            product *= motion.sigma();
        }
        let p = motion.state().p[0];
        assert!((p - product).abs() < 100.0 * f64::EPSILON, "{}: {p}, {product}", scheme.name());
    }
    Ok(())
}

/// In a uniform field without drag a step is exact up to round-off; with compensated summation so are a hundred
/// thousand steps.
#[test]
fn compensated_sums_keep_the_floor() -> Outcome {
    let fall = OnLine::from(Fall);
    let (steps, h) = (100_000, 0.1);
    let t = steps as f64 * h;
    let exact = 1.0 + t * (0.5 + 0.15 * t);
    let plain = || Splitting::new(&fall, &SplittingScheme::STRANG, h, 0.0, PhasePoint::new([1.0], [0.5], 0.3));
    let error = |motion| (run::<1>(motion, steps).q[0] / exact - 1.0).abs();
    let (compensated, plain) = (error(plain()?.compensated()), error(plain()?));
    assert!(compensated < 8.0 * f64::EPSILON, "{compensated:e}");
    assert!(plain > 30.0 * f64::EPSILON, "{plain:e}");
    Ok(())
}

/// An unbounded motion stops at its last finite state, also within a chunk of steps, and stays there.
#[test]
fn a_run_away_halts_at_its_last_finite_state() -> Outcome {
    let quartic = OnLine::from(Quartic);
    let mut motion =
        Splitting::new(&quartic, &SplittingScheme::KAHAN_LI_6, 0.001, 0.0, PhasePoint::new([1.0], [0.0], 0.0))?;
    let cause = StepError::NonFinite;
    let failure = motion.advance(5000);
    let taken = failure.err().map_or(0, |failure| failure.taken);
    assert_eq!(failure, Err(StepFailure { taken, cause }));
    assert!(taken > 900 && motion.state().is_finite(), "{taken}");
    let before = motion.state();
    assert_eq!(motion.advance(1), Err(StepFailure { taken: 0, cause }));
    assert_eq!((motion.state(), motion.evaluations()), (before, 1 + 9 * taken as u64));
    Ok(())
}
