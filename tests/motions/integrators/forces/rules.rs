//! Discrete forces: orders of the rules and of their compositions, and steps of a discrete Lagrangian of a user.

use crate::common::forces::{AnyForce, Swirl};
use crate::common::{relative_distance, slope};
use crate::forces::{Applied, forced_two};
use crate::lagrangians::{kepler, one, two};
use contact_examples::systems::{CoupledPlane, Kepler, QuadraticInZ, System};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, Forced, Lagrangian, PhasePoint, Scalar, VelocityPoint, legendre};
use discrete_herglotz::gauss::Gauss;
use discrete_herglotz::rules::{Composition, Flow, Method, Rule};
use discrete_herglotz::splitting::{ActionStrang, Strang};
use discrete_herglotz::theory::{discrete_forces, legendre_minus, legendre_plus};
use discrete_herglotz::{
    DiscreteLagrangian, GaussCollocation, InputError, Problem, SplittingScheme, StepError, Stepper, Steps, Until,
    solve::Solver,
};

/// The state after a time by 12 stages with short steps.
fn reference<const N: usize>(lagrangian: &impl Lagrangian<N>, t: f64, x: VelocityPoint<N>, span: f64) -> PhasePoint<N> {
    let problem = Problem::new(lagrangian, t, x).unwrap();
    let run = problem.by(GaussCollocation { stages: 12 }).steps(Steps::Count(32)).run(Until::Time(t + span)).unwrap();
    run.state().fixed()
}

/// Rules attain their orders with a force that is nonlinear in t, q, v and z, on Lagrangians that are nonlinear in q and
/// z; a composition of the midpoint rule attains the order of its scheme.
#[test]
fn rules_and_compositions_keep_their_orders() {
    fn of<const N: usize, S: System<N>>(system: &S, lagrangian: impl Lagrangian<N>) {
        let (t, x) = (system.initial_time(), system.initial());
        let forced = Forced { lagrangian, force: Applied::from(AnyForce) };
        let (truth, start) = (reference(&forced, t, x, 1.0), legendre(&forced, t, &x));
        let check = |name: &str, order: u32, steps: &[usize], run: &dyn Fn(f64, usize) -> PhasePoint<N>| {
            let points: Vec<_> =
                steps.iter().map(|n| (1.0 / *n as f64, relative_distance(run(1.0 / *n as f64, *n), truth))).collect();
            let observed = slope(&points);
            assert!((observed - f64::from(order)).abs() < 0.15, "{} {name}: {observed:.3} {points:?}", system.name());
        };
        for method in Method::RULES {
            check(method.name(), method.order(), &[128, 180, 256, 360], &|h, n| {
                let ld = method.discretise(&forced, h, t, &start).unwrap();
                let mut flow = Flow::with_guess(&ld, t, start, x.v).unwrap();
                flow.advance(n).unwrap();
                *Flow::state(&flow)
            });
        }
        let scheme = SplittingScheme::YOSHIDA_4;
        check("composition", 4, &[24, 32, 48, 64], &|h, n| {
            let mut motion = Composition::new(|h| Rule::MIDPOINT.of(&forced, h), &scheme, h, t, start).unwrap();
            motion.advance(n).unwrap();
            motion.state().fixed()
        });
    }
    let square = QuadraticInZ { c: 1.0 };
    of(&square, one(square));
    let plane = CoupledPlane { c: 1.5, ..CoupledPlane::default() };
    of(&plane, two(plane));
}

/// A discrete Lagrangian and its forces by their values alone, as a user writes them.
struct ByValue<D>(D);

impl<D: DiscreteLagrangian<N>, const N: usize> DiscreteLagrangian<N> for ByValue<D> {
    const FORCED: bool = D::FORCED;

    fn step_size(&self) -> f64 {
        self.0.step_size()
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        self.0.value(t, x)
    }
    fn forces<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<[SVector<T, N>; 2], StepError> {
        self.0.forces(t, x)
    }
}

/// Steps from the values of L_d and of its forces are those of the rule, forward and backward, and the backward step
/// inverts the forward one.
fn assert_steps<const N: usize>(ld: &impl DiscreteLagrangian<N>, t: f64, from: PhasePoint<N>, v: SVector<f64, N>) {
    let mut solver = Solver::default();
    let forward = ld.forward(t, &from, &v, &mut solver).unwrap();
    let back = ld.backward(t, &forward.end, &forward.velocity, &mut solver).unwrap();
    let by_value = ByValue(ld);
    let other = by_value.forward(t, &from, &v, &mut solver).unwrap();
    let other_back = by_value.backward(t, &forward.end, &forward.velocity, &mut solver).unwrap();
    // The momentum depends on rounded positions through W/h, with h = 0.05.
    for (name, off) in [
        ("there and back", relative_distance(back.end, from)),
        ("forward by value", relative_distance(other.end, forward.end)),
        ("backward by value", relative_distance(other_back.end, from)),
    ] {
        assert!(off <= 1e-13, "{name}: {off:e}");
    }
    let x = DiscretePoint { q0: from.q, q1: forward.end.q, z0: from.z };
    for (state, end) in [(legendre_minus(ld, t, &x).unwrap(), from), (legendre_plus(ld, t, &x).unwrap(), forward.end)] {
        assert!(relative_distance(state, end) <= 1e-13, "{state:?} {end:?}");
    }
    let forces = discrete_forces(ld, t, &x).unwrap();
    assert!(forces.minus.norm() > 1e-4 && forces.plus_slopes.1.norm() > 1e-6, "{forces:?}");
}

#[test]
fn steps_are_those_of_the_values() {
    let plane = CoupledPlane { c: 1.5, ..CoupledPlane::default() };
    let x = plane.initial();
    let forced = Forced { lagrangian: two(plane), force: Applied::from(AnyForce) };
    let start = legendre(&forced, 0.0, &x);
    for method in Method::RULES.iter().filter(|method| **method != Method::Rectangle) {
        assert_steps(&method.discretise(&forced, 0.05, 0.3, &start).unwrap(), 0.3, start, x.v);
    }
    let orbit = forced_two(kepler(Kepler::default()), Swirl);
    let x = Kepler::<2>::default().initial();
    let start = legendre(&orbit, 0.0, &x);
    assert_steps(&Strang::new(&orbit, 0.05, 0.3, &start).unwrap(), 0.3, start, x.v);
    let nonlinear = Forced { lagrangian: one(QuadraticInZ { c: 1.0 }), force: Applied::from(Swirl) };
    let start = PhasePoint::new([0.4], [0.9], 0.2);
    assert_steps(&ActionStrang::new(&nonlinear, 0.05, 0.3, &start).unwrap(), 0.3, start, [0.9].into());
}

/// What takes no force says so.
#[test]
fn what_takes_no_force_refuses_it() {
    let forced = forced_two(kepler(Kepler::default()), Swirl);
    let refused = |found: Option<InputError>| assert!(matches!(found, Some(InputError::Forced { .. })), "{found:?}");
    refused(Gauss::new::<2>(&forced, 2, 0.1).err());
}
