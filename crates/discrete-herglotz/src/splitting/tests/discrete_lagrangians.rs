//! The Strang splittings as discrete Lagrangians.

use super::{ActionStrang, Outcome, SCHEMES, Splitting, Strang, distance, run};
use crate::rules::Composition;
use crate::solve::Solver;
use crate::test_lagrangians::{Curved, InPlane, Inertia, OnLine, Tides};
use crate::{DiscreteLagrangian, InputError, SplittingScheme, StepError, Stepper};
use contact_examples::systems::{Duffing, Pendulum, QuadraticInZ};
use contact_geom::{ChartVector, DiscretePoint, PhasePoint, Scalar, numbers::MaxAbsOrNan};

/// A discrete Lagrangian that implements only the value, with the default steps of the trait.
struct ByValue<D>(D);

impl<D: DiscreteLagrangian<N>, const N: usize> DiscreteLagrangian<N> for ByValue<D> {
    fn step_size(&self) -> f64 {
        self.0.step_size()
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        self.0.value(t, x)
    }
}

/// The explicit steps of a discrete Lagrangian, forward and backward, agree with those derived from its value, and so
/// does `sigma_d`.
fn assert_step_is_of_value<const N: usize>(ld: &impl DiscreteLagrangian<N>, start: PhasePoint<N>) -> Outcome {
    let (mut solver, t) = (Solver::default(), 0.7);
    let bad = InputError::FirstStep;
    let ahead = ld.forward(t, &start, &start.p, &mut solver).map_err(bad)?;
    let derived = ByValue(ld).forward(t, &start, &ahead.velocity, &mut solver).map_err(bad)?;
    let rounding = 32.0 * f64::EPSILON * (1.0 + ChartVector::from(ahead.end).max_abs_or_nan()) / ld.step_size();
    assert!(distance(ahead.end, derived.end) < rounding, "{ahead:?}, {derived:?}");
    assert!((ahead.velocity - derived.velocity).max_abs_or_nan() < rounding);
    assert!((ahead.sigma / derived.sigma - 1.0).abs() <= 2.0 * f64::EPSILON, "{} {}", ahead.sigma, derived.sigma);
    let back = ld.backward(t, &ahead.end, &ahead.velocity, &mut solver).map_err(bad)?;
    let derived = ByValue(ld).backward(t, &ahead.end, &ahead.velocity, &mut solver).map_err(bad)?;
    assert!(distance(back.end, start) < rounding, "{back:?}");
    assert!(distance(back.end, derived.end) < rounding, "{back:?}, {derived:?}");
    assert!((back.sigma / derived.sigma - 1.0).abs() <= 4.0 * f64::EPSILON);
    Ok(())
}

#[test]
fn strang_is_the_flow_of_its_value() -> Outcome {
    let (one, two) = (PhasePoint::new([1.0], [0.7], 0.4), PhasePoint::new([0.8, -0.5], [0.3, 0.6], 0.2));
    for h in [0.5, 0.1, 0.01] {
        for system in
            [Pendulum { gamma: -0.3 }.into(), Duffing { gamma: 0.0, ..Duffing::forced() }.into(), Tides.into()]
        {
            let system: OnLine = system;
            assert_step_is_of_value(&Strang::new(&system, h, 0.7, &one)?, one)?;
        }
        assert_step_is_of_value(&Strang::new(&InPlane::from(Inertia), h, 0.7, &two)?, two)?;
        for system in [OnLine::from(QuadraticInZ { c: 0.4 }), Curved.into()] {
            assert_step_is_of_value(&ActionStrang::new(&system, h, 0.7, &one)?, one)?;
        }
    }
    Ok(())
}

/// Compositions of the discrete Lagrangian agree with the splittings to round-off.
#[test]
fn compositions_of_strang_are_splittings() -> Outcome {
    let (start, h) = (PhasePoint::new([0.8, -0.5], [0.3, 0.6], 0.2), 0.1);
    let (tides, inertia) = (OnLine::from(Tides), InPlane::from(Inertia));
    for scheme in SCHEMES.iter().filter(|s| !s.is_nystrom()) {
        let mut composed = Composition::new(|h| Strang::new(&inertia, h, 0.0, &start), scheme, h, 0.3, start)?;
        assert_eq!(composed.advance(10), Ok(()));
        let split: PhasePoint<2> = run(Splitting::new(&inertia, scheme, h, 0.3, start)?, 10);
        let apart = distance(composed.state().fixed(), split);
        assert!(apart < 200.0 * f64::EPSILON, "{}: {apart}", scheme.name());
        let rate = (composed.sigma() / (-0.15 * h).exp() - 1.0).abs();
        assert!(rate < 70.0 * f64::EPSILON, "{}: {rate}", scheme.name());
        let start = PhasePoint::new([0.8], [0.3], 0.2);
        let mut composed = Composition::new(|h| Strang::new(&tides, h, 0.0, &start), scheme, h, 0.3, start)?;
        let mut split = Splitting::new(&tides, scheme, h, 0.3, start)?;
        assert_eq!((composed.advance(10), split.advance(10)), (Ok(()), Ok(())));
        let apart = distance(composed.state().fixed::<1>(), split.state().fixed());
        assert!(apart < 200.0 * f64::EPSILON, "{}: {apart}", scheme.name());
        let rate = (composed.sigma() / split.sigma() - 1.0).abs();
        assert!(rate < 70.0 * f64::EPSILON, "{}: {rate}", scheme.name());
    }
    let refused =
        Composition::new(|h| Strang::new(&inertia, h, 0.0, &start), &SplittingScheme::BLANES_MOAN_6, h, 0.0, start);
    assert!(matches!(refused.err(), Some(InputError::Hypothesis { .. })));
    Ok(())
}
