//! Forces: closed forms, orders, routes, and what a force leaves of the geometry.

mod rules;
pub mod splittings;

use crate::common::forces::{AnyForce, Drag, DragInLagrangian, Fall, G, Swirl, Undeclared};
use crate::common::oracle::motion;
use crate::common::{relative_distance, slope};
use crate::forces::Applied;
use crate::lagrangians::{One, kepler, one, two};
use contact_examples::systems::{CoupledPlane, Kepler, Pendulum, QuadraticInZ, System};
use contact_geom::{Forced, Lagrangian, PhasePoint, Structure, VelocityPoint, legendre, numbers::MaxAbsOrNan};
use discrete_herglotz::gauss::{GaussRoute, GaussStepper, VirtualWork};
use discrete_herglotz::{GaussCollocation, Problem, Stepper, StepperOptions, Steps, Until};

/// The state after a number of Gauss steps, with the route.
fn gauss<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t0: f64,
    x: VelocityPoint<N>,
    stages: usize,
    h: f64,
    steps: usize,
) -> (PhasePoint<N>, GaussRoute) {
    let problem = Problem::new(lagrangian, t0, x).unwrap();
    let options = StepperOptions { action: true, ..StepperOptions::default() };
    let mut stepper = GaussStepper::new(&problem, stages, h, options).unwrap();
    let taken = stepper.advance(steps);
    assert!(taken.is_ok(), "{taken:?}");
    (stepper.state().fixed(), stepper.route())
}

/// A fall with quadratic drag from rest covers the distance `(1/k) ln cosh(sqrt(gk) t)`, to 1e-12: as a force on a
/// Lagrangian without z, and by a contact Lagrangian of the same motion. The steps of the one have a contact defect,
/// those of the other have none. The tolerance is 40 steps with a few units of round-off of their terms.
#[test]
fn a_fall_with_quadratic_drag() {
    let (k, start) = (0.2, VelocityPoint::new([0.0], [0.0], 0.0));
    let drag = Applied::Drag(Drag { c: 0.0, k });
    let (forced, contact) = (Forced { lagrangian: One::from(Fall), force: drag }, One::from(DragInLagrangian { k }));
    let mut t = 0.0;
    for _ in 0..5 {
        t += 0.4;
        let rate = (G * k).sqrt();
        let (q, v) = (-(rate * t).cosh().ln() / k, -(G / k).sqrt() * (rate * t).tanh());
        for (name, (end, _)) in [
            ("force", gauss(&forced, 0.0, start, 8, 0.05, (t / 0.05_f64).round() as usize)),
            ("contact", gauss(&contact, 0.0, start, 8, 0.05, (t / 0.05_f64).round() as usize)),
        ] {
            // The momentum of the contact Lagrangian is v + 2 k z.
            let velocity = if name == "force" { end.p[0] } else { end.p[0] - 2.0 * k * end.z };
            assert!((end.q[0] - q).abs() <= 1e-12 * q.abs(), "{name} at {t}: {} {q}", end.q[0]);
            assert!((velocity - v).abs() <= 1e-12 * v.abs(), "{name} at {t}: {velocity} {v}");
        }
    }
    let moving = VelocityPoint::new([0.0], [-2.0], 0.3);
    let work = |system: &dyn Fn() -> VirtualWork<1>| system().defect.max_abs_or_nan();
    let of_force =
        work(&|| VirtualWork::of_step(&forced, 3, 0.1, 0.0, &legendre(&forced, 0.0, &moving), &moving.v).unwrap());
    let of_contact =
        work(&|| VirtualWork::of_step(&contact, 3, 0.1, 0.0, &legendre(&contact, 0.0, &moving), &moving.v).unwrap());
    assert!(of_force > 0.05 && of_contact <= 1e-14, "{of_force:e} {of_contact:e}");
}

/// The orders of Gauss collocation with a force that is nonlinear in t, q, v and z, on Lagrangians that are nonlinear in
/// q and z, against 16 stages; and those against the oracle, an ODE solver of another library.
#[test]
fn orders_are_twice_the_stages() {
    fn of<const N: usize, S: System<N>>(system: &S, lagrangian: impl Lagrangian<N>, finest: [[usize; 4]; 3]) {
        let (t, x) = (system.initial_time(), system.initial());
        let forced = Forced { lagrangian, force: Applied::from(AnyForce) };
        let (truth, route) = gauss(&forced, t, x, 16, 1.0 / 32.0, 32);
        assert!(matches!(route, GaussRoute::General | GaussRoute::ConstantMass), "{} {route:?}", system.name());
        let oracle = legendre(&forced, t + 1.0, &motion(&forced, t, &x, 1.0));
        // The oracle's tolerance, 3e-14 a step.
        let off = relative_distance(truth, oracle);
        assert!(off <= 1e-12, "{}: {off:e} from the oracle", system.name());
        for s in 1..=3 {
            let errors: Vec<_> = finest[s - 1]
                .iter()
                .map(|steps| {
                    let h = 1.0 / *steps as f64;
                    let (e, _) = gauss(&forced, t, x, s, h, *steps);
                    (h, [(e.q - truth.q).max_abs_or_nan(), (e.p - truth.p).max_abs_or_nan(), (e.z - truth.z).abs()])
                })
                .collect();
            for (component, name) in ["q", "p", "z"].iter().enumerate() {
                let points: Vec<_> = errors.iter().map(|(h, e)| (*h, e[component])).collect();
                let observed = slope(&points);
                assert!(
                    (observed - 2.0 * s as f64).abs() < 0.15,
                    "{} s = {s}: {observed:.3} in {name}; {points:?}",
                    system.name()
                );
            }
        }
    }
    let square = QuadraticInZ { c: 1.0 };
    of(&square, one(square), [[64, 90, 128, 180], [24, 32, 48, 64], [12, 16, 20, 24]]);
    let plane = CoupledPlane { c: 1.5, ..CoupledPlane::default() };
    of(&plane, two(plane), [[64, 90, 128, 180], [24, 32, 48, 64], [12, 16, 20, 24]]);
}

/// A separable Lagrangian with a force of positions and time takes the condensed route; without that claim it takes the
/// general one. The two are equal to round-off, after 100 steps to the 30 eps that `gauss::routes_agree` allows.
#[test]
fn a_force_of_positions_takes_the_condensed_route() {
    fn of<const N: usize, L: Lagrangian<N>>(system: &impl System<N>, lagrangian: fn() -> L, s: usize, h: f64) {
        let x = system.initial();
        let forced = |force| Forced { lagrangian: lagrangian(), force };
        let condensed = gauss(&forced(Applied::from(Swirl)), 0.0, x, s, h, 100);
        let general = gauss(&forced(Applied::from(Undeclared(Swirl))), 0.0, x, s, h, 100);
        assert_eq!((condensed.1, general.1), (GaussRoute::Condensed, GaussRoute::ConstantMass), "{}", system.name());
        let off = relative_distance(condensed.0, general.0) / f64::EPSILON;
        assert!(off <= 30.0, "{} s = {s}: {off} eps", system.name());
    }
    for s in [3, 8, 13] {
        of(&Pendulum { gamma: -0.1 }, || one(Pendulum { gamma: -0.1 }), s, 0.1);
        of(&Kepler::<2>::default(), || kepler(Kepler::default()), s, 0.05);
    }
}

/// Long steps with a force of positions, which Newton's method solves, agree with the general route.
#[test]
fn long_steps_by_newtons_method() {
    let forced = |force| Forced { lagrangian: one(Pendulum { gamma: -0.1 }), force };
    let x = VelocityPoint::new([2.0], [1.0], 0.0);
    let condensed = gauss(&forced(Applied::from(Swirl)), 0.0, x, 4, 5.0, 3).0;
    let general = gauss(&forced(Applied::from(Undeclared(Swirl))), 0.0, x, 4, 5.0, 3).0;
    let off = relative_distance(condensed, general);
    assert!(off <= 1e-12, "{off:e}");
}

/// Stiff drag, with c h up to 100: each step is solved, and the velocity decays by the stability function of the
/// method, the diagonal Pade approximant of `e^(-c h)`.
#[test]
fn stiff_drag_converges() {
    for (s, ch) in [(1, 10.0), (2, 1.0), (2, 10.0), (3, 10.0), (4, 30.0), (8, 100.0)] {
        let free = Structure { autonomous: true, z_free: true, constant_mass: true, ..Structure::default() };
        let system = One::from(crate::common::lagrangians::WithStructure(Fall, free));
        let (h, steps) = (0.1, 5);
        let c = ch / h;
        let forced = Forced { lagrangian: system, force: Applied::Drag(Drag { c, k: 0.0 }) };
        let start = VelocityPoint::new([0.0], [1.0], 0.0);
        let (end, _) = gauss(&forced, 0.0, start, s, h, steps);
        // P(-x)/P(x) with P(x) = sum_k (2s-k)! s! / ((2s)! k! (s-k)!) x^k.
        let pade = |x: f64| {
            (0..s).rev().fold(1.0, |sum, k| {
                let ratio = (s - k) as f64 / ((2 * s - k) as f64 * (k + 1) as f64);
                1.0 + sum * ratio * x
            })
        };
        let decay = (pade(-ch) / pade(ch)).powi(steps as i32);
        let expected = -G / c + (1.0 + G / c) * decay;
        assert!((end.p[0] - expected).abs() <= 1e-12, "s = {s}, c h = {ch}: {} {expected}", end.p[0]);
    }
}

/// Under a drag along the velocity the direction of the angular momentum is kept, in space, where the orbit stays in its
/// plane, to the round-off of 1000 steps; its size decreases.
#[test]
fn drag_keeps_the_direction_of_angular_momentum() {
    let drag = Applied::Drag(Drag { c: 0.0, k: 0.005 });
    let forced = Forced { lagrangian: Kepler::<3> { gamma: 0.0, mu: 1.0 }, force: drag };
    let x = VelocityPoint::new([0.8, 0.3, 0.1], [-0.3, 0.9, 0.4], 0.0);
    let (end, _) = gauss(&forced, 0.0, x, 6, 0.05, 1000);
    let (before, after) = (x.q.cross(&x.v), end.q.cross(&end.p));
    let turned = (before.normalize() - after.normalize()).norm();
    assert!(turned <= 1e-13, "turned by {turned:e}");
    let ratio = after.norm() / before.norm();
    assert!(ratio < 0.95 && ratio > 0.1, "{ratio}");
}

/// A run by its builder: the outcome is that of the stepper, and accuracy can be requested.
#[test]
fn runs_take_forces() {
    let forced = Forced { lagrangian: One::from(Fall), force: Applied::Drag(Drag { c: 0.0, k: 0.2 }) };
    let problem = Problem::new(&forced, 0.0, VelocityPoint::new([0.0], [0.0], 0.0)).unwrap();
    let run = problem.by(GaussCollocation { stages: 6 }).steps(Steps::Count(40)).run(Until::Time(2.0)).unwrap();
    let q = -((G * 0.2_f64).sqrt() * 2.0).cosh().ln() / 0.2;
    assert!((run.q[0] - q).abs() <= 1e-12 * q.abs(), "{} {q}", run.q[0]);
    let chosen = problem.accuracy(1e-10).run(Until::Time(2.0)).unwrap();
    assert!((chosen.q[0] - q).abs() <= 1e-9 * q.abs(), "{} {q}", chosen.q[0]);
}
