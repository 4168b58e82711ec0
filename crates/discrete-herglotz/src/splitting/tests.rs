//! Tests of splittings against an independent reference and against the theory.

use super::{ActionFlow, ActionMap, ActionSplitting, ActionStrang, Riccati, Splitting, Strang};
use crate::SplittingScheme;
use crate::{
    DiscreteLagrangian, InputError, StepError, StepFailure, Stepper,
    rules::{Composition, Flow, Midpoint},
    solve::Solver,
};
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{DoublePendulum, Duffing, Kepler, LaneEmden, Pendulum, QuadraticInZ};
use contact_geom::{ChartVector, DiscretePoint, Lagrangian, PhasePoint, Scalar, Structure, numbers::MaxAbsOrNan};

/// The time after which errors are measured.
const DURATION: f64 = 4.0;

type Outcome = Result<(), InputError>;

/// Two different masses with coupled inertia in a time-dependent quartic potential.
struct Inertia;

impl Lagrangian<2> for Inertia {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let kinetic = v[0] * v[0] + v[0] * v[1] * 0.6 + v[1] * v[1] * 1.5;
        let (a, b) = (q[0] - q[1] * 0.3, q[1] - t.sin() * 0.2);
        kinetic - a.powi(4) * 0.5 - b * b * 0.7 - q[0] * q[1] * 0.2 - z * 0.15
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_rate: true, constant_mass: true, ..Structure::default() }
    }
}

/// A pendulum with a drag of degree two in z, and a constant term in L.
struct Curved;

impl Lagrangian<1> for Curved {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.75 + q[0].cos() * (t.cos() * 0.2 + 0.8) + 0.4 - z * 0.2 - z * z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// A pendulum with a time-dependent drag.
struct Tides;

impl Lagrangian<1> for Tides {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].cos() * 2.0 - z * (t.sin() * 0.3 + 0.2)
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
    }
}

fn distance<const N: usize>(a: PhasePoint<N>, b: PhasePoint<N>) -> f64 {
    ChartVector::from(a).minus(ChartVector::from(b)).max_abs_or_nan()
}

/// The state after this number of steps.
fn run<const N: usize>(mut motion: impl Stepper<N>, steps: usize) -> PhasePoint<N> {
    assert_eq!(motion.advance(steps), Ok(()));
    motion.state()
}

/// The state after [`DURATION`] from a method that is independent of the splittings: a composition of order 10 of the
/// midpoint rule.
fn by_midpoint<const N: usize>(l: &impl Lagrangian<N>, start: PhasePoint<N>) -> Result<PhasePoint<N>, InputError> {
    let (steps, scheme) = (400, SplittingScheme::SOFRONIOU_SPALETTA_10);
    Ok(run(Composition::new(|h| Midpoint::new(l, h), &scheme, DURATION / steps as f64, 0.0, start)?, steps))
}

/// Asserts that the observed order of each scheme agrees with its order to 0.15: the slope of the error over the last
/// four of a sequence of finer resolutions above round-off. The reference is a run with small steps, which agrees with
/// another method.
fn assert_orders<const N: usize, S: Stepper<N>>(
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

static SCHEMES: [SplittingScheme; 15] = SplittingScheme::ALL;

#[test]
fn linear_drag_has_the_schemes_order() -> Outcome {
    let (pendulum, forced) = (Pendulum { gamma: -0.1 }, Duffing::forced());
    let (one, two) = (PhasePoint::new([1.0], [1.0], 0.2), PhasePoint::new([0.8, -0.5], [0.3, 0.6], 0.2));
    assert_orders("pendulum", gentle(), by_midpoint(&pendulum, one)?, |scheme, h| {
        Ok(Splitting::new(&pendulum, scheme, h, 0.0, one)?.compensated())
    })?;
    assert_orders("forced", gentle(), by_midpoint(&forced, one)?, |scheme, h| {
        Ok(Splitting::new(&forced, scheme, h, 0.0, one)?.compensated())
    })?;
    assert_orders("tides", gentle(), by_midpoint(&Tides, one)?, |scheme, h| {
        Ok(Splitting::new(&Tides, scheme, h, 0.0, one)?.compensated())
    })?;
    assert_orders("inertia", gentle(), by_midpoint(&Inertia, two)?, |scheme, h| {
        Ok(Splitting::new(&Inertia, scheme, h, 0.0, two)?.compensated())
    })
}

#[test]
fn all_orders_show_on_half_a_kepler_orbit() -> Outcome {
    let (kepler, start) = (Kepler::<2> { mu: 1.0, gamma: -0.1 }, PhasePoint::new([0.7, 0.0], [0.0, 1.3], 0.1));
    let high = SCHEMES.iter().filter(|s| s.order() >= 8);
    assert_orders("kepler", high, by_midpoint(&kepler, start)?, |scheme, h| {
        Ok(Splitting::new(&kepler, scheme, h, 0.0, start)?.compensated())
    })
}

#[test]
fn nonlinear_drag_has_the_schemes_order() -> Outcome {
    let compositions = || gentle().filter(|s| !s.is_nystrom());
    let (quadratic, start) = (QuadraticInZ { c: 0.4 }, PhasePoint::new([1.0], [1.0], 0.5));
    assert_orders("quadratic", compositions(), by_midpoint(&quadratic, start)?, |scheme, h| {
        Ok(ActionSplitting::new(&quadratic, scheme, h, 0.0, start)?.compensated())
    })?;
    assert_orders("curved", compositions(), by_midpoint(&Curved, start)?, |scheme, h| {
        Ok(ActionSplitting::new(&Curved, scheme, h, 0.0, start)?.compensated())
    })
}

/// `sigma_d = e^(gamma h)`, and the number of evaluations is that of the stages.
#[test]
fn steps_are_what_they_say() -> Outcome {
    let (forced, start, h) = (Duffing::forced(), PhasePoint::new([1.0], [1.0], 0.2), 0.1);
    for scheme in &SCHEMES {
        let mut motion = Splitting::new(&forced, scheme, h, 0.5, start)?;
        assert_eq!((motion.sigma(), motion.evaluations(), motion.state()), (1.0, 1, start));
        assert_eq!(motion.advance(10), Ok(()));
        assert_eq!(motion.sigma(), (forced.gamma * h).exp());
        assert_eq!(motion.evaluations(), 1 + 10 * scheme.stages() as u64);
        assert!((motion.time() - 1.5).abs() < 4.0 * f64::EPSILON);
    }
    Ok(())
}

/// The state after 700 steps (three chunks of a run) and `sigma_d` are bitwise the same whether the steps are taken at
/// once, one by one or in unequal parts, with the states read in between.
fn assert_same_bits<const N: usize, S: Stepper<N>>(
    name: &str,
    start: impl Fn() -> Result<S, InputError>,
) -> Result<PhasePoint<N>, InputError> {
    let steps = 700;
    let in_parts = |part: usize| {
        let (mut motion, mut left) = (start()?, steps);
        while left > 0 {
            let part = part.min(left);
            assert_eq!(motion.advance(part), Ok(()), "{name}");
            assert!(ChartVector::from(motion.state()).is_finite(), "{name}");
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
            assert_eq!(without, PhasePoint { z: start.z, ..with }, "{name} by {}", scheme.name());
            let with = assert_same_bits(&format!("{name} compensated"), || Ok(plain()?.compensated()))?;
            let without = assert_same_bits(&format!("{name} both"), || Ok(plain()?.compensated().without_action()))?;
            assert_eq!(without, PhasePoint { z: start.z, ..with }, "{name} by {}", scheme.name());
        }
        Ok(())
    }
    linear("forced", &Duffing::forced(), 0.05, PhasePoint::new([1.0], [1.0], 0.2))?;
    linear("tides", &Tides, 0.05, PhasePoint::new([1.0], [1.0], 0.2))?;
    linear("inertia", &Inertia, 0.05, PhasePoint::new([0.8, -0.5], [0.3, 0.6], 0.2))?;
    let start = PhasePoint::new([1.0], [1.0], 0.5);
    for scheme in SCHEMES.iter().filter(|s| !s.is_nystrom()) {
        let motion = || ActionSplitting::new(&Curved, scheme, 0.05, 0.5, start);
        assert_same_bits(scheme.name(), motion)?;
        assert_same_bits(scheme.name(), || Ok(motion()?.compensated()))?;
    }
    let kahan_li = &SplittingScheme::KAHAN_LI_6;
    assert_same_bits("composition", || Composition::new(|h| Midpoint::new(&Curved, h), kahan_li, 0.05, 0.5, start))?;
    let midpoint = Midpoint::new(&Curved, 0.05)?;
    assert_same_bits("midpoint", || Flow::new(&midpoint, 0.5, start))?;
    let strang = Strang::new(&Tides, 0.05, 0.5, &start)?;
    assert_same_bits("strang", || Flow::new(&strang, 0.5, start))?;
    Ok(())
}

/// The conformal factor of a time-dependent drag is the exponential of its integral over each step; for the rate `-2/t`
/// of Lane and Emden it is `(t/(t + h))^2`. The relative error of the quadrature is of the order of `(h/t)^13`.
#[test]
fn the_rate_of_a_drag_in_time_is_its_integral() -> Outcome {
    let (system, h, t0) = (LaneEmden::default(), 0.05, 1.0);
    let start = PhasePoint::new([0.8], [-0.2], 0.1);
    for scheme in &SCHEMES {
        let mut motion = Splitting::new(&system, scheme, h, t0, start)?;
        let mut without_force = Splitting::new(&Tides, scheme, h, t0, PhasePoint::new([0.0], [0.0], 1.0))?;
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
    // Without forces the momentum changes only by the conformal factor.
    struct Free;
    impl Lagrangian<1> for Free {
        fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            v[0] * v[0] * 0.5 - z * 0.3 + z * z * 0.2
        }
        fn structure(&self) -> Structure {
            Structure { autonomous: true, separable: true, constant_mass: true, ..Structure::default() }
        }
    }
    for scheme in SCHEMES.iter().filter(|s| !s.is_nystrom()) {
        let mut motion = ActionSplitting::new(&Free, scheme, 0.2, 0.0, PhasePoint::new([0.0], [1.0], 0.5))?;
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
    #[derive(Clone)]
    struct Fall;
    impl Lagrangian<1> for Fall {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
            v[0] * v[0] * 0.5 + q[0] * 0.3
        }
        fn structure(&self) -> Structure {
            Structure { autonomous: true, separable: true, z_free: true, z_affine: true, ..Structure::default() }
        }
    }
    let (steps, h) = (100_000, 0.1);
    let t = steps as f64 * h;
    let exact = 1.0 + t * (0.5 + 0.15 * t);
    let plain = Splitting::new(&Fall, &SplittingScheme::STRANG, h, 0.0, PhasePoint::new([1.0], [0.5], 0.3))?;
    let error = |motion| (run::<1>(motion, steps).q[0] / exact - 1.0).abs();
    let (compensated, plain) = (error(plain.clone().compensated()), error(plain));
    assert!(compensated < 8.0 * f64::EPSILON, "{compensated:e}");
    assert!(plain > 30.0 * f64::EPSILON, "{plain:e}");
    Ok(())
}

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
        assert_step_is_of_value(&Strang::new(Pendulum { gamma: -0.3 }, h, 0.7, &one)?, one)?;
        assert_step_is_of_value(&Strang::new(Duffing { gamma: 0.0, ..Duffing::forced() }, h, 0.7, &one)?, one)?;
        assert_step_is_of_value(&Strang::new(&Inertia, h, 0.7, &two)?, two)?;
        assert_step_is_of_value(&Strang::new(&Tides, h, 0.7, &one)?, one)?;
        assert_step_is_of_value(&ActionStrang::new(QuadraticInZ { c: 0.4 }, h, 0.7, &one)?, one)?;
        assert_step_is_of_value(&ActionStrang::new(&Curved, h, 0.7, &one)?, one)?;
    }
    Ok(())
}

/// Compositions of the discrete Lagrangian agree with the splittings to round-off.
#[test]
fn compositions_of_strang_are_splittings() -> Outcome {
    let (start, h) = (PhasePoint::new([0.8, -0.5], [0.3, 0.6], 0.2), 0.1);
    for scheme in SCHEMES.iter().filter(|s| !s.is_nystrom()) {
        let mut composed = Composition::new(|h| Strang::new(&Inertia, h, 0.0, &start), scheme, h, 0.3, start)?;
        assert_eq!(composed.advance(10), Ok(()));
        let split = run(Splitting::new(&Inertia, scheme, h, 0.3, start)?, 10);
        let apart = distance(composed.state(), split);
        assert!(apart < 200.0 * f64::EPSILON, "{}: {apart}", scheme.name());
        let rate = (composed.sigma() / (-0.15 * h).exp() - 1.0).abs();
        assert!(rate < 70.0 * f64::EPSILON, "{}: {rate}", scheme.name());
        let start = PhasePoint::new([0.8], [0.3], 0.2);
        let mut composed = Composition::new(|h| Strang::new(&Tides, h, 0.0, &start), scheme, h, 0.3, start)?;
        let mut split = Splitting::new(&Tides, scheme, h, 0.3, start)?;
        assert_eq!((composed.advance(10), split.advance(10)), (Ok(()), Ok(())));
        let apart = distance(composed.state(), split.state());
        assert!(apart < 200.0 * f64::EPSILON, "{}: {apart}", scheme.name());
        let rate = (composed.sigma() / split.sigma() - 1.0).abs();
        assert!(rate < 70.0 * f64::EPSILON, "{}: {rate}", scheme.name());
    }
    let refused =
        Composition::new(|h| Strang::new(&Inertia, h, 0.0, &start), &SplittingScheme::BLANES_MOAN_6, h, 0.0, start);
    assert!(matches!(refused.err(), Some(InputError::Hypothesis { .. })));
    Ok(())
}

/// The closed form of the Riccati flow is a one-parameter group with the stated rate, and NaN after the blow-up.
#[test]
fn the_riccati_flow_is_a_flow() {
    for (b, c) in [(0.0, 0.3), (-0.4, 0.3), (2.0, -1.0), (1e-9, 1.0), (0.5, 0.0)] {
        let flow = Riccati { b, c };
        for z in [-0.7, 1e-12, 0.4] {
            let twice = flow.over(0.3).apply(flow.over(0.2).apply(z));
            assert!((flow.over(0.5).apply(z) - twice).abs() <= 8.0 * f64::EPSILON * twice.abs(), "{b} {c} {z}");
            assert!(super::action_flow::is_flow_of_its_rate(&flow, z), "{b} {c} {z}");
        }
    }
    assert!(Riccati { b: 0.0, c: 1.0 }.over(2.0).apply(1.0_f64).is_nan());
}

/// An action flow that may differ from that of L, and whose maps may differ from the flow of its rate.
#[derive(Clone, Copy, Debug)]
struct Wrong {
    rate: f64,
    map: f64,
}

impl ActionFlow for Wrong {
    type Map = super::RiccatiMap;
    fn rate<T: Scalar>(&self, z: T) -> T {
        z * z * self.rate
    }
    fn over(&self, s: f64) -> super::RiccatiMap {
        Riccati { b: 0.0, c: self.map }.over(s)
    }
}

/// Euler's step in place of the flow, which is accurate for small times only.
struct Euler;

#[derive(Clone, Copy, Debug)]
struct EulerMap(f64);

impl ActionFlow for Euler {
    type Map = EulerMap;
    fn rate<T: Scalar>(&self, z: T) -> T {
        z * z * -0.2
    }
    fn over(&self, s: f64) -> EulerMap {
        EulerMap(s)
    }
}

impl ActionMap for EulerMap {
    fn apply<T: Scalar>(&self, z: T) -> T {
        z + Euler.rate(z) * self.0
    }
}

/// Each violated hypothesis yields the error that names it.
#[test]
fn what_does_not_fit_is_refused() {
    let (start, scheme) = (PhasePoint::new([1.0], [1.0], 0.2), &SplittingScheme::STRANG);
    struct Rate(Structure);
    impl Lagrangian<1> for Rate {
        fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 - z * t.sin() * 0.1
        }
        fn structure(&self) -> Structure {
            self.0
        }
    }
    struct Magnetic;
    impl Lagrangian<1> for Magnetic {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
            v[0] * v[0] * 0.5 + v[0] - q[0] * q[0] * 0.5
        }
        fn structure(&self) -> Structure {
            Structure { z_free: true, ..affine() }
        }
    }
    fn affine() -> Structure {
        Structure { separable: true, z_affine: true, ..Structure::default() }
    }
    let linear = |l: &Rate, h: f64| Splitting::new(l, scheme, h, 0.0, start).err();
    assert_eq!(linear(&Rate(affine()), 0.1), None);
    let steady = Structure { constant_rate: true, ..affine() };
    assert!(matches!(linear(&Rate(steady), 0.1), Some(InputError::FalseClaim { claim: "constant_rate", .. })));
    let nonlinear = Structure { z_affine: false, ..affine() };
    let in_time = ActionSplitting::new(&Rate(nonlinear), scheme, 0.1, 0.0, start).err();
    assert!(matches!(in_time, Some(InputError::Hypothesis { .. })));
    assert_eq!(linear(&Rate(affine()), 0.0), Some(InputError::Step { h: 0.0 }));
    assert_eq!(linear(&Rate(Structure::default()), 0.1), Some(InputError::Unclaimed { claim: "separable" }));
    let lie = Structure { autonomous: true, ..affine() };
    assert!(matches!(linear(&Rate(lie), 0.1), Some(InputError::FalseClaim { claim: "autonomous", .. })));
    let magnetic = Splitting::new(&Magnetic, scheme, 0.1, 0.0, start).err();
    assert!(matches!(magnetic, Some(InputError::FalseClaim { claim: "separable", .. })), "{magnetic:?}");
    let double = PhasePoint::new([1.0, 0.5], [0.0, 0.0], 0.0);
    let coupled = Splitting::new(&DoublePendulum::default(), scheme, 0.1, 0.0, double).err();
    assert_eq!(coupled, Some(InputError::Unclaimed { claim: "separable" }));
    let curved = Splitting::new(&Curved, scheme, 0.1, 0.0, start).err();
    assert_eq!(curved, Some(InputError::Unclaimed { claim: "z_affine" }));
    let nystrom = ActionSplitting::new(&Curved, &SplittingScheme::BLANES_MOAN_6, 0.1, 0.0, start).err();
    assert!(matches!(nystrom, Some(InputError::Hypothesis { .. })));
    let quadratic = QuadraticInZ { c: 0.4 };
    let with = |rate, map| ActionSplitting::with_flow(&quadratic, &Wrong { rate, map }, scheme, 0.1, 0.0, start).err();
    assert_eq!(with(-0.2, -0.2), None);
    assert!(matches!(with(-0.3, -0.3), Some(InputError::Hypothesis { .. })));
    assert!(matches!(with(-0.2, -0.3), Some(InputError::Hypothesis { .. })));
    let euler = ActionSplitting::with_flow(&quadratic, &Euler, scheme, 0.1, 0.0, start).err();
    assert!(matches!(euler, Some(InputError::Hypothesis { .. })));
}

/// An unbounded motion halts at its last finite state, also within a chunk of steps, and stays there.
#[test]
fn a_run_away_halts_at_its_last_finite_state() -> Outcome {
    struct Hill;
    impl Lagrangian<1> for Hill {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            v[0] * v[0] * 0.5 + q[0].powi(4) - z * 0.1
        }
        fn structure(&self) -> Structure {
            Structure { autonomous: true, separable: true, z_affine: true, ..Structure::default() }
        }
    }
    let mut motion =
        Splitting::new(&Hill, &SplittingScheme::KAHAN_LI_6, 0.001, 0.0, PhasePoint::new([1.0], [0.0], 0.0))?;
    let cause = StepError::NonFinite;
    let halt = motion.advance(5000);
    let taken = halt.err().map_or(0, |halt| halt.taken);
    assert_eq!(halt, Err(StepFailure { taken, cause }));
    assert!(taken > 900 && ChartVector::from(motion.state()).is_finite(), "{taken}");
    let before = motion.state();
    assert_eq!(motion.advance(1), Err(StepFailure { taken: 0, cause }));
    assert_eq!((motion.state(), motion.evaluations()), (before, 1 + 9 * taken as u64));
    Ok(())
}
