//! Contact Gauss collocation through its fast stepper: orders, agreement with Newton's steps and of the routes with
//! each other, the conformal factor, round-off in long runs, and steps for which the iteration does not contract.

use crate::common::gauss::GaussSteppers;
use crate::common::lagrangians::WithStructure;
use crate::common::{relative_distance, slope};
use crate::lagrangians::{One, Two, one};
use contact_examples::systems::{
    CoupledInZ, CoupledPlane, DoublePendulum, HarmonicOscillator, Kepler, OneCoordinate, Pendulum, QuadraticInZ,
    Relativistic, System, TwoCoordinates,
};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{
    Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint, legendre,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use discrete_herglotz::{
    DiscreteLagrangian, InputError, StepDetails, StepError, StepFailure, Stepper,
    gauss::{Gauss, GaussRoute},
};

/// The structure of a Lagrangian, reduced so that its steps take another route.
pub fn cut<const N: usize>(system: &impl Lagrangian<N>, route: GaussRoute) -> Structure {
    let all = system.structure();
    match route {
        GaussRoute::Linear => all,
        GaussRoute::Condensed => Structure { quadratic: false, ..all },
        GaussRoute::ConstantMass => Structure { constant_mass: true, ..Structure::default() },
        GaussRoute::General | GaussRoute::Hamiltonian => Structure::default(),
    }
}

/// A run from the natural start; panics where it fails.
fn run<const N: usize, S: Lagrangian<N>>(
    system: S,
    (t, x): (f64, VelocityPoint<N>),
    s: usize,
    h: f64,
    steps: usize,
) -> (PhasePoint<N>, u64, GaussRoute) {
    let start = legendre(&system, t, &x);
    let gauss = Gauss::new(system, s, h);
    let outcome = gauss.as_ref().map_err(|e| e.to_string()).and_then(|gauss| {
        let mut stepper = gauss.stepper(t, start, x.v).map_err(|e| e.to_string())?;
        stepper.advance(steps).map_err(|halt| format!("{halt:?}"))?;
        Ok((stepper.state().fixed(), stepper.evaluations(), stepper.route()))
    });
    assert!(outcome.is_ok(), "s = {s}, h = {h}: {outcome:?}");
    outcome.unwrap_or((start, 0, GaussRoute::General))
}

/// A relativistic particle of mass and speed of light 1 in a field that grows with time: its momentum is a polynomial,
/// and its velocity is not.
#[derive(Clone, Copy, Debug)]
pub struct InField {
    growth: f64,
}

impl Lagrangian<1> for InField {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        -(-(v[0] * v[0]) + 1.0).sqrt() + (t * self.growth + 1.0) * q[0]
    }
}

/// Where the extrapolated momenta of the last step are exact to the last bit, the velocities are still solved for.
#[test]
fn momenta_that_are_polynomials_leave_the_order() {
    let start = VelocityPoint::new([0.0], [-0.8], 0.0);
    for (s, growth) in [(2, 0.0), (3, 0.0), (3, 0.5)] {
        let system = || One::from(InField { growth });
        let (truth, ..) = run(system(), (0.0, start), 16, 1.0 / 16.0, 64);
        if growth == 0.0 {
            // q = sqrt(1 + p^2) from its start, in a field of 1; to the rounding of 64 steps.
            let energy = |p: f64| (1.0 + p * p).sqrt();
            let p = -4.0 / 3.0;
            assert!((truth.q[0] - (energy(p + 4.0) - energy(p))).abs() <= 64.0 * f64::EPSILON, "{truth:?}");
        }
        // Steps for which the error is above round-off.
        let steps = if s == 2 { [32, 48, 64, 96] } else { [24, 32, 40, 48] };
        let points: Vec<_> = steps
            .iter()
            .map(|steps| {
                let h = 4.0 / f64::from(*steps);
                let (e, ..) = run(system(), (0.0, start), s, h, *steps as usize);
                (h, (e.q - truth.q).max_abs_or_nan())
            })
            .collect();
        let observed = slope(&points);
        assert!((observed - 2.0 * s as f64).abs() < 0.15, "s = {s}, growth {growth}: {observed:.3}; {points:?}");
    }
}

/// Order 2s on the problems on which the orders of the other methods are measured, against 16 stages with short steps.
///
/// Up to three stages in q, p and z separately. With four stages the error reaches round-off so early that one
/// component may be near a change of its sign in the whole asymptotic range: the slope is that of all components at
/// three times, over the five finest steps above round-off. From five stages on a slope in double precision measures
/// the approach to the asymptotic regime, and is bounded from below only; from seven on no slope can be measured, and
/// each additional stage reduces the error of a step of 1. There the order 2s follows from the order conditions, which
/// are tested with the coefficients.
#[test]
fn orders_are_twice_the_stages() {
    fn of<const N: usize, S: System<N>>(system: &S) {
        let start = (system.initial_time(), system.initial());
        for s in 1..=3 {
            let (truth, ..) = run(system, start, 16, 1.0 / 32.0, 32);
            let finest = [[64, 90, 128, 180], [24, 32, 48, 64], [12, 16, 20, 24]][s - 1];
            let errors: Vec<_> = finest
                .iter()
                .map(|steps| {
                    let h = 1.0 / *steps as f64;
                    let (e, ..) = run(system, start, s, h, *steps);
                    (h, [(e.q - truth.q).max_abs_or_nan(), (e.p - truth.p).max_abs_or_nan(), (e.z - truth.z).abs()])
                })
                .collect();
            for (component, name) in ["q", "p", "z"].iter().enumerate() {
                let points: Vec<_> = errors.iter().map(|(h, e)| (*h, e[component])).collect();
                let observed = slope(&points);
                assert!(
                    (observed - 2.0 * s as f64).abs() < 0.15,
                    "{} s = {s}: {observed:.3} in {name}; {points:?}",
                    system.name()
                );
            }
        }
        let truth = [1.0, 2.0, 3.0].map(|t| run(system, start, 16, t / 64.0, 64).0);
        let mut coarsest = f64::INFINITY;
        for s in 4..=8 {
            let mut points = Vec::new();
            for steps in 1..40 {
                let h = 1.0 / steps as f64;
                let off = |k: usize| {
                    let (e, ..) = run(system, start, s, h, steps * (k + 1));
                    let t = &truth[k];
                    (e.q - t.q).norm_squared() + (e.p - t.p).norm_squared() + (e.z - t.z).powi(2)
                };
                let error = (0..3).map(off).sum::<f64>().sqrt();
                // Fifty units of round-off of these states.
                if error > 1.5e-14 {
                    points.push((h, error));
                }
            }
            let order = 2.0 * s as f64;
            let observed = slope(&points[points.len().saturating_sub(5)..]);
            let holds = match s {
                4 => (observed - order).abs() < 0.15,
                5 | 6 => observed > order - 4.0,
                _ => true,
            };
            assert!(holds && points[0].1 < 0.5 * coarsest, "{} s = {s}: {observed:.3}; {points:?}", system.name());
            coarsest = points[0].1;
        }
    }
    of(&OneCoordinate::from(QuadraticInZ { c: 1.0 }));
    of(&OneCoordinate::from(CoupledInZ { gamma: -1.0, ..CoupledInZ::default() }));
    of(&TwoCoordinates::from(CoupledPlane { c: 1.5, ..CoupledPlane::default() }));
    of(&OneCoordinate::from(Relativistic { gamma: -1.0 }));
    of(&TwoCoordinates::from(DoublePendulum { gamma: -1.0, ..DoublePendulum::default() }));
}

/// A decayed oscillation keeps its relative accuracy, after t = 1000 in units of the amplitude `e^(gamma t/2) = 1e-11`.
/// By the linear route, whose products are exact, the error is at most 4 eps, that of the closed form. By the iterated
/// route it is at most 400 eps: the positions of the stages are sums with rounded coefficients, with an error of a
/// fraction of an eps in every step and in the same direction.
#[test]
fn decayed_states_keep_their_accuracy() {
    let oscillator = HarmonicOscillator { gamma: -0.05 };
    let system = OneCoordinate::from(oscillator);
    let x = VelocityPoint::new([1.0], [0.0], 0.0);
    let t = 1000.0;
    // The closed form without the rounding of the phase `w t` and of the exponent `a t`.
    let a = 0.5 * oscillator.gamma;
    let w_less_one = -a * a / ((1.0 - a * a).sqrt() + 1.0);
    let ((s1, c1), (s2, c2)) = (f64::sin_cos(t), f64::sin_cos(w_less_one * t));
    let (s, c, w) = (s1 * c2 + c1 * s2, c1 * c2 - s1 * s2, 1.0 + w_less_one);
    let amplitude = (a * t).exp() * (1.0 + a.mul_add(t, -(a * t)));
    let (q, v) = (amplitude * (c - a / w * s), -amplitude * s / w);
    // Steps that are exact in binary, so that the time is exact.
    for (stages, h) in [(8, 0.5), (8, 0.625), (16, 2.5), (16, 5.0)] {
        for (route, bound) in [(GaussRoute::Linear, 4.0), (GaussRoute::Condensed, 400.0)] {
            let claims = One::from(WithStructure(system, cut(&system, route)));
            let (end, _, taken) = run(claims, (0.0, x), stages, h, (t / h) as usize);
            let error = (end.q[0] - q).abs().max_or_nan((end.p[0] - v).abs()) / (amplitude * f64::EPSILON);
            assert_eq!(taken, route);
            assert!(error <= bound, "s = {stages} {route:?}: {error} eps");
        }
    }
}

/// Angular momentum decays as `e^(gamma t)` on an orbit of eccentricity 1/2: to 1e-13 in 1e5 steps, while the orbit
/// shrinks by `e^(2 gamma t)` to 0.29 of its size, and to 5e-13 in 1e6 of a slower decay.
#[test]
fn angular_momentum_decays_exactly() {
    let x = VelocityPoint::new([0.5, 0.0], [0.0, 3f64.sqrt()], 0.0);
    for (gamma, steps, bound) in [(-1e-4, 100_000, 1e-13), (-1e-6, 1_000_000, 5e-13)] {
        let h = 0.0625;
        let (end, ..) = run(Kepler::<2> { gamma, mu: 1.0 }, (0.0, x), 8, h, steps);
        let momentum = |q: &SVector<f64, 2>, p: &SVector<f64, 2>| q[0] * p[1] - q[1] * p[0];
        let expected = momentum(&x.q, &x.v) * (gamma * h * steps as f64).exp();
        let error = (momentum(&end.q, &end.p) / expected - 1.0).abs();
        assert!(error <= bound, "gamma = {gamma}: {error:e}");
    }
}

/// One system by each route that its structure allows: equal to round-off after 100 steps, in which the rounding of
/// each adds up at random to 10 eps, and to at most 30.
#[test]
fn routes_agree() {
    fn of<const N: usize, S: System<N> + Copy, L: Lagrangian<N> + From<WithStructure<S>>>(
        system: &S,
        s: usize,
        h: f64,
        routes: &[GaussRoute],
    ) {
        let ends: Vec<_> = routes
            .iter()
            .map(|route| {
                let claims = WithStructure(*system, cut(system, *route));
                let (end, _, taken) = run(L::from(claims), (0.0, system.initial()), s, h, 100);
                assert_eq!(taken, *route, "{}", system.name());
                end
            })
            .collect();
        for (end, route) in ends.iter().zip(routes) {
            let off = relative_distance(*end, ends[0]) / f64::EPSILON;
            assert!(off <= 30.0, "{} s = {s} {route:?}: {off} eps", system.name());
        }
    }
    use GaussRoute::{Condensed, ConstantMass, General, Linear};
    for s in [3, 8, 13] {
        let (all, nonlinear) = ([Linear, Condensed, ConstantMass, General], [Condensed, ConstantMass, General]);
        of::<1, _, One>(&OneCoordinate::from(HarmonicOscillator::default()), s, 0.1, &all);
        of::<1, _, One>(&OneCoordinate::from(Pendulum::default()), s, 0.1, &nonlinear);
        of::<2, _, Two>(&Kepler::<2>::default(), s, 0.05, &nonlinear);
    }
}

/// The number of fixed-point iterations of a step, which the extrapolated start and the slope of the force reduce: 4.40
/// on the condensed route and 5.93 on the general ones were measured, and a tenth more is allowed.
#[test]
fn few_iterations() {
    let system = OneCoordinate::from(Pendulum { gamma: -0.01 });
    let x = VelocityPoint::new([1.0], [1.0], 0.0);
    for (route, most) in [(GaussRoute::Condensed, 4.85), (GaussRoute::ConstantMass, 6.5), (GaussRoute::General, 6.5)] {
        let (_, evaluations, _) = run(One::from(WithStructure(system, cut(&system, route))), (0.0, x), 8, 0.5, 1000);
        let iterations = evaluations as f64 / 8e3;
        assert!(iterations <= most, "{route:?}: {iterations} iterations");
    }
}

/// Runs are the same to the last bit when they are repeated, in one piece or step by step.
#[test]
fn repeated_runs_are_the_same() {
    fn of<const N: usize, S: System<N>>(system: &S) {
        let gauss = Gauss::new(system, 6, 0.05);
        let start = legendre(system, 0.0, &system.initial());
        let stepper = || gauss.as_ref().ok().and_then(|g| g.stepper(0.0, start, system.initial().v).ok());
        let (Some(mut a), Some(mut b)) = (stepper(), stepper()) else { panic!("{}", system.name()) };
        let one_by_one = (0..50).all(|_| a.advance(1).is_ok());
        assert!(one_by_one && b.advance(50).is_ok());
        assert_eq!((a.state(), a.sigma(), a.evaluations()), (b.state(), b.sigma(), b.evaluations()));
    }
    of(&OneCoordinate::from(HarmonicOscillator::default()));
    of(&Kepler::<2>::default());
    of(&OneCoordinate::from(Relativistic::default()));
    of(&TwoCoordinates::from(DoublePendulum::default()));
}

/// Steps so long that the iteration does not contract are solved by Newton's method and agree with those of the
/// discrete Lagrangian; without Newton's method they are refused, and the state does not change.
#[test]
fn newton_takes_over() {
    fn of(system: One, x: VelocityPoint<1>, s: usize, h: f64, bound: f64) {
        let start = legendre(&system, 0.0, &x);
        let gauss = Gauss::new(system, s, h);
        let stepper = || gauss.as_ref().ok().and_then(|g| g.stepper(0.0, start, x.v).ok());
        let (Some(mut stepper), Some(without)) = (stepper(), stepper()) else { panic!("no stepper") };
        assert_eq!(stepper.advance(1), Ok(()), "{:?}", stepper.route());
        assert_eq!(stepper.newton_steps(), 1, "{:?}", stepper.route());
        let mut without = without.without_newton();
        let halt = without.advance(3);
        assert!(
            matches!(halt, Err(StepFailure { taken: 0, cause: StepError::NotConverged { .. } | StepError::NonFinite })),
            "{halt:?}"
        );
        assert_eq!((without.state(), without.time(), without.sigma()), (start.into(), 0.0, 1.0));
        assert!(without.dense().is_none());
        let gauss = gauss.as_ref().unwrap();
        let step = gauss.forward(0.0, &start, &x.v, &mut Default::default());
        let step = step.unwrap();
        let off = relative_distance(stepper.state(), step.end);
        assert!(
            off <= bound && (stepper.sigma() / step.sigma - 1.0).abs() <= bound,
            "{off:e}, {} {}",
            stepper.sigma(),
            step.sigma
        );
        // The stepper continues, and the curve of the step meets both states.
        let curve = stepper.dense();
        assert!(
            curve.is_some_and(|c| relative_distance(c.at(h), stepper.state()) <= bound
                && relative_distance(c.at(0.0), start) <= bound)
        );
        assert_eq!(stepper.advance(2), Ok(()));
    }
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.1 });
    let x = VelocityPoint::new([2.0], [1.0], 0.0);
    for route in [GaussRoute::Condensed, GaussRoute::ConstantMass, GaussRoute::General] {
        of(One::from(WithStructure(pendulum, cut(&pendulum, route))), x, 4, 5.0, 1e-12);
    }
    // Damping by e^20 in one step: the factors of stages are negative at the solution, which is refused also by
    // Newton's method.
    let damped = WithStructure(OneCoordinate::from(HarmonicOscillator { gamma: -20.0 }), Structure::default());
    let gauss = Gauss::new(One::from(damped), 8, 1.0).unwrap();
    let mut stepper = gauss.stepper(0.0, PhasePoint::new([1.0], [1.0], 0.0), [1.0].into()).unwrap();
    let halt = stepper.advance(1);
    let refused = match halt {
        Err(StepFailure { taken: 0, cause: StepError::StageFactor { rho } }) => rho < 0.0,
        Err(StepFailure { taken: 0, cause: StepError::NotConverged { .. } }) => true,
        _ => false,
    };
    assert!(refused, "{halt:?}");
}

/// Invalid input: a number of stages that does not exist, and a step whose conformal factor is not positive.
#[test]
fn bad_input_is_refused() {
    let system = one(Pendulum::default());
    for stages in [0, 17] {
        let error = Gauss::new::<1>(&system, stages, 0.1).err();
        assert_eq!(error, Some(InputError::Stages { found: stages }));
    }
    // sigma_d = (1 + gamma h/2) / (1 - gamma h/2) with one stage.
    let start = PhasePoint::new([1.0], [0.0], 0.0);
    for gamma in [-30.0, 30.0] {
        let gauss = Gauss::new(one(Pendulum { gamma }), 1, 0.1);
        let error = gauss.map(|gauss| gauss.stepper(0.0, start, [0.0].into()).err());
        // With damping the factor of the stage, 1 / (1 + gamma h/2), is negative, with growth that of the end.
        let refused = match error {
            Ok(Some(InputError::FirstStep(StepError::StageFactor { rho }))) => gamma < 0.0 && rho < 0.0,
            Ok(Some(InputError::Sigma { sigma })) => gamma > 0.0 && sigma < 0.0,
            _ => false,
        };
        assert!(refused, "{error:?}");
        // The general route finds it during the step.
        let general = WithStructure(OneCoordinate::from(Pendulum { gamma }), Structure::default());
        let general = Gauss::new(One::from(general), 1, 0.1);
        let halt = general.map(|gauss| gauss.stepper(0.0, start, [0.0].into()).map(|mut s| s.advance(1)));
        let same = match halt {
            Ok(Ok(Err(StepFailure { taken: 0, cause: StepError::StageFactor { rho } }))) => gamma < 0.0 && rho < 0.0,
            Ok(Ok(Err(StepFailure { taken: 0, cause: StepError::SigmaVanished { sigma } }))) => {
                gamma > 0.0 && sigma < 0.0
            }
            _ => false,
        };
        assert!(same, "{halt:?}");
    }
}

/// A well that ends at q0 = 2 in one coordinate, uncoupled from the other.
#[derive(Clone, Copy, Debug)]
pub struct Ends;

impl Lagrangian<2> for Ends {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        dot(v, v) * 0.5 + (-q[0] + 2.0).sqrt() - q[1] * q[1] * 0.5
    }
    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_free: true,
            z_affine: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

/// A step to a state that is not finite is refused, with the last finite state kept, whether one coordinate is affected
/// or all.
#[test]
fn what_is_not_finite_is_refused() {
    for claims in [Ends.structure(), Structure::default()] {
        let gauss = Gauss::new(Two::from(WithStructure(Ends, claims)), 4, 0.02);
        let start = PhasePoint::new([0.0, 1.0], [2.5, 0.0], 0.0);
        let stepper = gauss.as_ref().map(|g| g.stepper(0.0, start, [2.5, 0.0].into()));
        let Ok(Ok(mut stepper)) = stepper else { panic!("no stepper") };
        let halt = stepper.advance(1000);
        assert!(matches!(halt, Err(StepFailure { taken: 10..100, .. })), "{halt:?}");
        assert!(stepper.state().is_finite() && stepper.state().q[0] < 2.0);
    }
    let gauss = Gauss::new(one(HarmonicOscillator { gamma: 1.0 }), 4, 0.5);
    let stepper = gauss.as_ref().map(|g| g.stepper(0.0, PhasePoint::new([1.0], [0.0], 0.0), [0.0].into()));
    let Ok(Ok(mut stepper)) = stepper else { panic!("no stepper") };
    let halt = stepper.advance(10_000);
    // The action grows as e^t, and overflows from e^709 on.
    assert!(matches!(halt, Err(StepFailure { taken: 1380..1440, cause: StepError::NonFinite })), "{halt:?}");
    assert!(stepper.state().is_finite());
}
