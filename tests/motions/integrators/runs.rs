//! Runs: plans that describe the work, outcomes that do not depend on the outputs, invalid input, and runs backward.

use crate::common::lagrangians::WithStructure;
use crate::common::oracle::motion;
use crate::lagrangians::{One, one, two};
use contact_examples::systems::{
    DoublePendulum, Duffing, HarmonicOscillator, Kepler, OneCoordinate, Pendulum, QuadraticInZ, System,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, DiscretePoint, Lagrangian, OneParameterGroup, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint,
    legendre,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use discrete_herglotz::{
    AnyIntegrator, Event, Events, InputError, MomentumDecay, Outcome, Plan, Problem, Rows, Run, SelectionFailure,
    SplittingScheme, Status, Steps, Until,
    rules::{Flow, Method, Rule},
};
use exact_lagrangian::herglotz_flow;
use std::f64::consts::PI;

const START: [f64; 3] = [1.0, 1.0, 0.2];

fn start() -> VelocityPoint<1> {
    VelocityPoint::new([START[0]], [START[1]], START[2])
}

fn gauss(stages: usize) -> AnyIntegrator {
    AnyIntegrator::Gauss { stages }
}

/// The problem of a system from [`START`] at t = 0.
fn from_start<L: Lagrangian<1>>(lagrangian: &L) -> Problem<'_, L, 1> {
    Problem::new(lagrangian, 0.0, start()).unwrap()
}

/// A run in ten steps.
fn ten_steps<'p, 'o, L: Lagrangian<N>, const N: usize>(
    problem: &'p Problem<'p, L, N>,
    by: AnyIntegrator,
) -> Run<'p, 'o, Problem<'p, L, N>> {
    problem.by(by).steps(Steps::Count(10))
}

/// The titles of what a plan computes, and of what it skips.
fn titles(plan: &Plan<'_>, computed: bool) -> Vec<&'static str> {
    plan.entries().iter().filter(|item| item.computed == computed).map(|item| item.what).collect()
}

/// Every integrator that applies to a system of each kind agrees with the motion by an independent integrator: up to
/// the error of its order with steps of 1/32, times a constant that the fastest time scales of the systems explain.
#[test]
fn every_integrator() {
    struct Visitor(usize);
    impl Visitor {
        fn visit<const N: usize>(&mut self, of: &impl System<N>, system: &impl Lagrangian<N>) {
            let (t0, initial) = (of.initial_time(), of.initial());
            let truth = legendre(system, t0 + 0.5, &motion(system, t0, &initial, 0.5));
            let problem = Problem::new(system, t0, initial).unwrap();
            for integrator in AnyIntegrator::all() {
                if integrator.check(system).is_err() {
                    continue;
                }
                // In Kepler's problem from this start 1/32 of the transformed time is less than 1/32 of the time.
                let in_transformed_time = matches!(integrator, AnyIntegrator::TransformedGauss { .. });
                let steps = if in_transformed_time { Steps::Size(0.5 / 16.0) } else { Steps::Count(16) };
                let outcome = problem.by(integrator).steps(steps).run(Until::Time(t0 + 0.5));
                let Ok(Outcome { status: Status::Completed, q, p, z: Some(z), .. }) = outcome else {
                    // No system declares a constant rate; it is verified when the plan is made.
                    let refused = matches!(outcome, Err(InputError::Hypothesis { .. }));
                    assert!(refused, "{} by {integrator}: {outcome:?}", of.name());
                    continue;
                };
                let size = truth.q.max_abs_or_nan().max_or_nan(truth.p.max_abs_or_nan()).max_or_nan(truth.z.abs());
                let error =
                    (q - truth.q).amax().max_or_nan((p - truth.p).amax()).max_or_nan((z - truth.z).abs()) / size;
                let bound = (1.0f64 / 4.0).powi(integrator.order().min(10) as i32).max_or_nan(1e-8);
                assert!(error <= bound, "{} by {integrator}: {error:e}, not {bound:e}", of.name());
                self.0 += 1;
            }
        }
    }
    // One system of each kind of structure, since each is compiled with every method.
    let mut visitor = Visitor(0);
    visitor.visit(&HarmonicOscillator::default(), &one(HarmonicOscillator::default()));
    visitor.visit(&Duffing::forced(), &one(Duffing::forced()));
    visitor.visit(&QuadraticInZ::default(), &one(QuadraticInZ::default()));
    visitor.visit(&Kepler::<2>::default(), &Kepler::<2>::default());
    visitor.visit(&DoublePendulum::default(), &two(DoublePendulum::default()));
    // The rules, the Gauss methods and the compositions apply to all systems.
    assert!(visitor.0 >= 5 * 25, "{}", visitor.0);
}

/// The numbers are the same to the last bit, whatever else is requested: with rows, the action and the factor, or
/// without.
#[test]
fn outputs_do_not_change_the_motion() {
    let (pendulum, square, kepler) =
        (one(Pendulum { gamma: -0.1 }), one(QuadraticInZ { c: 0.3 }), Kepler::<2>::default());
    fn compare<L: Lagrangian<N>, const N: usize>(
        lagrangian: &L,
        start: VelocityPoint<N>,
        by: AnyIntegrator,
        group: Option<Symmetry<N>>,
    ) {
        let problem = Problem::new(lagrangian, 0.0, start).unwrap();
        let (steps, until) = (Steps::Count(200), Until::Time(10.0));
        let nothing = problem.by(by).steps(steps).without_action().run(until).unwrap();
        let rows = Rows::every(7).unwrap();
        let mut rows = match group {
            Some(group) => rows.column("J", move |_, x| group.momentum(&x.q.fixed(), &x.p.fixed())),
            None => rows,
        };
        let all = problem.by(by).steps(steps).with_conformal_factor().observe(&mut rows).run(until).unwrap();
        assert_eq!((nothing.status, all.status), (Status::Completed, Status::Completed), "{by}");
        assert_eq!((&nothing.q, &nothing.p), (&all.q, &all.p), "{by}");
        assert_eq!((nothing.z, nothing.log_factor), (None, None));
        // 0, 7, ..., 196, 200.
        let rows = rows.rows;
        assert_eq!((rows.len(), rows.last().map(|row| (&row.q, row.z))), (30, Some((&all.q, all.z))));
        assert!(all.z.is_some() && all.log_factor.is_some());
        assert!(nothing.evaluations > 0 || by == gauss(16));
        // Rows without the action do not request it.
        let mut bare = Rows::every(7).unwrap().without_action();
        let observed = problem.by(by).steps(steps).without_action().observe(&mut bare).run(until).unwrap();
        assert_eq!(observed, nothing, "{by}");
        assert!(bare.rows.iter().zip(&rows).all(|(a, b)| (&a.q, &a.p, a.z) == (&b.q, &b.p, None)), "{by}");
    }
    let nystrom = AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6);
    let drift_first = AnyIntegrator::Splitting(SplittingScheme::BLANES_CASAS_8);
    let composition = AnyIntegrator::Splitting(SplittingScheme::KAHAN_LI_8);
    for by in
        [gauss(3), gauss(8), gauss(16), nystrom, drift_first, composition, AnyIntegrator::Discrete(Method::Midpoint)]
    {
        compare(&pendulum, start(), by, None);
        compare(&kepler, kepler.initial(), by, Some(Symmetry::Rotation(0, 1)));
        if by != nystrom && by != drift_first {
            compare(&square, start(), by, None);
        }
    }
}

/// The conformal factor of a whole motion is `e^(gamma t)` under linear drag, and is the factor of the momenta of
/// symmetries.
#[test]
fn the_conformal_factor() {
    let kepler = Kepler::<2> { mu: 1.0, gamma: -0.05 };
    let problem = Problem::new(&kepler, 0.0, kepler.initial()).unwrap();
    let nystrom = AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6);
    for by in [gauss(6), nystrom, AnyIntegrator::Composition(Method::Midpoint, SplittingScheme::KAHAN_LI_8)] {
        let group = Symmetry::<2>::Rotation(0, 1);
        let mut rows = Rows::every(10).unwrap().column("J", |_, x| group.momentum(&x.q.fixed(), &x.p.fixed()));
        // This observer requests the factor.
        let mut decay = MomentumDecay::new(Symmetry::<2>::Rotation(0, 1));
        let run = problem.by(by).steps(Steps::Size(0.05)).observe(&mut rows).observe(&mut decay);
        let outcome = run.run(Until::Time(4.0)).unwrap();
        let Some(factor) = outcome.log_factor.map(f64::exp) else { panic!("{by}: no factor") };
        assert!((factor - (-0.2f64).exp()).abs() < 1e-9, "{by}: {factor}");
        let momenta: Vec<f64> = rows.rows.iter().map(|row| row.columns[0]).collect();
        assert_eq!(momenta.len(), 9);
        // 80 steps of some roundings each.
        let bound = 80.0 * 16.0 * f64::EPSILON;
        assert!((momenta[8] - factor * momenta[0]).abs() <= bound, "{by}: {momenta:?} {factor}");
        assert_eq!((decay.rows.len(), decay.rows[80].momentum), (81, momenta[8]));
        assert!(decay.rows.iter().all(|row| row.defect() * row.momentum.abs() <= bound), "{by}: {decay:?}");
    }
}

/// The factor of a long run underflows, and its logarithm does not.
#[test]
fn the_factor_of_a_long_run_has_a_logarithm() {
    let pendulum = one(Pendulum { gamma: -1.0 });
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let run = problem.by(gauss(4)).steps(Steps::Count(8000)).with_conformal_factor();
    let outcome = run.run(Until::Time(800.0)).unwrap();
    let Some(log_factor) = outcome.log_factor else { panic!("no factor") };
    assert_eq!((outcome.status, log_factor.exp()), (Status::Completed, 0.0));
    // 8000 roundings of a factor of about one.
    assert!((log_factor + 800.0).abs() <= 8000.0 * 16.0 * f64::EPSILON, "{log_factor}");
}

/// A plan describes what it computes and skips, as follows from the structure and the outputs.
#[test]
fn plans_in_words() {
    let (pendulum, oscillator) = (one(Pendulum::default()), one(HarmonicOscillator::default()));
    let (square, double) = (one(QuadraticInZ::default()), two(DoublePendulum::default()));
    let (until, of_pendulum, of_square) = (Until::Time(10.0), from_start(&pendulum), from_start(&square));
    let plan = ten_steps(&of_pendulum, gauss(8)).without_action().plan(until).unwrap();
    for skipped in ["action z", "conformal factor", "mass matrix", "Jacobian", "Newton's method", "time at the stages"]
    {
        assert!(titles(&plan, false).contains(&skipped), "{skipped}: {plan}");
    }
    assert_eq!(titles(&plan, true), ["iteration", "checks of the structure"]);
    let text = plan.to_string();
    assert!(text.starts_with("10 steps of 1 by gauss_8, t = 0 .. 10\ncomputed:\n  iteration: "), "{text}");
    assert!(
        text.contains("and z is not requested\n")
            && text.contains("conformal factor: not requested; sigma_d is the same"),
        "{text}"
    );
    let back = ten_steps(&of_pendulum, gauss(8)).plan(Until::Time(-10.0)).unwrap().to_string();
    assert!(back.starts_with("10 steps of -1 by gauss_8, t = 0 .. -10\n"), "{back}");

    // The action is computed where it is requested, and where the motion depends on it.
    let plan = ten_steps(&of_pendulum, gauss(8)).plan(until).unwrap();
    assert!(titles(&plan, true).contains(&"action z"));
    let plan = ten_steps(&of_square, gauss(8)).without_action().plan(until).unwrap();
    assert!(titles(&plan, true).contains(&"action z"));
    // Quantities that an observer requests are computed.
    let mut rows = Rows::every(1).unwrap();
    let plan = ten_steps(&of_pendulum, gauss(8)).without_action().observe(&mut rows).plan(until).unwrap();
    assert!(titles(&plan, true).contains(&"action z"));
    let mut decay = MomentumDecay::new(Symmetry::<1>::Translation([1.0].into()));
    let plan = ten_steps(&of_pendulum, gauss(8)).without_action().observe(&mut decay).plan(until).unwrap();
    assert_eq!(titles(&plan, true), ["iteration", "conformal factor", "checks of the structure"]);
    // A linear motion needs no iteration, and a mass matrix that varies is evaluated.
    let of_oscillator = from_start(&oscillator);
    assert!(titles(&ten_steps(&of_oscillator, gauss(8)).plan(until).unwrap(), false).contains(&"iteration"));
    let of_double = Problem::new(&double, 0.0, DoublePendulum::default().initial()).unwrap();
    assert!(titles(&ten_steps(&of_double, gauss(8)).plan(until).unwrap(), true).contains(&"mass matrix"));
    // Splittings are explicit, and discrete flows are not.
    for (by, computed) in [
        (AnyIntegrator::Splitting(SplittingScheme::STRANG), false),
        (AnyIntegrator::Discrete(Method::Strang), false),
        (AnyIntegrator::Discrete(Method::Midpoint), true),
    ] {
        let plan = ten_steps(&of_pendulum, by).plan(until).unwrap();
        assert!(titles(&plan, computed).contains(&"Newton's method"), "{plan}");
    }
}

/// The step that is chosen for a requested accuracy keeps it, and is at most moderately finer than necessary.
#[test]
fn steps_from_an_error() {
    let pendulum = one(Pendulum { gamma: -0.05 });
    let (problem, until) = (from_start(&pendulum), Until::Time(20.0));
    let truth = legendre(&pendulum, 20.0, &motion(&pendulum, 0.0, &start(), 20.0));
    let size = (truth.q.norm_squared() + truth.p.norm_squared()).sqrt();
    for by in [
        gauss(2),
        gauss(6),
        AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6),
        AnyIntegrator::Discrete(Method::Midpoint),
    ] {
        for wanted in [1e-3, 1e-6] {
            let plan = problem.by(by).accuracy(wanted).plan(until).unwrap();
            let outcome = plan.run().unwrap();
            let error = ((outcome.q - truth.q).norm_squared() + (outcome.p - truth.p).norm_squared()).sqrt() / size;
            assert!(error <= wanted, "{by}: {error:e} for {wanted:e}");
            assert_eq!((outcome.steps, outcome.steps as f64 * plan.step_size()), (plan.count(), 20.0));
            let coarser = problem.by(by).steps(Steps::Count(plan.count() / 4)).run(until).unwrap();
            let error = ((coarser.q - truth.q).norm_squared() + (coarser.p - truth.p).norm_squared()).sqrt() / size;
            assert!(error > wanted, "{by}: a fourth of the steps would do, {error:e} for {wanted:e}");
        }
    }
    let refused = problem.by(gauss(8)).accuracy(1e-30).plan(until).err();
    let Some(InputError::Accuracy { wanted: 1e-30, reached, cause: SelectionFailure::RoundOff }) = refused else {
        panic!("{refused:?}")
    };
    assert!(reached < 1e-12, "{reached:e}");
}

/// A run to the time of its start consists of the start alone, by every kind of integrator and of steps, in every kind
/// of rows.
#[test]
fn a_run_to_its_start_is_the_start() {
    let pendulum = one(Pendulum { gamma: -0.1 });
    for t0 in [0.0, 2.5, -1e9] {
        let start = VelocityPoint::new([1.0], [0.5], 0.25);
        let problem = Problem::new(&pendulum, t0, start).unwrap();
        let ways = [
            problem.accuracy(1e-9),
            problem.by(gauss(16)).accuracy(1e-9),
            problem.steps(Steps::Size(0.1)),
            problem.by(AnyIntegrator::Discrete(Method::Midpoint)).steps(Steps::Count(7)),
            problem.by("strang".parse::<AnyIntegrator>().unwrap()).steps(Steps::Size(0.1)),
        ];
        for (k, way) in ways.into_iter().enumerate() {
            let until = if k % 2 == 0 { Until::Time(t0) } else { Until::After(0.0) };
            let (mut every, mut at) = (Rows::every(3).unwrap(), Rows::at([t0]).unwrap());
            let mut events = Events::new([Event::new(|_, x| x.q[0] - 1.0).terminal()]);
            let way = way.with_conformal_factor().with_error_estimate();
            let ended = way.observe(&mut every).observe(&mut at).observe(&mut events).run(until).unwrap();
            assert_eq!((ended.status, ended.steps, ended.t, ended.unresolved), (Status::Completed, 0, t0, None), "{k}");
            assert_eq!(
                (ended.q, ended.p, ended.z),
                (problem.state().q.into(), problem.state().p.into(), Some(0.25)),
                "{k}"
            );
            assert_eq!((ended.log_factor, ended.error_estimate), (Some(0.0), Some(0.0)), "{k}");
            assert_eq!((every.rows.len(), at.rows.len(), events.crossings.len()), (1, 1, 0), "{k}");
            assert_eq!((every.rows[0].t, every.rows[0].q.clone()), (t0, start.q.into()), "{k}");
        }
    }
    // Other invalid input is still refused.
    let problem = from_start(&pendulum);
    assert!(problem.accuracy(-1.0).plan(Until::Time(0.0)).is_err());
    assert!(problem.steps(Steps::Size(0.0)).plan(Until::Time(0.0)).is_err());
}

/// `-cos(v) - x/10`: many velocities have the momentum sin(v). From v = 4 the motion has pi/2 < v < 3 pi/2.
#[derive(Clone, Copy, Debug)]
pub struct ManyVelocities;

impl Lagrangian<1> for ManyVelocities {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        -v[0].cos() - q[0] * 0.1
    }
}

/// Rows, energies, events and a continued run have the velocity of the motion, and not another one of the same
/// momentum: also far from the start, between the steps, and by methods of each kind.
#[test]
fn the_velocity_is_that_of_the_motion() {
    // p = sin(4) - t/10 and v = pi - arcsin(p); the energy p v - L is conserved.
    let p = |t: f64| 4f64.sin() - 0.1 * t;
    let v = |t: f64| PI - p(t).asin();
    // The integral of arcsin(p) over p is p arcsin(p) + sqrt(1 - p^2).
    let integral = |p: f64| p * p.asin() + (1.0 - p * p).sqrt();
    let q = |t: f64| PI * t + 10.0 * (integral(p(t)) - integral(p(0.0)));
    let energy = 4.0 * 4f64.sin() + 4f64.cos();
    // The error of order two with 400 steps, for a motion of size 60 near the end of the branch.
    for (by, bound) in [(gauss(2), 1e-6), (gauss(8), 1e-11), (AnyIntegrator::Discrete(Method::Midpoint), 2e-3)] {
        let system = One::from(ManyVelocities);
        let problem = Problem::new(&system, 0.0, VelocityPoint::new([0.0], [4.0], 0.0)).unwrap();
        let times: Vec<f64> = (0..=70).map(|k| -0.2377 * f64::from(k)).collect();
        let mut rows = Rows::at(times).unwrap().with_velocity().with_energy();
        let mut lines = Events::new([Event::new(|_, x| x.q[0] + 30.0)]);
        let run = problem.by(by).steps(Steps::Count(400));
        let ended = run.observe(&mut rows).observe(&mut lines).run(Until::Time(-16.8)).unwrap();
        assert_eq!((ended.status, rows.rows.len(), lines.crossings.len()), (Status::Completed, 71, 1), "{by}");
        for row in &rows.rows {
            let off = [row.q[0] - q(row.t), row.v.as_ref().unwrap()[0] - v(row.t), row.energy.unwrap() - energy];
            assert!(off.iter().all(|off| off.abs() <= bound), "{by} at {}: {off:?}", row.t);
        }
        let crossing = &lines.crossings[0];
        assert!((q(crossing.t) + 30.0).abs() <= bound, "{by}: {crossing:?}");
        let there = ended.v.unwrap();
        assert!((there[0] - v(-16.8)).abs() <= bound, "{by}: {there:?}");
        // A run from the end continues with the velocity there.
        let state = PhasePoint { q: ended.q.fixed(), p: ended.p.fixed(), z: ended.z.unwrap() };
        let onward = Problem::new(&system, ended.t, discrete_herglotz::Start::Momentum(state, there.fixed())).unwrap();
        let onward = onward.by(by).steps(Steps::Count(20)).run(Until::Time(-17.0)).unwrap();
        assert!((onward.q[0] - q(-17.0)).abs() <= bound, "{by}: {onward:?}");
    }
}

/// Invalid input is refused before work begins, with an error that names it.
#[test]
fn bad_runs() {
    let (pendulum, square) = (one(Pendulum::default()), one(QuadraticInZ::default()));
    let (problem, until) = (from_start(&pendulum), Until::Time(1.0));
    let by = |integrator| ten_steps(&problem, integrator).plan(until).err();
    let steps = |steps| problem.steps(steps).plan(until).err();
    assert_eq!(by(gauss(0)), Some(InputError::Stages { found: 0 }));
    assert_eq!(by(gauss(17)), Some(InputError::Stages { found: 17 }));
    let over = |span| ten_steps(&problem, gauss(4)).plan(Until::Time(span)).err();
    for span in [f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(over(span), Some(InputError::Span { span }));
    }
    assert!(matches!(over(f64::NAN), Some(InputError::Span { .. })));
    for h in [0.0, -0.1, f64::INFINITY] {
        assert_eq!(steps(Steps::Size(h)), Some(InputError::Step { h }));
    }
    assert!(matches!(steps(Steps::Count(0)), Some(InputError::Count { found: 0, .. })));
    for wanted in [-1.0, 0.0, f64::INFINITY] {
        assert_eq!(problem.accuracy(wanted).plan(until).err(), Some(InputError::Tolerance { wanted }));
    }
    // A run of a number of steps has at least one step, whose size is given.
    let until_steps = |steps: Steps, count: usize| problem.steps(steps).plan(Until::Steps(count)).err();
    assert!(matches!(until_steps(Steps::Size(0.1), 0), Some(InputError::Count { found: 0, .. })));
    assert!(matches!(until_steps(Steps::Count(10), 10), Some(InputError::Hypothesis { .. })));
    let accurate = problem.accuracy(1e-6).plan(Until::Steps(10)).err();
    assert!(matches!(accurate, Some(InputError::Hypothesis { .. })));
    // A run needs steps, and given steps need an integrator.
    assert_eq!(problem.by(gauss(4)).plan(until).err(), Some(InputError::NoSteps));
    assert_eq!(problem.accuracy(1e-6).steps(Steps::Count(4)).plan(until).err(), Some(InputError::NoIntegrator));
    // More steps than distinct times, and more rows than fit in memory.
    for many in [Steps::Size(1e-300), Steps::Size(1e-17), Steps::Count(usize::MAX), Steps::Count(1 << 61)] {
        assert!(matches!(steps(many), Some(InputError::TooMany { .. })), "{many:?}");
    }
    let mut all = Rows::every(1).unwrap();
    let many = problem.steps(Steps::Count(1 << 40)).observe(&mut all).run(until);
    assert!(matches!(many.err(), Some(InputError::TooMany { what: "the number of rows", .. })));
    assert!(matches!(Rows::every(0).err(), Some(InputError::Count { found: 0, .. })));
    let nowhere = VelocityPoint::new([f64::NAN], [0.0], 0.0);
    assert!(matches!(Problem::new(&pendulum, 0.0, nowhere).err(), Some(InputError::Geometry(_))));
    // The error names the hypothesis.
    let nystrom = AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6);
    let of_pendulum = |structure| One::from(WithStructure(OneCoordinate::from(Pendulum::default()), structure));
    let unclaimed = of_pendulum(Structure::default());
    let refused = ten_steps(&from_start(&unclaimed), nystrom).plan(until).err();
    assert_eq!(refused, Some(InputError::Unclaimed { claim: "separable" }));
    let refused = ten_steps(&from_start(&square), nystrom).plan(until).err();
    assert_eq!(refused, Some(InputError::Unclaimed { claim: "z_affine" }));
    let of_nystrom = AnyIntegrator::Composition(Method::Midpoint, SplittingScheme::BLANES_MOAN_6);
    assert!(matches!(by(of_nystrom), Some(InputError::Hypothesis { .. })));
    let of_rectangle = AnyIntegrator::Composition(Method::Rectangle, SplittingScheme::YOSHIDA_4);
    assert!(matches!(by(of_rectangle), Some(InputError::Hypothesis { .. })));
    // A false property is found when the structure is checked.
    let quadratic = of_pendulum(Structure { quadratic: true, ..pendulum.structure() });
    let refused = Problem::new(&quadratic, 0.0, start()).err();
    assert!(matches!(refused, Some(InputError::FalseClaim { claim: "quadratic", .. })));
}

/// A run to a time before its start runs backward on the same motion.
#[test]
fn a_span_may_be_negative() {
    let pendulum = one(Pendulum::default());
    let back = ten_steps(&from_start(&pendulum), gauss(8)).run(Until::Time(-1.0)).unwrap();
    assert_eq!((back.status, back.unresolved, back.steps, back.t), (Status::Completed, None, 10, -1.0));
    let truth = legendre(&pendulum, -1.0, &herglotz_flow(&pendulum, 0.0, &start(), -1.0).unwrap().end);
    let off = ChartVector::from(back.state().fixed::<1>()).minus(truth.into()).max_abs_or_nan();
    assert!(off <= 1e-14, "{off:e}");
    assert!(back.v.as_ref().is_some_and(|v| (v - truth.p).amax() <= 1e-14), "{:?}", back.v);
}

/// A problem from two points starts as the flow of their discrete Lagrangian does; points that determine no start are
/// refused.
#[test]
fn from_two_points() {
    let pendulum = one(Pendulum::default());
    let ld = Rule::MIDPOINT.of(&pendulum, 0.1).unwrap();
    let points = DiscretePoint::new([0.3], [0.35], 0.1);
    let problem = Problem::from_points(&pendulum, &ld, 0.5, points).unwrap();
    let flow = Flow::from_points(&ld, 0.5, points).unwrap();
    assert_eq!(problem.state(), flow.state());
    assert_eq!((problem.start().q, problem.start().z), (points.q0, points.z0));
    // Its first step by the same rule ends at the second point.
    let run = problem.by(AnyIntegrator::Discrete(Method::Midpoint)).steps(Steps::Size(0.1));
    let first = run.run(Until::Steps(1)).unwrap();
    assert!((&first.q - points.q1).amax() <= 4.0 * f64::EPSILON, "{:?}", first.q);
    let not_finite = DiscretePoint::new([0.3], [f64::NAN], 0.1);
    let refused = Problem::from_points(&pendulum, &ld, 0.5, not_finite).err();
    assert!(matches!(refused, Some(InputError::Geometry(_))), "{refused:?}");
}

/// Names are parsed back; the error for an unknown name lists those that exist.
#[test]
fn names() {
    let strang = AnyIntegrator::Discrete(Method::Strang).to_string();
    assert_eq!(strang.parse(), Ok(AnyIntegrator::Splitting(SplittingScheme::STRANG)));
    for integrator in AnyIntegrator::all() {
        assert_eq!(integrator.to_string().parse(), Ok(integrator));
        let text = serde_json::to_string(&integrator).unwrap();
        assert_eq!(text, format!("\"{integrator}\""));
        assert_eq!(serde_json::from_str::<AnyIntegrator>(&text).unwrap(), integrator);
        assert!(integrator.order() >= 1);
    }
    for scheme in SplittingScheme::ALL {
        let composed = AnyIntegrator::Composition(Method::Trapezoidal, scheme);
        assert_eq!(composed.to_string().parse(), Ok(composed));
    }
    assert!("trapezoidal_by_none".parse::<AnyIntegrator>().is_err());
    assert!(serde_json::from_str::<AnyIntegrator>("\"gauss_17\"").unwrap_err().to_string().contains("gauss_16"));
    let error = "gauss_17".parse::<AnyIntegrator>().err().map(|e| e.to_string()).unwrap_or_default();
    for known in ["midpoint", "gauss_16", "transformed_gauss_8", "kahan_li_8", "midpoint_by_yoshida_4"] {
        assert!(error.contains(known), "{error}");
    }
}
