//! Lagrangians with case distinctions, in every instruction set of this processor.

use super::*;
use crate::gauss::Gauss;
use crate::numbers::instructions::Instructions;
use crate::test_lagrangians::{Anharmonic, Cubic, How, InPlane, OnLine, OneSided};
use crate::{DiscreteLagrangian, DiscreteStep, Start as ProblemStart, StepError, solve::Solver};
use contact_examples::systems::{QuadraticInZ, SphericalPendulum, System};
use contact_geom::{PhasePoint, Structure};
use pulp::Arch;
use std::sync::atomic::AtomicUsize;

/// The condensed route and the general one.
fn routes() -> [(GaussRoute, Structure); 2] {
    let condensed = Structure { autonomous: true, separable: true, z_affine: true, ..Structure::default() };
    [(GaussRoute::Condensed, condensed), (GaussRoute::General, Structure::default())]
}

fn instruction_sets() -> Vec<Arch> {
    let mut sets = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    {
        sets.extend(pulp::x86::V3::try_new().map(Arch::V3));
        sets.extend(pulp::x86::V4::try_new().map(Arch::V4));
    }
    sets
}

/// Takes 100 steps from `q < 0` and compares each with the same step over `f64`. Returns the number of steps that cross
/// the kink, and the number solved by a Newton method.
fn follow(spring: OneSided, stages: usize, set: Arch, route: GaussRoute) -> (usize, u64) {
    let spring = OnLine::from(spring);
    let gauss = Gauss::new(&spring, stages, 0.2).unwrap();
    let problem = Problem::new(&spring, 0.0, PhasePoint::new([-0.4], [0.0], 0.0)).unwrap();
    let mut run =
        GaussStepper::new(&problem, stages, 0.2, StepperOptions { action: true, ..StepperOptions::default() }).unwrap();
    assert_eq!(run.route(), route);
    run.steps.route.set_instructions(Instructions::only(set));
    let mut across = 0;
    for _ in 0..100 {
        let (t, from) = (run.time(), run.state().fixed());
        run.advance(1).unwrap();
        let DiscreteStep { end, .. } = gauss.forward(t, &from, &from.p, &mut Solver::default()).unwrap();
        let found = run.state();
        // Some units of round-off of positions, momenta and actions, which are all below 2.
        for (a, b) in [(found.q[0], end.q[0]), (found.p[0], end.p[0]), (found.z, end.z)] {
            assert!((a - b).abs() <= 32.0 * f64::EPSILON, "{set:?}, {gauss:?} at t = {t}: {a} and {b}");
        }
        across += usize::from(from.q[0] * found.q[0] < 0.0);
    }
    (across, run.newton_steps())
}

#[test]
fn what_is_chosen_lane_by_lane_is_what_numbers_choose() {
    for ((route, claims), how) in routes().into_iter().flat_map(|r| [How::Max, How::Select, How::Abs].map(|h| (r, h))) {
        for stages in [2, 5, 8] {
            for set in instruction_sets() {
                let (across, by_newton) = follow(OneSided { how, claims }, stages, set, route);
                assert!(across >= 4, "{across} steps go across the kink");
                assert_eq!(by_newton, 0, "{how:?} {route:?} {set:?}");
            }
        }
    }
}

/// Updating the stage actions with the positions within an iteration saves at least 5 per cent of the evaluations for
/// these motions, and the results agree to the accumulated round-off.
#[test]
fn actions_that_follow_spare_iterations_and_change_nothing() {
    let (steps, start) = (100, PhasePoint::new([1.0], [0.5], 0.8));
    for (stages, h) in [(4, 0.1), (8, 0.5), (8, 1.0), (16, 0.5), (16, 1.0)] {
        let system = OnLine::from(QuadraticInZ::default());
        let problem = Problem::new(&system, 0.0, start).unwrap();
        let [(with, a), (without, b)] = [true, false].map(|follows| {
            let mut run =
                GaussStepper::new(&problem, stages, h, StepperOptions { action: true, ..StepperOptions::default() })
                    .unwrap();
            assert_eq!(run.route(), GaussRoute::ConstantMass);
            if !follows {
                run.steps.route.let_actions_lag();
            }
            run.advance(steps).unwrap();
            assert_eq!(run.newton_steps(), 0);
            (run.evaluations(), run.state())
        });
        assert!(with as f64 <= 0.95 * without as f64, "{stages} stages, h = {h}: {with} for {without} evaluations");
        let tolerance = 4.0 * steps as f64 * f64::EPSILON;
        for (a, b) in [(a.q[0], b.q[0]), (a.p[0], b.p[0]), (a.z, b.z)] {
            assert!((a - b).abs() <= tolerance, "{stages} stages, h = {h}: {a} and {b}");
        }
    }
}

/// A step whose Lagrangian branches on the value of several lanes fails with [`StepError::Branched`]; with a single
/// lane there is a value to branch on.
#[test]
fn lanes_have_no_value_to_branch_on() {
    for (route, claims) in routes() {
        let spring = OneSided { how: How::Branch, claims };
        let system = OnLine::from(spring);
        let problem = Problem::new(&system, 0.0, PhasePoint::new([-0.4], [0.0], 0.0)).unwrap();
        for set in instruction_sets() {
            if matches!(set, Arch::Scalar) {
                assert!(follow(spring, 8, set, route).0 >= 4);
                continue;
            }
            let mut run =
                GaussStepper::new(&problem, 8, 0.2, StepperOptions { action: true, ..StepperOptions::default() })
                    .unwrap();
            run.steps.route.set_instructions(Instructions::only(set));
            assert_eq!(run.advance(3), Err(StepFailure { taken: 0, cause: StepError::Branched }), "{set:?}");
        }
    }
    assert!(StepError::Branched.to_string().contains("if_less"));
}

/// A state that is saved while steps are solved by simplified Newton iteration is restored, with the matrices of the
/// iteration: the motion goes on bitwise as if it had not been interrupted.
#[test]
fn a_state_saved_during_simplified_newton_iteration_is_restored() {
    let system = SphericalPendulum::default();
    let problem = Problem::new(&system, 0.0, system.initial()).unwrap();
    for (stages, h) in [(1, 0.4), (2, 1.5), (8, 1.5)] {
        let options = StepperOptions { action: true, check_resolution: true, ..StepperOptions::default() };
        let new = || GaussStepper::new(&problem, stages, h, options).unwrap();
        let (mut run, mut by_newton) = (new(), 0);
        for _ in 0..30 {
            let mut resumed = new();
            assert!(resumed.restore(&run.save().unwrap()), "{stages} stages, h = {h}");
            let before = run.newton_steps();
            assert_eq!(run.advance(1), resumed.advance(1));
            by_newton += run.newton_steps() - before;
            assert_eq!((run.save(), run.state()), (resumed.save(), resumed.state()), "{stages} stages, h = {h}");
        }
        assert!(by_newton > 3, "{stages} stages, h = {h}: {by_newton} steps by Newton methods");
    }
}

/// The first coordinate after 100 units of time, the iterations per step, and the number of steps by Newton
/// methods.
fn motion<const N: usize>(anharmonic: &impl Lagrangian<N>, stages: usize, h: f64) -> (f64, f64, u64) {
    let start = PhasePoint::new(std::array::from_fn(|i| 1.2 * (i == 0) as u8 as f64), [0.0; N], 0.0);
    let problem = Problem::new(anharmonic, 0.0, start).unwrap();
    let mut run =
        GaussStepper::new(&problem, stages, h, StepperOptions { action: true, ..StepperOptions::default() }).unwrap();
    assert_eq!(run.route(), GaussRoute::Condensed);
    let steps = (100.0 / h).round() as usize;
    run.advance(steps).unwrap();
    let iterations = run.evaluations() as f64 / (stages * steps) as f64;
    (run.state().q[0], iterations, run.newton_steps())
}

/// The motion of one coordinate agrees with the same motion beside a second coordinate at rest, for which no secant
/// steps are taken; it needs fewer iterations, and no more steps by Newton methods. The positions may differ by 500
/// units of round-off after about a hundred oscillations.
#[test]
fn secants_spare_iterations_and_change_nothing() {
    let (alone, accompanied) = (OnLine::from(Anharmonic), InPlane::from(Anharmonic));
    for (stages, h, part) in [(8, 0.25, 0.9), (8, 0.5, 0.85), (16, 0.5, 0.9), (16, 1.0, 0.9)] {
        let ((q, iterations, newton), (beside, more, more_newton)) =
            (motion(&alone, stages, h), motion(&accompanied, stages, h));
        assert!((q - beside).abs() <= 500.0 * f64::EPSILON, "gauss_{stages}, h = {h}: {q:e}, {beside:e}");
        assert!(iterations <= part * more, "gauss_{stages}, h = {h}: {iterations}, {more} iterations");
        assert!(newton <= more_newton, "gauss_{stages}, h = {h}: {newton}, {more_newton} steps by Newton's method");
    }
}

/// A run reports the failure of a step whose equations have no solution, and keeps the state before it.
#[test]
fn a_run_ends_before_the_step_that_has_no_solution() {
    for claims in
        [Structure { autonomous: true, separable: true, z_affine: true, ..Structure::default() }, Structure::default()]
    {
        let cubic = OnLine::from(Cubic { count: AtomicUsize::new(0), claims });
        let start = PhasePoint::new([1.0], [0.5], 0.2);
        let problem = Problem::new(&cubic, 0.0, ProblemStart::Momentum(start, [0.5].into())).unwrap();
        let mut run =
            GaussStepper::new(&problem, 8, 5.0, StepperOptions { action: true, ..StepperOptions::default() }).unwrap();
        let halt = run.advance(3).unwrap_err();
        assert!(halt.taken == 0 && matches!(halt.cause, StepError::NotConverged { .. }), "{halt:?}");
        assert_eq!(run.state(), start);
    }
}
