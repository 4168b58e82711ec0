//! Steps and runs: forward against the route through derivatives of the value, backward against forward, small steps and
//! large systems.

use crate::common::{around, discretise, on_random, step_from};
use contact_geom::systems::{Chain, Pendulum, System, SystemVisitor, visit_catalogue};
use contact_geom::{DiscretePoint, Larger, Largest, PhasePoint, Scalar, Triple, legendre};
use discrete_herglotz::{
    DiscreteLagrangian, Every, FinalOnly, Flow, LeftMidpoint, Method, Midpoint, Record, Solver, Status, Step,
    StepError, legendre_minus,
};
use std::ops::ControlFlow;

/// A discrete Lagrangian of which only the value is taken: the slow route of a user's own.
struct ValueOnly<D>(D);

impl<const N: usize, D: DiscreteLagrangian<N>> DiscreteLagrangian<N> for ValueOnly<D> {
    fn step_size(&self) -> f64 {
        self.0.step_size()
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        self.0.value(t, x)
    }
}

/// The fast steps agree with those by derivatives of the value, forward and back, and undo each other: to 1e-10, since the
/// slow route subtracts positions, which loses `eps / h`.
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
        let slow = ValueOnly(ld);
        let forward = ld.forward(t, &from, &guess, &mut solver).map_err(say)?;
        let forward_slow = slow.forward(t, &from, &guess, &mut solver).map_err(say)?;
        let back = ld.backward(t, &forward.end, &guess, &mut solver).map_err(say)?;
        let back_slow = slow.backward(t, &forward.end, &guess, &mut solver).map_err(say)?;
        let sigma = ld.jet(t, x).map_err(say)?.sigma();
        let size = Triple::from(from).largest().larger(Triple::from(forward.end).largest());
        let distance = |a: PhasePoint<N>, b: PhasePoint<N>| Triple::from(a).minus(b.into()).largest() / size;
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

/// The state is (q, p, z), so that small steps lose no digits: one time unit in steps from 1e-1 to 1e-5 comes back to its
/// start by the inverse flow, to round-off that grows like the number of steps.
#[test]
fn small_steps_keep_their_digits() {
    for exponent in 1..=5 {
        let steps = 10usize.pow(exponent);
        let ld = Midpoint::new(Pendulum::default(), 1.0 / steps as f64).unwrap();
        let start = PhasePoint::new([1.0], [0.5], 0.2);
        let mut flow = Flow::new(&ld, 0.0, start).unwrap();
        assert_eq!(flow.run(steps, &mut FinalOnly), Ok(Status::Completed));
        for _ in 0..steps {
            assert_eq!(flow.step_back(), Ok(()));
        }
        let error = Triple::from(*flow.state()).minus(start.into()).largest();
        assert!(error <= 4.0 * f64::EPSILON * steps as f64, "{steps} steps: {error:e}");
    }
}

/// A chain beyond the crossover runs through faer, and its steps are those of the general route; a conserved relation, the
/// total momentum of a free chain, follows the product of sigma_d.
#[test]
fn a_large_chain() {
    let run = || {
        let chain = Chain::<48> { ends: contact_geom::systems::Ends::Free, ..Chain::default() };
        let ld = Midpoint::new(&chain, 0.1).unwrap();
        let start = legendre(&chain, 0.0, &chain.initial());
        let mut sigma = 1.0;
        let before = start.p.sum();
        let mut flow = Flow::new(&ld, 0.0, start).unwrap();
        let mut observer = |step: &Step<48>| {
            sigma *= step.sigma;
            ControlFlow::Continue(())
        };
        let status = flow.run(20, &mut observer);
        let after = flow.state().p.sum();
        assert!((after - sigma * before).abs() <= 1e-13 * start.p.abs().sum(), "{before} {after} {sigma}");
        status == Ok(Status::Completed)
    };
    let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(run);
    assert!(thread.is_ok_and(|t| t.join().is_ok_and(|ok| ok)));
}

/// A run records what it is asked to, no more, and can be stopped and continued.
#[test]
fn records() {
    let ld = LeftMidpoint::new(Pendulum::default(), 0.1).unwrap();
    let start = PhasePoint::new([1.0], [0.5], 0.2);
    let (mut flow, every) = (Flow::new(&ld, 2.0, start).unwrap(), Every::new(10, Record::default()).unwrap());
    let mut seen = 0;
    let count = |_: &Step<1>| {
        seen += 1;
        if seen < 25 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let mut both = (every, count);
    assert_eq!(flow.run(100, &mut both), Ok(Status::Stopped { step: 25 }));
    let rows = both.0.into_inner().rows;
    let times: Vec<_> = rows.iter().map(|(t, _)| *t).collect();
    assert_eq!(times, [2.0, 3.0, 4.0]);
    assert_eq!(rows[0].1, start);
    let mut record = Record::default();
    assert_eq!(flow.run(5, &mut record), Ok(Status::Completed));
    assert_eq!(record.rows.len(), 5);
    assert_eq!(flow.time(), 5.0);
    // The same run again is the same to the bit.
    let mut again = Record::default();
    let status = Flow::new(&ld, 2.0, start).and_then(|mut flow| flow.run(30, &mut again));
    assert_eq!(status, Ok(Status::Completed));
    assert_eq!(again.rows[30], record.rows[4]);
}
