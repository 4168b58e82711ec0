//! Contact Gauss collocation in transformed time.

use crate::common::gauss::GaussSteppers;
use crate::lagrangians::{one, two};
use contact_examples::systems::{Kepler, Pendulum, PerturbedKepler, System};
use contact_geom::nalgebra::SVector;
use contact_geom::{Hints, Lagrangian, Scalar, Structure, VelocityPoint, legendre, numbers::MaxOrNan};
use discrete_herglotz::{
    AnyIntegrator, InputError, MethodInfo, Outcome, Problem, Rows, State, Status, StepError, Stepper, Steps,
    TransformedGauss, Until,
    gauss::{Gauss, TransformedStepper},
};

type Planar = Kepler<2>;

/// The pericentre of an orbit of semi-major axis 1.
fn pericentre(e: f64) -> VelocityPoint<2> {
    VelocityPoint::new([1.0 - e, 0.0], [0.0, ((1.0 + e) / (1.0 - e)).sqrt()], 0.0)
}

fn transformed<L: Lagrangian<2>>(gauss: &Gauss<L>, e: f64) -> TransformedStepper<'_> {
    let start = pericentre(e);
    gauss.transformed_stepper(0.0, legendre(gauss.lagrangian(), 0.0, &start), start.v).unwrap()
}

fn distance(a: &State, b: &State) -> f64 {
    (&a.q - &b.q).norm().max_or_nan((&a.p - &b.p).norm()).max_or_nan((a.z - b.z).abs())
}

fn angular_momentum(x: &State) -> f64 {
    x.q[0] * x.p[1] - x.q[1] * x.p[0]
}

fn energy(kepler: &Planar, x: &State) -> f64 {
    kepler.hamiltonian(0.0, &x.fixed()).unwrap()
}

/// A rate dt/dtau.
enum Rate {
    Constant(f64),
    /// Not defined beyond `x = 0`.
    Ending,
}

/// Kepler's problem with another time transformation.
struct Orbit(Planar, Rate);

impl Lagrangian<2> for Orbit {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    fn structure(&self) -> Structure {
        self.0.structure()
    }
    fn dt_dtau<T: Scalar>(&self, q: &SVector<T, 2>) -> T {
        match self.1 {
            Rate::Constant(rate) => T::from(rate),
            Rate::Ending => q[0].sqrt() + 1.0,
        }
    }
}

#[test]
fn a_constant_time_transformation_is_the_physical_time() {
    let kepler = Planar { gamma: -0.05, mu: 1.0 };
    let start = pericentre(0.5);
    let gauss = Gauss::new(kepler, 8, 0.1).unwrap();
    let mut plain = gauss.stepper(0.0, legendre(&kepler, 0.0, &start), start.v).unwrap();
    plain.advance(100).unwrap();
    for rate in [1.0, 2.0] {
        let gauss = Gauss::new(Orbit(kepler, Rate::Constant(rate)), 8, 0.1 / rate).unwrap();
        let mut run = transformed(&gauss, 0.5);
        run.advance(100).unwrap();
        assert!((run.time() - plain.time()).abs() < 1e-14);
        let off = distance(&run.state(), &plain.state());
        assert!(off < 2e-13, "rate {rate}: {off:e}");
        assert!((run.sigma() - plain.sigma()).abs() < 1e-15);
    }
}

#[test]
fn order_two_s_at_a_physical_time() {
    let kepler = Planar { gamma: -0.05, mu: 1.0 };
    let at = |s: usize, h: f64, t: f64| {
        let gauss = Gauss::new(kepler, s, h).unwrap();
        let mut run = transformed(&gauss, 0.5);
        run.advance_to(t).unwrap();
        assert!((run.time() - t).abs() <= 1e-15 * t, "{} for {t}", run.time());
        run.state()
    };
    let t = 7.0;
    // The reference is computed without the time transformation, so that its errors cannot cancel.
    let start = pericentre(0.5);
    let gauss = Gauss::new(kepler, 12, t / 100.0).unwrap();
    let mut reference = gauss.stepper(0.0, legendre(&kepler, 0.0, &start), start.v).unwrap();
    reference.advance(100).unwrap();
    for (s, h) in [(2, 0.05), (3, 0.1), (4, 0.25)] {
        let error = |h: f64| distance(&at(s, h, t), &reference.state());
        let (coarse, fine) = (error(h), error(h / 2.0));
        let order = (coarse / fine).log2();
        assert!((order - 2.0 * s as f64).abs() < 0.15, "s = {s}: {order} from {coarse:e} and {fine:e}");
    }
}

#[test]
fn momenta_contract_by_sigma() {
    let kepler = Planar { gamma: -0.01, mu: 1.0 };
    let gauss = Gauss::new(kepler, 4, 0.2).unwrap();
    let mut run = transformed(&gauss, 0.5);
    let (start, p_t) = (run.state(), run.time_momentum());
    let (mut contracted, mut defect) = (1.0, 0.0_f64);
    for _ in 0..1000 {
        run.advance(1).unwrap();
        contracted *= run.sigma();
        // K / g, which vanishes on the motion.
        defect =
            defect.max_or_nan((energy(&kepler, &run.state()) + run.time_momentum()).abs() / run.time_momentum().abs());
    }
    let off = angular_momentum(&run.state()) / (contracted * angular_momentum(&start)) - 1.0;
    assert!(off.abs() < 1e-13, "{off:e}");
    assert!((run.time_momentum() / (contracted * p_t) - 1.0).abs() < 1e-13);
    assert!(contracted < 0.7);
    assert!(defect < 1e-5 && defect > 1e-13, "{defect:e}");
}

#[test]
fn eccentric_orbits_cost_less() {
    let kepler = Planar { gamma: -1e-4, mu: 1.0 };
    let (t, start) = (20.0, pericentre(0.9));
    let plain = |s: usize, n: usize| {
        let gauss = Gauss::new(kepler, s, t / n as f64).unwrap();
        let mut run = gauss.stepper(0.0, legendre(&kepler, 0.0, &start), start.v).unwrap();
        run.advance(n).unwrap();
        (run.state(), run.evaluations())
    };
    let (reference, _) = plain(12, 8000);
    let (fixed, most) = plain(8, 800);
    let gauss = Gauss::new(kepler, 8, 0.5).unwrap();
    let mut run = transformed(&gauss, 0.9);
    run.advance_to(t).unwrap();
    let (error, of_fixed) = (distance(&run.state(), &reference), distance(&fixed, &reference));
    println!("{error:e} with {}, {of_fixed:e} with {most}", run.evaluations());
    assert!(run.evaluations() < most, "{} and {most}", run.evaluations());
    assert!(error < 1e-3 * of_fixed, "{error:e} and {of_fixed:e}");
}

#[test]
fn bad_input_is_refused() {
    let kepler = Planar::default();
    let start = pericentre(0.5);
    let state = legendre(&kepler, 0.0, &start);
    let gauss = Gauss::new(kepler, 3, 0.1).unwrap();
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let gauss = Gauss::new(Orbit(kepler, Rate::Constant(bad)), 3, 0.1).unwrap();
        let refused = gauss.transformed_stepper(0.0, state, start.v).err();
        assert!(matches!(refused, Some(InputError::TimeTransformation { .. })), "{bad}: {refused:?}");
    }
    let driven = Gauss::new(two(PerturbedKepler::default()), 3, 0.1).unwrap();
    let refused = driven.transformed_stepper(0.0, state, start.v).err();
    assert_eq!(refused, Some(InputError::Unclaimed { claim: "autonomous" }));
    let mut run = gauss.transformed_stepper(0.0, state, start.v).unwrap();
    assert_eq!(run.advance_to(f64::NAN).map_err(|halt| halt.cause), Err(StepError::NonFinite));
    assert_eq!((run.advance_to(-1.0), run.time()), (Ok(()), 0.0));
}

#[test]
fn a_time_transformation_that_is_not_defined_ends_the_run() {
    let gauss = Gauss::new(Orbit(Planar::default(), Rate::Ending), 3, 0.1).unwrap();
    let mut run = transformed(&gauss, 0.5);
    let halt = run.advance_to(10.0).unwrap_err();
    assert_eq!(halt.cause, StepError::NonFinite);
    assert!(run.state().q[0] > 0.0 && run.time() < 10.0 && halt.taken > 3);
}

/// (q, p) on the orbit of [`pericentre`] without drag, from Kepler's equation by bisection.
fn on_orbit(e: f64, t: f64) -> SVector<f64, 4> {
    let mean = t.rem_euclid(std::f64::consts::TAU);
    let (mut low, mut high) = (0.0, std::f64::consts::TAU);
    for _ in 0..100 {
        let u: f64 = 0.5 * (low + high);
        *(if u - e * u.sin() < mean { &mut low } else { &mut high }) = u;
    }
    let ((sin, cos), b) = (low.sin_cos(), (1.0 - e * e).sqrt());
    let r = 1.0 - e * cos;
    SVector::from([cos - e, b * sin, -sin / r, b * cos / r])
}

/// The orbit over a little more than three revolutions with an accuracy, by an integrator or the default; and the true
/// error.
fn to_accuracy(e: f64, wanted: f64, by: Option<AnyIntegrator>) -> (MethodInfo, Outcome, f64) {
    let (kepler, span) = (Planar { gamma: 0.0, mu: 1.0 }, 20.0);
    let problem = Problem::new(&kepler, 0.0, pericentre(e)).unwrap();
    let run = problem.accuracy(wanted);
    let run = if let Some(by) = by { run.by(by) } else { run };
    let plan = run.plan(Until::Time(span)).unwrap();
    let outcome = plan.run().unwrap();
    assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None));
    assert_eq!(outcome.steps, plan.count(), "{plan}");
    let (q, p, truth) = (&outcome.q, &outcome.p, on_orbit(e, span));
    let error = (SVector::from([q[0], q[1], p[0], p[1]]) - truth).norm() / truth.norm();
    (plan.integrator().clone(), outcome, error)
}

/// Eccentric orbits are computed in transformed time, to the requested accuracy, and with a part of the evaluations of
/// equal steps. Equal steps are shorter than those at distance one by `(1 - e)^(3/2)`; their iterations converge in two
/// or three iterations, where long steps take up to eighteen, and a factor two is left for the mean over the orbit.
#[test]
fn eccentric_orbits_choose_the_time_transformation() {
    for e in [0.9, 0.99] {
        for wanted in [1e-6, 1e-8, 1e-10, 1e-11] {
            let (integrator, outcome, error) = to_accuracy(e, wanted, None);
            assert!(integrator.in_transformed_time, "{e}, {wanted:e}: {integrator:?}");
            assert!(error <= wanted, "{e}, {wanted:e}: {error:e}");
            assert_eq!(outcome.t, 20.0);
        }
        let (wanted, least) = (1e-8, 0.05 * (1.0 - e).powf(-1.5));
        let (in_transformed_time, equal) =
            (to_accuracy(e, wanted, None).1, to_accuracy(e, wanted, "gauss_8".parse().ok()).1);
        let ratio = equal.evaluations as f64 / in_transformed_time.evaluations as f64;
        assert!(
            ratio >= least,
            "{e}: {} evaluations, {} by equal steps",
            in_transformed_time.evaluations,
            equal.evaluations
        );
    }
}

/// From the apocentre too, where the start does not show how close the pericentre is.
#[test]
fn starts_at_the_apocentre() {
    let kepler = Planar { gamma: 0.0, mu: 1.0 };
    for e in [0.9, 0.99] {
        // The pericentre of -e is the apocentre of e.
        let problem = Problem::new(&kepler, 0.0, pericentre(-e)).unwrap();
        let plan = problem.accuracy(1e-8).plan(Until::Time(20.0)).unwrap();
        let Outcome { status, q, p, .. } = plan.run().unwrap();
        let truth = -on_orbit(e, 20.0 + std::f64::consts::PI);
        let error = (SVector::from([q[0], q[1], p[0], p[1]]) - truth).norm() / truth.norm();
        assert!(plan.integrator().in_transformed_time && status == Status::Completed, "{plan}");
        assert!(error <= 1e-8, "{e}: {error:e}");
    }
}

/// Where the time transformation gains little it is not chosen; named explicitly, it keeps the accuracy, with any
/// number of stages.
#[test]
fn round_orbits_take_equal_steps() {
    for e in [0.0, 0.1] {
        let (integrator, _, error) = to_accuracy(e, 1e-8, None);
        assert!(!integrator.in_transformed_time && error <= 1e-8, "{e}: {integrator:?}, {error:e}");
        for name in ["transformed_gauss_4", "transformed_gauss_8"] {
            let (_, _, error) = to_accuracy(e, 1e-8, name.parse().ok());
            assert!(error <= 1e-8, "{e}, {name}: {error:e}");
        }
    }
}

/// The numbers are the same to the last bit with any observers; rows end where the run does, and the factor is that of
/// linear drag.
#[test]
fn rows_of_a_transformed_run_change_nothing() {
    let kepler = Planar { gamma: -0.01, mu: 1.0 };
    let problem = Problem::new(&kepler, 0.0, pericentre(0.9)).unwrap();
    for to_accuracy in [false, true] {
        let in_transformed_time = || {
            let run = problem.by(AnyIntegrator::TransformedGauss { stages: 8 });
            if to_accuracy { run.accuracy(1e-8) } else { run.steps(Steps::Size(0.25)) }
        };
        let nothing = in_transformed_time().without_action().run(Until::Time(20.0)).unwrap();
        let mut rows = Rows::every(7).unwrap();
        let all = in_transformed_time().with_conformal_factor().observe(&mut rows).run(Until::Time(20.0)).unwrap();
        let rows = rows.rows;
        assert_eq!((nothing.status, nothing.unresolved), (Status::Completed, None));
        assert_eq!((all.status, all.unresolved), (Status::Completed, None));
        assert_eq!((&nothing.q, &nothing.p, nothing.t, nothing.steps), (&all.q, &all.p, all.t, all.steps));
        assert_eq!(rows.len(), all.steps.div_ceil(7) + 1);
        assert_eq!(rows.last().map(|row| (row.t, &row.q, row.z)), Some((all.t, &all.q, all.z)));
        assert!(rows.windows(2).all(|rows| rows[0].t < rows[1].t));
        assert_eq!(all.t, 20.0);
        let factor = all.log_factor.unwrap().exp();
        assert!((factor - (-0.2f64).exp()).abs() <= 1e-8, "{factor}");
    }
}

/// A free particle with a time transformation of any rate, autonomous or not.
struct Transformed {
    rate: f64,
    autonomous: bool,
}

impl Lagrangian<1> for Transformed {
    const HINTS: Hints = Hints { time_transformation: true, ..Hints::NONE };

    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: self.autonomous, ..Structure::default() }
    }
    fn dt_dtau<T: Scalar>(&self, _q: &SVector<T, 1>) -> T {
        T::from(self.rate)
    }
}

#[test]
fn invalid_time_transformations_are_refused() {
    let by = AnyIntegrator::TransformedGauss { stages: 4 };
    assert_eq!(
        AnyIntegrator::TransformedGauss { stages: 17 }.check(&Planar::default()),
        Err(InputError::Stages { found: 17 })
    );
    assert!(matches!(by.check(&one(Pendulum { gamma: -0.1 })), Err(InputError::NoTimeTransformation)));
    assert!(matches!(by.check(&two(PerturbedKepler::default())), Err(InputError::NoTimeTransformation)));
    let driven = Transformed { rate: 1.0, autonomous: false };
    assert_eq!(by.check(&driven), Err(InputError::Unclaimed { claim: "autonomous" }));
    let start = VelocityPoint::new([0.0], [1.0], 0.0);
    // Not by `AnyIntegrator`, which is compiled with every integrator.
    let by = TransformedGauss { stages: 4 };
    let refused = |rate: f64, autonomous: bool, steps: Steps| {
        let system = Transformed { rate, autonomous };
        Problem::new(&system, 0.0, start).unwrap().by(by).steps(steps).plan(Until::Time(2.0)).err()
    };
    let inaccurate = |rate: f64| {
        let system = Transformed { rate, autonomous: true };
        Problem::new(&system, 0.0, start).unwrap().by(by).accuracy(1e-6).plan(Until::Time(2.0)).err()
    };
    assert_eq!(refused(1.0, false, Steps::Size(0.1)), Some(InputError::Unclaimed { claim: "autonomous" }));
    for rate in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        assert!(matches!(refused(rate, true, Steps::Size(0.1)), Some(InputError::TimeTransformation { .. })), "{rate}");
        assert!(matches!(inaccurate(rate), Some(InputError::TimeTransformation { .. })), "{rate}");
    }
    assert!(matches!(refused(1e-300, true, Steps::Size(0.1)), Some(InputError::TooMany { .. })));
    assert_eq!(refused(1.0, true, Steps::Size(-0.1)), Some(InputError::Step { h: -0.1 }));
    let sentence = refused(1.0, true, Steps::Count(10)).map(|error| error.to_string()).unwrap_or_default();
    assert!(sentence.contains("steps of a given size in transformed time"), "{sentence}");
    // A time transformation without a gain is not chosen, whatever its rate.
    for rate in [1.0, 1e-3, -1.0, f64::NAN] {
        let system = Transformed { rate, autonomous: true };
        let problem = Problem::new(&system, 0.0, start).unwrap();
        let plan = problem.accuracy(1e-8).plan(Until::Time(2.0)).unwrap();
        assert!(!plan.integrator().in_transformed_time, "{rate}: {plan}");
    }
    let system = Transformed { rate: 0.5, autonomous: true };
    let problem = Problem::new(&system, 0.0, start).unwrap();
    let plan = problem.by(by).steps(Steps::Size(0.3)).plan(Until::Time(2.0)).unwrap();
    let outcome = plan.run().unwrap();
    let tenths = problem.by(by).steps(Steps::Size(0.4)).run(Until::Time(2.0)).unwrap();
    assert_eq!((tenths.steps, tenths.t), (10, 2.0));
    // Thirteen steps of 0.15, and one of a third of that; the span of 2 ends exactly in spite of rounding.
    assert_eq!((outcome.steps, plan.count(), outcome.t), (14, 14, 2.0));
    assert!(
        plan.to_string().contains("14 steps of 0.3 in transformed time by transformed_gauss_4, t = 0 .. 2"),
        "{plan}"
    );
    // The same number of steps backward, each of the same length.
    let plan = problem.by(by).steps(Steps::Size(0.3)).plan(Until::Time(-2.0)).unwrap();
    let back = plan.run().unwrap();
    assert_eq!((back.steps, plan.count(), back.t, plan.step_size()), (14, 14, -2.0, -0.3));
    // In transformed time the number of steps is not known, so that a run cannot end after a number of steps.
    let counted = problem.by(by).steps(Steps::Size(0.3)).plan(Until::Steps(14)).err();
    assert!(matches!(counted, Some(InputError::Hypothesis { .. })), "{counted:?}");
}

/// A fall into the centre comes to an end, by any integrator.
#[test]
fn a_fall_into_the_centre_ends() {
    let kepler = Planar { gamma: 0.0, mu: 1.0 };
    let problem = Problem::new(&kepler, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0)).unwrap();
    let refused = problem.accuracy(1e-6).plan(Until::Time(2.0)).err();
    assert!(matches!(refused, Some(InputError::Accuracy { .. })), "{refused:?}");
    let outcome = problem
        .by(AnyIntegrator::TransformedGauss { stages: 8 })
        .steps(Steps::Size(0.1))
        .run(Until::Time(2.0))
        .unwrap();
    assert!(matches!(outcome.status, Status::Failed { .. }), "{outcome:?}");
    // The fall takes pi / 8^(1/2) without another force.
    assert!(outcome.t <= std::f64::consts::PI / 8.0f64.sqrt() && outcome.t > 1.0, "{}", outcome.t);
}
