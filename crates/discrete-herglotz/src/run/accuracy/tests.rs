//! The cost of the step-size selection.

use crate::Problem;
use crate::gauss::GaussStepper;
use crate::run::accuracy::limits::BUDGET;
use crate::run::accuracy::select::select_within_budget;
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::run::request::Request;
use crate::run::{OutputRequest, Until};
use crate::switching::{Collocation, CollocationOf};
use crate::test_lagrangians::{InPlane, OnLine, Unstated};
use crate::{AnyIntegrator, Stepper, StepperOptions};
use contact_examples::systems::{Duffing, Kepler, Pendulum, QuadraticInZ};
use contact_geom::{Lagrangian, VelocityPoint};
use std::borrow::Cow;
use std::sync::Arc;

/// The integrator and the number of steps that are selected for a run, and the cost of the selection.
fn search<L: Lagrangian<N>, const N: usize>(
    problem: &Problem<'_, L, N>,
    span: f64,
    stages: Option<usize>,
    wanted: f64,
) -> (Cow<'static, str>, usize, u64) {
    let collocation: Collocation<'_> = Arc::new(CollocationOf(problem.lagrangian));
    let request = Request {
        problem: problem.of_system(),
        t_end: span,
        span,
        integrator: stages.map(|stages| collocation.gauss(stages)),
        needs: OutputRequest::default(),
        scales: None,
        parts: None,
        ends_only: false,
    };
    let mut trials = TrialRuns::new(&request, wanted, collocation);
    let selection = select_within_budget(&mut trials).unwrap();
    (selection.integrator.info().name, selection.count, BUDGET - trials.left)
}

/// Trial runs cost a small multiple of the run: there are those with k, 2k and k + 1 steps, one with 4k if the first
/// two do not agree, and before them one that ends because its defect is too large. The run has more than k steps, or
/// more than 1.2 k.
#[test]
fn trial_runs_cost_little() {
    let pendulum = OnLine::from(Pendulum { gamma: -0.01 });
    for (span, wanted) in [(30.0, 1e-4), (30.0, 1e-7), (100.0, 1e-9), (300.0, 1e-6), (1000.0, 1e-8)] {
        let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0)).unwrap();
        let (_, count, spent) = search(&problem, span, None, wanted);
        let run = problem.accuracy(wanted).run(Until::Time(span)).unwrap();
        assert_eq!(count, run.steps);
        // The cost of the defect samples is twice the number of their points, of which there are at least 2000 in
        // addition to those of the steps.
        let (spent, sampled) = (spent as f64, 2.5 * 2.0 * 2000.0);
        // The shortest run after trial runs with k, k + 1 and 2k steps has 0.6 k steps, and a first trial run may have
        // failed.
        let most = 10.0 * run.evaluations as f64 + sampled;
        assert!(spent <= most, "{span}, {wanted:e}: {spent} evaluations for {}", run.evaluations);
    }
}

/// Runs with many steps that iterate only the accelerations use sixteen stages, and less than half as many steps; short
/// runs, and runs that would need Newton's method, do not.
#[test]
fn long_motions_take_more_stages() {
    let selected_for = |system: &OnLine, integrator: Option<AnyIntegrator>, span, wanted| {
        let problem = Problem::new(system, 0.0, VelocityPoint::new([1.0], [0.5], 0.0)).unwrap();
        let run = problem.accuracy(wanted);
        let run = if let Some(by) = integrator { run.by(by) } else { run };
        let plan = run.plan(Until::Time(span)).unwrap();
        (plan.integrator().name.to_string(), plan.count())
    };
    let selected = |system: &OnLine, integrator, span| selected_for(system, integrator, span, 1e-7);
    let pendulum = OnLine::from(Pendulum { gamma: -0.01 });
    let (name, ours) = selected(&pendulum, None, 1000.0);
    let (_, of_eight) = selected(&pendulum, Some(AnyIntegrator::Gauss { stages: 8 }), 1000.0);
    assert_eq!(name, "gauss_16");
    assert!(2 * ours < of_eight, "{ours} steps, {of_eight} with eight stages");
    assert_eq!(selected(&pendulum, None, 10.0).0, "gauss_8");
    assert_eq!(selected_for(&pendulum, None, 10.0, 1e-9).0, "gauss_12");
    // Where the forced double well is steepest, the iteration of a long step does not contract.
    assert_eq!(selected(&Duffing::forced().into(), None, 100.0).0, "gauss_8");
}

/// If steps that are short enough for the error need Newton's method, and steps of half the size rarely do, the latter
/// are taken.
#[test]
fn steps_that_cost_less_are_taken() {
    let system = OnLine::from(QuadraticInZ { c: -0.05 });
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [0.0], 1.0)).unwrap();
    let (_, count, _) = search(&problem, 100.0, None, 1e-3);
    let newton_steps = |count: usize| {
        let mut run = GaussStepper::new(&problem, 8, 100.0 / count as f64, StepperOptions::default()).unwrap();
        run.advance(count).unwrap();
        run.newton_steps()
    };
    let (ours, longer) = (newton_steps(count), newton_steps(count / 2));
    assert!(3 * ours < longer, "{ours} of {count} steps, {longer} of {}", count / 2);
}

/// Trial runs in transformed time cost a small multiple of the run too. If transformed time has no advantage, testing
/// it costs nothing: the cost equals that for the given integrator.
#[test]
fn trial_runs_in_transformed_time_cost_little() {
    let kepler = InPlane::from(Kepler { gamma: 0.0, mu: 1.0 });
    for e in [0.0, 0.1, 0.6, 0.9, 0.99] {
        for apocentre in [false, true] {
            let e = if apocentre { -e } else { e };
            let start = VelocityPoint::new([1.0 - e, 0.0], [0.0, f64::sqrt((1.0 + e) / (1.0 - e))], 0.0);
            let problem = Problem::new(&kepler, 0.0, start).unwrap();
            let (integrator, _, spent) = search(&problem, 40.0, None, 1e-8);
            if e.abs() < 0.5 {
                let (name, _, of_given) = search(&problem, 40.0, Some(8), 1e-8);
                assert_eq!((integrator, spent), (name, of_given), "{e}");
                continue;
            }
            assert_eq!(integrator, "transformed_gauss_8", "{e}");
            let run = problem.accuracy(1e-8).run(Until::Time(40.0)).unwrap();
            let most = 7.0 * run.evaluations as f64 + 2.5 * 2.0 * 2000.0;
            assert!(spent as f64 <= most, "{e}: {spent} evaluations for {}", run.evaluations);
        }
    }
}

/// The nodes of runs with k and 2k steps may all lie on the same kinks, and the runs then agree on a wrong motion: for
/// kinks at various simple fractions of the span, the motion has the requested accuracy, or it is refused.
#[test]
fn kinks_at_nodes_do_not_hide() {
    let tau = std::f64::consts::TAU;
    let mut cases = vec![
        (Unstated::Stiffer(9.0), 1.0, tau * 2.0 / 3.0, [1.0, 0.0]),
        (Unstated::Stiffer(4.0), 1.0, 4.5 * tau, [1.0, 0.0]),
    ];
    for at in [0.25, 0.5, 0.75, 1.0, 4.0 / 3.0, 1.5] {
        cases.push((Unstated::Begins(at), 0.0, 2.0, [1.0 - f64::cos(2.0 - at), f64::sin(2.0 - at)]));
    }
    let mut refused = 0;
    for (system, q, span, [x, v]) in cases {
        let system = OnLine::from(system);
        let problem = Problem::new(&system, 0.0, VelocityPoint::new([q], [0.0], 0.0)).unwrap();
        for wanted in [1e-4, 1e-6, 1e-9] {
            match problem.accuracy(wanted).run(Until::Time(span)) {
                Ok(found) => {
                    let off = f64::hypot(found.q[0] - x, found.p[0] - v) / x.hypot(v);
                    assert!(off <= wanted, "{span}, {wanted:e}: {off:e} in {} steps", found.steps);
                }
                Err(_) => refused += 1,
            }
        }
    }
    println!("{refused} refused");
}
