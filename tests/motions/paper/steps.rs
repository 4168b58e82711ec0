//! Steps and runs: against steps by derivatives of the value, backward against forward, small steps and large systems.

use crate::common::observers::StopsAt;
use crate::common::{around, on_random, step_from};
use crate::lagrangians::one;
use crate::paper::table::discretise;
use contact_examples::systems::{Chain, OneCoordinate, Pendulum, System, SystemVisitor, visit_catalogue};
use contact_geom::{
    ChartVector, DiscretePoint, PhasePoint, Scalar, legendre,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use discrete_herglotz::{
    AnyIntegrator, DiscreteLagrangian, Problem, Rows, Status, StepError, Stepper, Steps, Until,
    rules::{Flow, Method, Rule},
    solve::Solver,
    theory::legendre_minus,
};

/// A discrete Lagrangian that has only a value, so that its steps take the general route.
struct DerivedFromValue<D>(D);

impl<const N: usize, D: DiscreteLagrangian<N>> DiscreteLagrangian<N> for DerivedFromValue<D> {
    fn step_size(&self) -> f64 {
        self.0.step_size()
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        self.0.value(t, x)
    }
}

/// The steps of the methods agree with those by derivatives of the value, forward and backward, and backward steps
/// invert forward ones: to 1e-10, since the general route subtracts positions, which loses `eps / h`.
#[test]
fn forward_and_backward() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for method in Method::applicable(&system.structure()) {
                on_random(&format!("{} with {method}", system.name()), 2 * N + 3, |u| {
                    let (t, v) = system.sample(&u[1..]);
                    let h = step_from(u[0]);
                    let ld = discretise(method, system, h, t, &v).map_err(|e| e.to_string())?;
                    compare(&ld, t, &around(&v, h))
                });
            }
        }
    }
    fn compare<const N: usize>(ld: &impl DiscreteLagrangian<N>, t: f64, x: &DiscretePoint<N>) -> Result<(), String> {
        let say = |e: StepError| e.to_string();
        let mut solver = Solver::default();
        let from = legendre_minus(ld, t, x).map_err(say)?;
        let guess = (x.q1 - x.q0) / ld.step_size();
        let slow = DerivedFromValue(ld);
        let forward = ld.forward(t, &from, &guess, &mut solver).map_err(say)?;
        let forward_slow = slow.forward(t, &from, &guess, &mut solver).map_err(say)?;
        let back = ld.backward(t, &forward.end, &guess, &mut solver).map_err(say)?;
        let back_slow = slow.backward(t, &forward.end, &guess, &mut solver).map_err(say)?;
        let sigma = ld.jet(t, x).map_err(say)?.sigma();
        let size = ChartVector::from(from).max_abs_or_nan().max_or_nan(ChartVector::from(forward.end).max_abs_or_nan());
        let distance =
            |a: PhasePoint<N>, b: PhasePoint<N>| ChartVector::from(a).minus(b.into()).max_abs_or_nan() / size;
        let worst = [
            distance(forward.end, forward_slow.end),
            distance(back.end, from),
            distance(back_slow.end, from),
            (forward.sigma - sigma).abs(),
            (back.sigma - sigma).abs(),
            (forward_slow.sigma - sigma).abs(),
            (back_slow.sigma - sigma).abs(),
        ];
        if worst.iter().all(|w| *w <= 1e-10) { Ok(()) } else { Err(format!("{worst:?}")) }
    }
    visit_catalogue(&mut Visitor);
}

/// The state is (q, p, z), so that small steps lose no digits: one time unit in steps from 1e-1 to 1e-5 is inverted by
/// the backward flow, up to round-off that grows like the number of steps.
#[test]
fn small_steps_keep_their_digits() {
    for exponent in 1..=5 {
        let steps = 10usize.pow(exponent);
        let ld = Rule::MIDPOINT.of(OneCoordinate::from(Pendulum::default()), 1.0 / steps as f64).unwrap();
        let start = PhasePoint::new([1.0], [0.5], 0.2);
        let mut flow = Flow::new(&ld, 0.0, start).unwrap();
        assert_eq!(flow.advance(steps), Ok(()));
        for _ in 0..steps {
            assert_eq!(flow.step_back(), Ok(()));
        }
        let error = ChartVector::from(*flow.state()).minus(start.into()).max_abs_or_nan();
        assert!(error <= 4.0 * f64::EPSILON * steps as f64, "{steps} steps: {error:e}");
    }
}

/// A chain with more coordinates than the crossover is solved with faer: the total momentum of a free chain is its
/// initial value times the product of the sigma_d.
#[test]
fn a_large_chain() {
    let run = || {
        let chain = Chain::<48> { ends: contact_examples::systems::Ends::Free, ..Chain::default() };
        let ld = Rule::MIDPOINT.of(&chain, 0.1).unwrap();
        let start = legendre(&chain, 0.0, &chain.initial());
        let mut sigma = 1.0;
        let before = start.p.sum();
        let mut flow = Flow::new(&ld, 0.0, start).unwrap();
        for k in 1..=20 {
            let step = flow.step().unwrap();
            assert_eq!((step.k, step.t, step.to), (k, flow.time(), *flow.state()));
            sigma *= step.sigma;
        }
        let after = flow.state().p.sum();
        assert!((after - sigma * before).abs() <= 1e-13 * start.p.abs().sum(), "{before} {after} {sigma}");
    };
    let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(run);
    assert!(thread.is_ok_and(|t| t.join().is_ok()));
}

/// A run records the requested rows, and can be stopped and continued.
#[test]
fn records() {
    let pendulum = one(Pendulum::default());
    let problem = Problem::new(&pendulum, 2.0, PhasePoint::new([1.0], [0.5], 0.2)).unwrap();
    let by_rule = AnyIntegrator::Discrete(Method::LeftMidpoint);
    let mut both = (Rows::every(10).unwrap(), StopsAt(25, "the counter"));
    let run = problem.by(by_rule).steps(Steps::Size(0.1)).observe(&mut both);
    let stopped = run.run(Until::Steps(100)).unwrap();
    assert_eq!(stopped.status, Status::Stopped { step: 25, t: 4.5, by: "the counter" });
    let rows = both.0.rows;
    assert_eq!(rows.iter().map(|row| row.t).collect::<Vec<_>>(), [2.0, 3.0, 4.0]);
    let PhasePoint { q, p, z } = *problem.state();
    assert_eq!((rows[0].q.fixed(), rows[0].p.fixed(), rows[0].z), (q, p, Some(z)));
    // Five more steps from the state at which the run was stopped.
    let onward = Problem::new(&pendulum, stopped.t, &stopped).unwrap();
    let mut record = Rows::every(1).unwrap();
    let ended = onward.by(by_rule).steps(Steps::Size(0.1)).observe(&mut record).run(Until::Steps(5)).unwrap();
    assert_eq!((ended.status, ended.steps, ended.t, record.rows.len()), (Status::Completed, 5, 5.0, 6));
    // A repeated run is the same to the bit, and so is a run in two parts by one stepper.
    let again = || {
        let mut rows = Rows::every(1).unwrap();
        let run = problem.by(by_rule).steps(Steps::Size(0.1)).observe(&mut rows);
        assert_eq!(run.run(Until::Steps(30)).map(|outcome| outcome.status), Ok(Status::Completed));
        rows.rows
    };
    let rows = again();
    assert_eq!(rows, again());
    let plan = problem.by(by_rule).steps(Steps::Size(0.1)).plan(Until::Steps(30)).unwrap();
    let mut stepper = plan.stepper().unwrap();
    assert_eq!((stepper.advance(25), stepper.state()), (Ok(()), stopped.state()));
    assert_eq!((stepper.advance(5), stepper.time()), (Ok(()), 5.0));
    let end = stepper.state();
    assert_eq!((&end.q, &end.p, Some(end.z)), (&rows[30].q, &rows[30].p, rows[30].z));
    // A new start has no earlier velocities to extrapolate, which changes the rounding.
    let off = ChartVector::<1>::from(ended.state().fixed()).minus(end.fixed().into()).max_abs_or_nan();
    assert!(off <= 64.0 * f64::EPSILON, "{off:e}");
}
