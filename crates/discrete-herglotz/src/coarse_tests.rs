//! Steps that are far too long are marked or refused, by every integrator; and what must not decide about them.

use crate::{Gauss, InputError, Integrator, Scene, Status, Stepper, Steps, Suspicion};
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{HarmonicOscillator, Pendulum};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};

/// How a run of three given steps ends, and its mark; where it begins.
fn run<L: Lagrangian<1>>(
    system: &L,
    integrator: Integrator,
    h: f64,
) -> Result<(Status, Option<Suspicion>), InputError> {
    let start = VelocityPoint::new([1.0], [0.3], 0.0);
    let scene = Scene::new(system, start, 3.0 * h).by(integrator).steps(Steps::Count(3));
    let outcome = scene.plan()?.run()?;
    Ok((outcome.status, outcome.suspicion))
}

/// 0.4 radians in each step or, of many stages, 0.2 in each stage, are followed by all, a quarter of that with order one; and nobody
/// follows 40, or two and a half a stage of Gauss' methods: the longest schemes have some twenty substeps.
fn every_integrator<L: Lagrangian<1>>(system: &L) {
    let (mut marked, mut of_all) = (0, 0);
    for integrator in Integrator::all().into_iter().filter(|integrator| integrator.check(system).is_ok()) {
        let (parts, coarse) = match integrator {
            Integrator::Gauss { stages } => (f64::max(0.5 * stages as f64, 1.0), 2.5 * stages as f64 + 2.5),
            _ => (1.0, 40.0),
        };
        let fine = if integrator.order() == 1 { 0.1 } else { 0.4 * parts };
        assert_eq!(run(system, integrator, fine), Ok((Status::Completed, None)), "{integrator}, h = {fine}");
        let found = run(system, integrator, coarse);
        assert_ne!(found, Ok((Status::Completed, None)), "{integrator}, h = {coarse}");
        marked += usize::from(matches!(found, Ok((Status::Completed, _))));
        of_all += 1;
    }
    // Most runs go on, and are marked.
    assert!(2 * marked > of_all, "{marked} of {of_all}");
}

#[test]
fn coarse_steps_of_a_linear_motion_are_marked() {
    every_integrator(&HarmonicOscillator { gamma: -0.01 });
}

#[test]
fn coarse_steps_of_a_pendulum_are_marked() {
    every_integrator(&Pendulum { gamma: -0.01 });
}

/// `-v^2/6 + 2 q^4`, a force that grows without bound: long steps are solved by Newton's method, or not at all.
struct Runaway;

impl Lagrangian<1> for Runaway {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let square = q[0] * q[0];
        v[0] * v[0] * (-1.0 / 6.0) - square * square * 2.0 + square * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// The action does not act back: whether it is computed decides neither the motion nor where it ends.
#[test]
fn the_action_does_not_decide_where_a_run_ends() {
    let mut by_newton = 0;
    for (stages, tenths) in [1, 2, 4, 8].into_iter().flat_map(|s| (1..20).map(move |k| (s, k))) {
        let gauss = Gauss::new(Runaway, stages, 0.05 * f64::from(tenths)).unwrap();
        let (start, v) = (PhasePoint::new([-0.585], [0.63], 1e3), SVector::from([-1.89]));
        let (mut with, mut without) =
            (gauss.stepper(0.0, start, v).unwrap(), gauss.stepper_without_action(0.0, start, v).unwrap());
        let ends = (with.advance(20), without.advance(20));
        assert_eq!(ends.0, ends.1, "{stages} stages, h = 0.05 * {tenths}");
        let (a, b) = (with.state(), without.state());
        assert_eq!((a.q, a.p), (b.q, b.p), "{stages} stages, h = 0.05 * {tenths}");
        by_newton += with.newton_steps() + u64::from(ends.0.is_err());
    }
    assert!(by_newton > 0);
}

/// The velocity at the start is that of the momentum, from whatever guess: also from one whose difference from it has no digits
/// left.
#[test]
fn a_guess_of_the_velocity_may_be_of_any_size() {
    let gauss = Gauss::new(Pendulum { gamma: -0.01 }, 8, 0.1).unwrap();
    let end = |guess: f64| {
        let mut run = gauss.stepper(0.0, PhasePoint::new([0.5], [0.4], 0.1), SVector::from([guess])).unwrap();
        run.advance(1).unwrap();
        run.state()
    };
    for guess in [0.0, -5.0, 1e10, 1e160] {
        let (found, right) = (end(guess), end(0.4));
        // A rounding or two of numbers below one.
        assert!(
            (found.q - right.q).norm() + (found.p - right.p).norm() <= 4.0 * f64::EPSILON,
            "from {guess:e}: {found:?}"
        );
    }
}
