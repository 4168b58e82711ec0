//! A step of a small system allocates no memory, with any method, with closed and with derived derivatives; nor do the
//! steps of contact Gauss collocation, the exact discrete Lagrangian with its derivatives, a correction of a path,
//! a step of an ensemble, and steps on groups and under constraints.

use crate::common::gauss::GaussSteppers;
use crate::common::lagrangians::WithStructure;
use crate::counting_allocator::allocations;
use crate::lagrangians::{One, Two, kepler, one, two};
use contact_examples::systems::constrained::{KnifeEdge, RigidPendulum};
use contact_examples::systems::{
    DoublePendulum, HarmonicOscillator, Kepler, OneCoordinate, Pendulum, QuadraticInZ, System,
};
use contact_geom::groups::{Inertia, LieGroup, RigidBody, Rotations, UniformGravity};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ContactHamiltonian, Lagrangian, OfHamiltonian, PhasePoint, Scalar, Structure, VelocityPoint, legendre,
};
use discrete_herglotz::{
    DiscreteLagrangian, Ensemble, GaussCollocation, Problem, SplittingScheme, Stepper, StepperOptions, Steps, Until,
    boundary::{BoundaryPath, End},
    constraints::{ConstrainedStart, ContactLobatto, DragRattle, Nonholonomic},
    ensemble::Lagrangians,
    gauss::{Gauss, GaussRoute, GaussStepper},
    groups::{GroupGauss, GroupMotion, GroupState, RigidBodySplitting},
    rules::{Flow, Method, Rule},
};
use exact_lagrangian::{ContactExponential, ExactLagrangian, RetractionRoute};

/// A system of the catalogue as a Lagrangian of these tests, with its name and its initial data.
struct Case<L, const N: usize> {
    name: &'static str,
    lagrangian: L,
    initial: VelocityPoint<N>,
}

impl<L, const N: usize> Case<L, N> {
    fn of<S: System<N>>(system: S, lagrangian: L) -> Self {
        Case { name: system.name(), initial: system.initial(), lagrangian }
    }
}

/// The pendulum without its structure.
fn unclaimed() -> One {
    WithStructure(OneCoordinate::from(Pendulum { gamma: -0.001 }), Structure::default()).into()
}

/// A system with one coordinate.
fn of_one<S: System<1> + Copy + Into<OneCoordinate>>(system: S) -> Case<One, 1> {
    Case::of(system, one(system))
}

fn double_pendulum() -> Case<Two, 2> {
    Case::of(DoublePendulum::default(), two(DoublePendulum::default()))
}

/// In space, where it is a type of its own.
fn kepler_in_space() -> Case<Kepler<3>, 3> {
    Case::of(Kepler::default(), Kepler::default())
}

/// The counter counts.
#[test]
fn an_allocation_is_seen() {
    assert!(allocations(|| drop(std::hint::black_box(vec![1.0; 8]))) >= 1);
}

/// A thousand steps without an allocation.
#[test]
fn steps() {
    fn run<const N: usize, L: Lagrangian<N> + Copy>(case: Case<L, N>) {
        let start: PhasePoint<N> = legendre(&case.lagrangian, 0.0, &case.initial);
        for method in Method::applicable(&case.lagrangian.structure()) {
            let name = format!("{} with {method}", case.name);
            let ld = method.discretise(case.lagrangian, 0.01, 0.0, &start);
            let ld = ld.unwrap();
            let flow = Flow::new(&ld, 0.0, start);
            let mut flow = flow.unwrap();
            let mut outcome = Ok(());
            let count = allocations(|| outcome = flow.advance(1000));
            assert_eq!((outcome, count), (Ok(()), 0), "{name}");
        }
    }
    run(of_one(Pendulum::default()));
    run(double_pendulum());
    run(kepler_in_space());
}

/// Steps so long that Newton's method is used: its workspace is allocated in the first one.
#[test]
fn collocation_by_newton() {
    fn run(system: One, expected: GaussRoute) {
        let gauss = Gauss::new(system, 4, 5.0);
        let stepper = gauss.as_ref().map(|gauss| gauss.stepper(0.0, PhasePoint::new([2.0], [1.0], 0.0), [1.0].into()));
        let Ok(Ok(mut stepper)) = stepper else { unreachable!("no stepper") };
        assert_eq!((stepper.advance(1), stepper.newton_steps(), stepper.route()), (Ok(()), 1, expected));
        let mut outcome = Ok(());
        let count = allocations(|| outcome = stepper.advance(10));
        assert_eq!((outcome, count), (Ok(()), 0), "{expected:?}");
        assert!(stepper.newton_steps() > 1, "{expected:?}");
    }
    run(one(Pendulum { gamma: -0.001 }), GaussRoute::Condensed);
    run(unclaimed(), GaussRoute::General);
}

/// A thousand steps of contact Gauss collocation by each of its routes, with extrapolated starts and updated slopes.
#[test]
fn collocation() {
    fn run<const N: usize, L: Lagrangian<N>>(case: Case<L, N>, h: f64, expected: GaussRoute) {
        let start: PhasePoint<N> = legendre(&case.lagrangian, 0.0, &case.initial);
        let gauss = Gauss::new(case.lagrangian, 8, h);
        let stepper = gauss.as_ref().map(|gauss| gauss.stepper(0.0, start, case.initial.v));
        let mut stepper = stepper.unwrap().unwrap();
        let mut outcome = Ok(());
        let count = allocations(|| outcome = stepper.advance(1000));
        let found = (outcome, count, stepper.route(), stepper.newton_steps());
        assert_eq!(found, (Ok(()), 0, expected, 0), "{}", case.name);
    }
    run(of_one(HarmonicOscillator::default()), 0.1, GaussRoute::Linear);
    run(of_one(Pendulum::default()), 0.1, GaussRoute::Condensed);
    run(kepler_in_space(), 0.05, GaussRoute::Condensed);
    run(of_one(QuadraticInZ::default()), 0.1, GaussRoute::ConstantMass);
    run(double_pendulum(), 0.02, GaussRoute::General);
}

/// Steps for a contact Hamiltonian: by fixed-point iteration, and so long that Newton's method is used.
#[test]
fn collocation_for_a_hamiltonian() {
    /// `p (cos q + z/5) + (q^2/2 + z/10) z + k p (q - 1)`: linear in p, with a relaxation of rate k.
    struct Linear(f64);
    impl ContactHamiltonian<1> for Linear {
        #[inline(always)]
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
            p[0] * (q[0].cos() + z * 0.2 - (q[0] - 1.0) * self.0) + (q[0] * q[0] * 0.5 + z * 0.1) * z
        }
    }
    for (rate, h, by_newton) in [(0.0, 0.1, false), (300.0, 0.1, true)] {
        let hamiltonian = OfHamiltonian(Linear(rate));
        let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, PhasePoint::new([1.0], [1e-9], 0.1)).unwrap();
        let mut stepper = GaussStepper::new(&problem, 4, h, StepperOptions::default()).unwrap();
        assert_eq!(stepper.advance(1), Ok(()));
        let mut outcome = Ok(());
        let count = allocations(|| outcome = stepper.advance(7));
        assert_eq!((outcome, count, stepper.newton_steps() > 0), (Ok(()), 0, by_newton), "rate {rate}");
    }
}

/// The exact discrete Lagrangian, its jets and steps, by each route to the motion between two points.
#[test]
fn exact() {
    fn run<const N: usize, L: Lagrangian<N> + Copy>(case: Case<L, N>, h: f64, expected: RetractionRoute) {
        let (system, x) = (case.lagrangian, case.initial);
        let ld = ExactLagrangian::<_, N>::new(system, h);
        let point = ContactExponential::new(system, h).ok().and_then(|e| e.at(0.0, &x).ok());
        let (ld, point) = (ld.unwrap(), point.unwrap());
        let mut solver = Default::default();
        let mut all = (None, None, None, None);
        let mut count = 0;
        // The first round computes the tables of coefficients.
        for _ in 0..2 {
            count = allocations(|| {
                let state = legendre(&system, 0.0, &x);
                all = (
                    ld.retract(0.0, &point).ok(),
                    ld.jet(0.0, &point).ok(),
                    ld.second_jet(0.0, &point).ok(),
                    ld.forward(0.0, &state, &x.v, &mut solver).ok(),
                );
            });
        }
        assert!(all.1.is_some() && all.2.is_some() && all.3.is_some());
        assert_eq!((all.0.map(|r| r.route), count), (Some(expected), 0), "{}", case.name);
    }
    run(of_one(Pendulum::default()), 0.5, RetractionRoute::Collocation);
    run(double_pendulum(), 0.1, RetractionRoute::Collocation);
    run(kepler_in_space(), 0.1, RetractionRoute::Collocation);
    run(Case::of(Kepler::default(), kepler(Kepler::default())), 1.0, RetractionRoute::Collocation);
    run(of_one(HarmonicOscillator::default()), 3.0, RetractionRoute::Newton);
}

/// A search with several corrections allocates as much as one that starts at its solution: its workspace.
#[test]
fn corrections_of_paths() {
    let ld = Rule::LEFT_MIDPOINT.of(one(Pendulum { gamma: -0.1 }), 0.02).unwrap();
    let problem = BoundaryPath::new(&ld, 100, [0.0, 1.0].map(|q| End::Position([q].into()))).unwrap();
    let (mut far, mut near) = (None, None);
    let many = allocations(|| far = Some(problem.search()));
    let far = far.unwrap();
    let again = problem.from_path(far.path().unwrap()).unwrap();
    let few = allocations(|| near = Some(again.search()));
    let near = near.unwrap();
    assert!(
        far.is_found() && near.is_found() && far.iterations > near.iterations + 1,
        "{} and {}",
        far.status,
        near.status
    );
    assert_eq!(many, few);
}

/// In lanes an ensemble allocates as much for many steps as for few, by splittings and by collocation.
#[test]
fn steps_of_ensembles() {
    let pendulum = one(Pendulum { gamma: -0.01 });
    let start = |i: usize| VelocityPoint::new([0.01 * i as f64], [0.5], 0.0);
    let of = |ensemble: Ensemble<'_, Lagrangians<'_, One, 1>>, steps: usize| {
        let ensemble = ensemble.steps(Steps::Count(steps)).threads(1);
        let mut completed = 0;
        let count =
            allocations(|| completed = ensemble.run(Until::Time(0.1 * steps as f64), |_| ()).unwrap().completed);
        assert_eq!(completed, 100);
        count
    };
    for steps in [1000, 4000] {
        let splitting = || Ensemble::new(&pendulum, 0.0, 100, start).by(SplittingScheme::BLANES_MOAN_4);
        assert_eq!(of(splitting(), steps), of(splitting(), 100));
        let collocation = || Ensemble::new(&pendulum, 0.0, 100, start).by(GaussCollocation { stages: 4 });
        // Runs with one step size share its table, which the first one computes.
        of(collocation(), 10);
        assert_eq!(of(collocation(), steps), of(collocation(), 100));
    }
}

/// Steps on a Lie group and under constraints; the first one may allocate its workspace.
#[test]
fn groups_and_constraints() {
    let gravity = UniformGravity { weight: [0.0, 0.0, -9.81], centre: [0.0, 0.5, 0.0] };
    let body = RigidBody::rotating(&Inertia::principal([1.0, 0.5, 1.0]).unwrap(), gravity, -0.1).unwrap();
    let start = GroupState { g: Rotations::identity(), momentum: SVector::from([0.3, 2.0, -0.4]), z: 0.1 };
    let gauss = GroupGauss::new(body, 4, 0.02).unwrap();
    let splitting = RigidBodySplitting::new(body, SplittingScheme::BLANES_MOAN_6, 0.02).unwrap();
    let mut motion = GroupMotion::<Rotations, 3>::new(0.0, start).unwrap();
    let mut outcome = Ok(());
    let count = allocations(|| outcome = motion.advance(&gauss, 100).and_then(|()| motion.advance(&splitting, 100)));
    assert_eq!((outcome, count), (Ok(()), 0));

    let pendulum = RigidPendulum::<2> { gravity: 9.81, gamma: -0.1 };
    let start = ConstrainedStart::new(VelocityPoint::new([1.0, 0.0], [0.0, 0.5], 0.0));
    let mut rattle = DragRattle::new(pendulum, pendulum, &SplittingScheme::SUZUKI_4, 0.01, &start).unwrap();
    let mut lobatto = ContactLobatto::new(pendulum, pendulum, 3, 0.01, &start).unwrap();
    let edge = KnifeEdge { slope: 0.3, gamma: -0.1 };
    let start = ConstrainedStart::new(VelocityPoint::new([0.0; 3], [0.5, 0.0, 0.7], 0.0));
    let rule = |h| Rule::MIDPOINT.of(edge, h);
    let mut blade = Nonholonomic::new(edge, edge, rule, &SplittingScheme::STRANG, 0.01, &start).unwrap();
    let steppers: [(&str, &mut dyn FnMut() -> bool); 3] = [
        ("RATTLE", &mut || rattle.advance(100).is_ok()),
        ("Lobatto", &mut || lobatto.advance(100).is_ok()),
        ("nonholonomic", &mut || blade.advance(100).is_ok()),
    ];
    for (name, advance) in steppers {
        assert!(advance(), "{name}");
        let mut advanced = false;
        let count = allocations(|| advanced = advance());
        assert_eq!((advanced, count), (true, 0), "{name}");
    }
}
