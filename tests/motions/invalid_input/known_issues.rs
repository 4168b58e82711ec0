//! The limits that `KNOWN_ISSUES.md` lists, each asserted; a limit that no longer holds is removed from both.

use crate::common::gauss::GaussSteppers;
use crate::lagrangians::{One, one, two};
use contact_examples::systems::{DoublePendulum, HarmonicOscillator, Pendulum};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ContactHamiltonian, DiscretePoint, Lagrangian, OfHamiltonian, PhasePoint, Scalar, Structure, VelocityPoint,
};
use discrete_herglotz::{
    AnyIntegrator, Event, Events, Problem, SplittingScheme, Status, StepDetails, Stepper, StepperOptions, Steps, Until,
    gauss::{Gauss, GaussStepper},
    rules::{Composition, Flow, Method, Rule},
};
use std::fs;
use std::path::Path;

/// The page names these tests, and no others.
#[test]
fn the_page_names_its_tests() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("KNOWN_ISSUES.md")).unwrap();
    let here = fs::read_to_string(root.join("tests/motions/invalid_input/known_issues.rs")).unwrap();
    let tests: Vec<&str> = here.lines().filter_map(|l| l.strip_prefix("fn ")?.strip_suffix("() {")).collect();
    assert!(tests.len() > 5);
    for test in tests.iter().filter(|t| **t != "the_page_names_its_tests") {
        assert!(page.contains(&format!("`{test}`")), "KNOWN_ISSUES.md does not name {test}");
    }
    let named = page.split("(`").skip(1).filter_map(|rest| rest.split_once("`)").map(|(name, _)| name));
    for name in named {
        assert!(tests.contains(&name), "KNOWN_ISSUES.md names {name}, which is no test here");
    }
}

/// An oscillator with a pulse of force.
#[derive(Clone, Copy, Debug)]
pub struct Pulse {
    height: f64,
    width: f64,
}

impl Lagrangian<1> for Pulse {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let u = (t - 1.01) / self.width;
        v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 + (-(u * u)).exp() * q[0] * self.height - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { z_affine: true, constant_rate: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// The position after two units of time.
fn position(system: &One, integrator: AnyIntegrator, steps: usize) -> f64 {
    let problem = Problem::new(system, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let outcome = problem.by(integrator).steps(Steps::Count(steps)).run(Until::Time(2.0)).unwrap();
    assert_eq!(outcome.status, Status::Completed);
    outcome.q[0]
}

#[test]
fn fixed_steps_pass_over_what_is_narrower() {
    let pulse = Pulse { height: 300.0, width: 1e-3 };
    let (pulse, quiet) = (One::from(pulse), One::from(Pulse { height: 0.0, ..pulse }));
    for integrator in [AnyIntegrator::Gauss { stages: 4 }, AnyIntegrator::Splitting(SplittingScheme::STRANG)] {
        // None of the points of four steps is within forty widths of the pulse, which changes the motion by half a
        // unit.
        assert_eq!(position(&pulse, integrator, 4), position(&quiet, integrator, 4));
        let seen = position(&pulse, integrator, 20_000) - position(&quiet, integrator, 20_000);
        assert!(seen.abs() > 0.3, "{seen}");
    }
}

#[test]
fn a_pulse_between_the_nodes_of_a_step_is_not_seen() {
    let pendulum = one(Pendulum::default());
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let found = |h: f64| {
        let mut narrow = Events::new([Event::new(|t, _| if (0.503..0.511).contains(&t) { -1.0 } else { 1.0 })]);
        let run = problem.by(AnyIntegrator::Gauss { stages: 2 }).steps(Steps::Size(h)).observe(&mut narrow);
        assert_eq!(run.run(Until::Time(0.8)).unwrap().status, Status::Completed);
        narrow.crossings.len()
    };
    assert_eq!(found(0.4), 0);
    assert_eq!(found(0.005), 2);
}

#[test]
fn dense_output_has_the_order_of_the_stages_between_the_ends() {
    let oscillator = one(HarmonicOscillator { gamma: 0.0 });
    let error = |h: f64, at: f64| {
        let gauss = Gauss::new(oscillator, 3, h).unwrap();
        let mut stepper = gauss.stepper(0.0, PhasePoint::new([1.0], [0.0], 0.0), [0.0].into()).unwrap();
        stepper.advance(1).unwrap();
        (stepper.dense().unwrap().at(at * h).q[0] - (at * h).cos()).abs()
    };
    // The order is 6 at the ends, so that the error of one step has order 7; it is 3 between them, so 4.
    let order = |at: f64| (error(0.4, at) / error(0.2, at)).log2();
    assert!((order(1.0) - 8.0).abs() < 0.5 || (order(1.0) - 7.0).abs() < 0.5, "{}", order(1.0));
    assert!((order(0.3) - 4.0).abs() < 0.5, "{}", order(0.3));
}

#[test]
fn a_composition_takes_its_rule_on_trust() {
    // The rectangle rule has order 1 and is not symmetric: no composition raises its order, and there is no error.
    let oscillator = one(HarmonicOscillator { gamma: 0.0 });
    let error = |steps: usize| {
        let h = 1.0 / steps as f64;
        let start = PhasePoint::new([1.0], [0.0], 0.0);
        let rule = |h| Rule::RECTANGLE.of(oscillator, h);
        let mut run = Composition::new(rule, &SplittingScheme::YOSHIDA_4, h, 0.0, start).unwrap();
        run.advance(steps).unwrap();
        (run.state().q[0] - 1.0f64.cos()).abs()
    };
    let order = (error(100) / error(200)).log2();
    assert!(order < 3.0, "{order}");
}

#[test]
fn two_points_lose_the_digits_that_their_difference_loses() {
    let ld = Rule::MIDPOINT.of(one(Pendulum::default()), 1e-8).unwrap();
    let start = PhasePoint::new([1.0], [0.5], 0.0);
    let mut flow = Flow::new(&ld, 0.0, start).unwrap();
    flow.step().unwrap();
    let x = DiscretePoint { q0: start.q, q1: flow.state().q, z0: start.z };
    let again = Flow::from_points(&ld, 0.0, x).unwrap();
    let lost = (again.state().p[0] - start.p[0]).abs();
    // eps / h = 2e-8, against some 1e-16 in momentum form.
    assert!(lost > 1e-10 && lost < 1e-7, "{lost:e}");
}

#[test]
fn quadrature_rules_have_a_rational_rate() {
    let pendulum = one(Pendulum { gamma: -3.0 });
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let factor = |integrator| {
        let run = problem.by(integrator).steps(Steps::Count(10)).with_conformal_factor();
        run.run(Until::Time(1.0)).unwrap().log_factor.unwrap().exp()
    };
    let exact = (-3.0f64).exp();
    let off = |integrator| (factor(integrator) / exact - 1.0).abs();
    assert!(off(AnyIntegrator::Splitting(SplittingScheme::STRANG)) < 1e-14);
    // The factors of ten steps are (1 + h gamma/2)/(1 - h gamma/2), and 1 + h gamma.
    assert!((off(AnyIntegrator::Discrete(Method::Midpoint)) - 0.0229).abs() < 1e-3);
    assert!(off(AnyIntegrator::Discrete(Method::LeftMidpoint)) > 0.4);
}

#[test]
fn chaos_outgrows_any_accuracy() {
    // A limit of every integrator: over 40 Lyapunov times a change in the last place grows to the size of the motion.
    let run = |q: f64| {
        let pendulum = two(DoublePendulum { gamma: 0.0, ..DoublePendulum::default() });
        let start = VelocityPoint::new([q, 2.0], [0.0, 0.0], 0.0);
        let problem = Problem::new(&pendulum, 0.0, start).unwrap();
        let run = problem.by(AnyIntegrator::Gauss { stages: 8 }).steps(Steps::Count(6000));
        run.run(Until::Time(150.0)).unwrap().q
    };
    let apart = (run(2.5) - run(2.5 + 4.0 * f64::EPSILON)).amax();
    assert!(apart > 1e-9, "{apart:e}");
}

#[test]
fn a_momentum_ends_a_run_whose_positions_continue() {
    struct VanDerPol;
    impl ContactHamiltonian<1> for VanDerPol {
        #[inline(always)]
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
            z * (p[0] + q[0] * q[0] - 1.0) + q[0]
        }
    }
    let hamiltonian = OfHamiltonian(VanDerPol);
    let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, PhasePoint::new([2.0], [0.0], 0.0)).unwrap();
    let options = StepperOptions { action: true, check_resolution: false, ..StepperOptions::default() };
    let mut stepper = GaussStepper::new(&problem, 8, 0.01, options).unwrap();
    let failure = stepper.advance(2000).unwrap_err();
    let state = stepper.state();
    // The momentum has grown, and the motion is on its way to the limit cycle.
    assert!(
        failure.taken < 2000 && state.p[0].abs() > 10.0 && state.q[0].abs() < 3.0 && state.z.abs() < 3.0,
        "{state:?}"
    );
}
