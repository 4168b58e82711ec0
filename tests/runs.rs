//! Scenes: plans that say what they do, outcomes that do not depend on the route, bad input.

use crate::common::oracle::motion;
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{
    DoublePendulum, Duffing, HarmonicOscillator, Kepler, Pendulum, QuadraticInZ, System, SystemVisitor,
};
use contact_geom::{Lagrangian, Larger, Largest, Scalar, Structure, Symmetry, VelocityPoint, legendre};
use discrete_herglotz::{
    InputError, Integrator, Method, Obstacle, Outcome, Plan, Scene, SplittingScheme, Status, Steps, Wanted,
};

/// A system that claims another structure.
struct Claiming<S>(S, Structure);

impl<const N: usize, S: Lagrangian<N>> Lagrangian<N> for Claiming<S> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    fn structure(&self) -> Structure {
        self.1
    }
}

const START: [f64; 3] = [1.0, 1.0, 0.2];

fn start() -> VelocityPoint<1> {
    VelocityPoint::new([START[0]], [START[1]], START[2])
}

fn gauss(stages: usize) -> Integrator {
    Integrator::Gauss { stages }
}

/// The titles of what a plan computes, and of what it skips.
fn said<L: Lagrangian<N>, const N: usize>(plan: &Plan<'_, L, N>, computed: bool) -> Vec<&'static str> {
    plan.items().iter().filter(|item| item.computed == computed).map(|item| item.what).collect()
}

/// Every integrator that applies to a system of each kind leads to the motion that an independent code finds: to the error that its order
/// allows, with steps of 1/32, times a constant that the systems' fastest scales explain.
#[test]
fn every_integrator() {
    struct Visitor(usize);
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let (t0, initial) = (system.initial_time(), system.initial());
            let truth = legendre(system, t0 + 0.5, &motion(system, t0, &initial, 0.5));
            for integrator in Integrator::all() {
                if integrator.check(system).is_err() {
                    continue;
                }
                // In Kepler's problem from this start 1/32 of the clock's time is less than that of time.
                let by_clock = matches!(integrator, Integrator::Clocked { .. });
                let steps = if by_clock { Steps::Size(0.5 / 16.0) } else { Steps::Count(16) };
                let scene = Scene::new(system, initial, 0.5).from_time(t0).by(integrator).steps(steps);
                let outcome = scene.plan().and_then(|plan| plan.run());
                let Ok(Outcome { status: Status::Completed, q, p, z: Some(z), .. }) = outcome else {
                    // A constant rate is claimed by none, and verified when the plan is made.
                    let refused = matches!(outcome, Err(InputError::Hypothesis { .. }));
                    assert!(refused, "{} by {integrator}: {outcome:?}", system.name());
                    continue;
                };
                let size = truth.q.largest().larger(truth.p.largest()).larger(truth.z.abs());
                let error = (q - truth.q).largest().larger((p - truth.p).largest()).larger((z - truth.z).abs()) / size;
                let bound = (1.0f64 / 4.0).powi(integrator.order().min(10) as i32).larger(1e-8);
                assert!(error <= bound, "{} by {integrator}: {error:e}, not {bound:e}", system.name());
                self.0 += 1;
            }
        }
    }
    // Each system is compiled with every method: one of each kind of structure.
    let mut visitor = Visitor(0);
    visitor.visit(&HarmonicOscillator::default());
    visitor.visit(&Duffing::forced());
    visitor.visit(&QuadraticInZ::default());
    visitor.visit(&Kepler::<2>::default());
    visitor.visit(&DoublePendulum::default());
    // The rules, the Gauss methods and the compositions apply to all.
    assert!(visitor.0 >= 5 * 25, "{}", visitor.0);
}

/// The same numbers to the last bit, whatever else is wanted: with rows, the action and the factor, or without.
#[test]
fn what_is_left_out_changes_nothing() {
    let (pendulum, square, kepler) = (Pendulum { gamma: -0.1 }, QuadraticInZ { c: 0.3 }, Kepler::<2>::default());
    fn compare<L: Lagrangian<N>, const N: usize>(
        lagrangian: &L,
        start: VelocityPoint<N>,
        by: Integrator,
        group: Option<Symmetry<N>>,
    ) {
        let run = |wanted: Wanted<N>| {
            let scene = Scene::new(lagrangian, start, 10.0).by(by).steps(Steps::Count(200)).wanting(wanted);
            scene.plan().and_then(|plan| plan.run())
        };
        let nothing = run(Wanted { action: false, ..Wanted::default() });
        let all = run(Wanted { action: true, conformal_factor: true, rows: Some(7), momentum: group });
        let (Ok(nothing), Ok(all)) = (nothing, all) else { panic!("{by}: a run was refused") };
        assert_eq!((nothing.status, all.status), (Status::Completed, Status::Completed), "{by}");
        assert_eq!((nothing.q, nothing.p), (all.q, all.p), "{by}");
        assert_eq!((nothing.z, nothing.conformal_factor, nothing.rows.len()), (None, None, 0));
        // 0, 7, ..., 196, 200.
        assert_eq!((all.rows.len(), all.rows.last().map(|row| row.q)), (30, Some(all.q)));
        assert!(all.z.is_some() && all.conformal_factor.is_some());
        assert!(nothing.evaluations > 0 || by == gauss(16));
    }
    let nystrom = Integrator::Splitting(SplittingScheme::BLANES_MOAN_6);
    let drift_first = Integrator::Splitting(SplittingScheme::BLANES_CASAS_8);
    let composition = Integrator::Splitting(SplittingScheme::KAHAN_LI_8);
    for by in [gauss(3), gauss(8), gauss(16), nystrom, drift_first, composition, Integrator::Discrete(Method::Midpoint)]
    {
        compare(&pendulum, start(), by, None);
        compare(&kepler, kepler.initial(), by, Some(Symmetry::Rotation(0, 1)));
        if by != nystrom && by != drift_first {
            compare(&square, start(), by, None);
        }
    }
}

/// The conformal factor of a whole motion is `e^(gamma t)` under linear drag, and contracts the momenta of symmetries.
#[test]
fn the_conformal_factor() {
    let kepler = Kepler::<2> { mu: 1.0, gamma: -0.05 };
    let nystrom = Integrator::Splitting(SplittingScheme::BLANES_MOAN_6);
    for by in [gauss(6), nystrom, Integrator::Composition(Method::Midpoint, SplittingScheme::KAHAN_LI_8)] {
        let wanted = Wanted {
            conformal_factor: true,
            rows: Some(10),
            momentum: Some(Symmetry::Rotation(0, 1)),
            ..Wanted::default()
        };
        let scene = Scene::new(&kepler, kepler.initial(), 4.0).by(by).steps(Steps::Size(0.05)).wanting(wanted);
        let Ok(outcome) = scene.plan().and_then(|plan| plan.run()) else { panic!("{by}: refused") };
        let Some(factor) = outcome.conformal_factor else { panic!("{by}: no factor") };
        assert!((factor - (-0.2f64).exp()).abs() < 1e-9, "{by}: {factor}");
        let momenta: Vec<f64> = outcome.rows.iter().filter_map(|row| row.momentum).collect();
        assert_eq!(momenta.len(), 9);
        // 80 steps of some roundings each.
        assert!((momenta[8] - factor * momenta[0]).abs() <= 80.0 * 16.0 * f64::EPSILON, "{by}: {momenta:?} {factor}");
    }
}

/// A plan says what it skips and why; what it says follows from structure and outputs.
#[test]
fn plans_in_words() {
    let (pendulum, oscillator) = (Pendulum::default(), HarmonicOscillator::default());
    let (square, double) = (QuadraticInZ::default(), DoublePendulum::default());
    let nothing = || Wanted { action: false, ..Wanted::default() };
    let plan = Scene::new(&pendulum, start(), 10.0).by(gauss(8)).steps(Steps::Count(10)).wanting(nothing()).plan();
    let Ok(plan) = plan else { panic!("refused") };
    for skipped in ["action z", "conformal factor", "mass matrix", "Jacobian", "Newton's method", "rows", "momentum"] {
        assert!(said(&plan, false).contains(&skipped), "{skipped}: {plan}");
    }
    assert_eq!(said(&plan, true), ["iteration"]);
    let text = plan.to_string();
    assert!(text.starts_with("10 steps of 1 by gauss_8, t = 0 .. 10\ncomputed:\n  iteration: "), "{text}");

    // The action is computed where it is wanted, and where it drives the motion.
    let scene = Scene::new(&pendulum, start(), 10.0).by(gauss(8)).steps(Steps::Count(10));
    assert!(scene.plan().is_ok_and(|plan| said(&plan, true).contains(&"action z")));
    let scene = Scene::new(&square, start(), 10.0).by(gauss(8)).steps(Steps::Count(10)).wanting(nothing());
    assert!(scene.plan().is_ok_and(|plan| said(&plan, true).contains(&"action z")));
    // A linear motion needs no iteration, a mass matrix that varies is computed.
    let scene = Scene::new(&oscillator, start(), 10.0).by(gauss(8)).steps(Steps::Count(10));
    assert!(scene.plan().is_ok_and(|plan| said(&plan, false).contains(&"iteration")));
    let scene = Scene::new(&double, double.initial(), 10.0).by(gauss(8)).steps(Steps::Count(10));
    assert!(scene.plan().is_ok_and(|plan| said(&plan, true).contains(&"mass matrix")));
    // Splittings are explicit, discrete flows are not.
    let strang = Integrator::Splitting(SplittingScheme::STRANG);
    let scene = Scene::new(&pendulum, start(), 10.0).by(strang).steps(Steps::Count(10));
    assert!(scene.plan().is_ok_and(|plan| said(&plan, false).contains(&"Newton's method")));
    let scene = Scene::new(&pendulum, start(), 10.0).by(Integrator::Discrete(Method::Strang)).steps(Steps::Count(10));
    assert!(scene.plan().is_ok_and(|plan| said(&plan, false).contains(&"Newton's method")));
    let scene = Scene::new(&pendulum, start(), 10.0).by(Integrator::Discrete(Method::Midpoint)).steps(Steps::Count(10));
    assert!(scene.plan().is_ok_and(|plan| said(&plan, true).contains(&"Newton's method")));
}

/// The step chosen from a wanted error keeps it, without being far too fine.
#[test]
fn steps_from_an_error() {
    let pendulum = Pendulum { gamma: -0.05 };
    let truth = legendre(&pendulum, 20.0, &motion(&pendulum, 0.0, &start(), 20.0));
    let size = (truth.q.norm_squared() + truth.p.norm_squared()).sqrt();
    for by in [
        gauss(2),
        gauss(6),
        Integrator::Splitting(SplittingScheme::BLANES_MOAN_6),
        Integrator::Discrete(Method::Midpoint),
    ] {
        for wanted in [1e-3, 1e-6] {
            let scene = Scene::new(&pendulum, start(), 20.0).by(by).steps(Steps::Accuracy(wanted));
            let Ok(plan) = scene.plan() else { panic!("{by}: refused") };
            let Ok(outcome) = plan.run() else { panic!("{by}: refused") };
            let error = ((outcome.q - truth.q).norm_squared() + (outcome.p - truth.p).norm_squared()).sqrt() / size;
            assert!(error <= wanted, "{by}: {error:e} for {wanted:e}");
            assert_eq!((outcome.steps, outcome.steps as f64 * plan.step_size()), (plan.count(), 20.0));
            let coarser = Scene::new(&pendulum, start(), 20.0).by(by).steps(Steps::Count(plan.count() / 4));
            let Ok(coarser) = coarser.plan().and_then(|plan| plan.run()) else { panic!("{by}: refused") };
            let error = ((coarser.q - truth.q).norm_squared() + (coarser.p - truth.p).norm_squared()).sqrt() / size;
            assert!(error > wanted, "{by}: a fourth of the steps would do, {error:e} for {wanted:e}");
        }
    }
    let scene = Scene::new(&pendulum, start(), 20.0).by(gauss(8)).steps(Steps::Accuracy(1e-30));
    let refused = scene.plan().err();
    let Some(InputError::Accuracy { wanted: 1e-30, reached, cause: Obstacle::RoundOff }) = refused else {
        panic!("{refused:?}")
    };
    assert!(reached < 1e-12, "{reached:e}");
}

/// Bad input is refused before work starts, with an error that names it.
#[test]
fn bad_scenes() {
    let (pendulum, square) = (Pendulum::default(), QuadraticInZ::default());
    let error = |scene: Scene<'_, Pendulum, 1>| scene.plan().err();
    let scene = || Scene::new(&pendulum, start(), 1.0).steps(Steps::Count(10));
    assert_eq!(error(scene().by(gauss(0))), Some(InputError::Stages { found: 0 }));
    assert_eq!(error(scene().by(gauss(17))), Some(InputError::Stages { found: 17 }));
    for span in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(error(Scene::new(&pendulum, start(), span)), Some(InputError::Span { span }));
    }
    assert!(matches!(error(Scene::new(&pendulum, start(), f64::NAN)), Some(InputError::Span { .. })));
    for h in [0.0, -0.1, f64::INFINITY] {
        assert_eq!(error(scene().steps(Steps::Size(h))), Some(InputError::Step { h }));
    }
    assert!(matches!(error(scene().steps(Steps::Count(0))), Some(InputError::Count { found: 0, .. })));
    for wanted in [-1.0, 0.0, f64::INFINITY] {
        assert_eq!(error(scene().steps(Steps::Accuracy(wanted))), Some(InputError::Tolerance { wanted }));
    }
    // More steps than times can be told apart, and more rows than can be kept.
    for steps in [Steps::Size(1e-300), Steps::Size(1e-17), Steps::Count(usize::MAX), Steps::Count(1 << 61)] {
        assert!(matches!(error(scene().steps(steps)), Some(InputError::TooMany { .. })), "{steps:?}");
    }
    let many_rows = Wanted { rows: Some(1), ..Wanted::default() };
    let run = scene().steps(Steps::Count(1 << 40)).wanting(many_rows).plan().and_then(|plan| plan.run());
    assert!(matches!(run.err(), Some(InputError::TooMany { what: "the number of rows", .. })));
    let no_rows = Wanted { rows: Some(0), ..Wanted::default() };
    assert!(matches!(error(scene().wanting(no_rows)), Some(InputError::Count { found: 0, .. })));
    let nowhere = VelocityPoint::new([f64::NAN], [0.0], 0.0);
    assert!(matches!(error(Scene::new(&pendulum, nowhere, 1.0).steps(Steps::Count(1))), Some(InputError::Geometry(_))));
    // Hypotheses are named.
    let nystrom = Integrator::Splitting(SplittingScheme::BLANES_MOAN_6);
    let unclaimed = Claiming(pendulum, Structure::default());
    let scene_of = Scene::new(&unclaimed, start(), 1.0).by(nystrom).steps(Steps::Count(10));
    assert_eq!(scene_of.plan().err(), Some(InputError::Unclaimed { claim: "separable" }));
    let scene_of = Scene::new(&square, start(), 1.0).by(nystrom).steps(Steps::Count(10));
    assert_eq!(scene_of.plan().err(), Some(InputError::Unclaimed { claim: "z_affine" }));
    let of_nystrom = Integrator::Composition(Method::Midpoint, SplittingScheme::BLANES_MOAN_6);
    assert!(matches!(error(scene().by(of_nystrom)), Some(InputError::Hypothesis { .. })));
    let of_rectangle = Integrator::Composition(Method::Rectangle, SplittingScheme::YOSHIDA_4);
    assert!(matches!(error(scene().by(of_rectangle)), Some(InputError::Hypothesis { .. })));
    // A false claim is found by the probe.
    let quadratic = Claiming(pendulum, Structure { quadratic: true, ..pendulum.structure() });
    let scene_of = Scene::new(&quadratic, start(), 1.0).by(gauss(4)).steps(Steps::Count(10));
    assert!(matches!(scene_of.plan().err(), Some(InputError::FalseClaim { claim: "quadratic", .. })));
}

/// Names are read back; an unknown one lists those that are known.
#[test]
fn names() {
    for integrator in Integrator::all() {
        assert_eq!(integrator.to_string().parse(), Ok(integrator));
        assert!(integrator.order() >= 1);
    }
    let error = "gauss_17".parse::<Integrator>().err().map(|e| e.to_string()).unwrap_or_default();
    for known in ["midpoint", "gauss_16", "clocked_gauss_8", "kahan_li_8", "midpoint_by_yoshida_4"] {
        assert!(error.contains(known), "{error}");
    }
}
