//! Runs under constraints: an accuracy, rows, events, checkpoints, and what is refused.

use contact_examples::systems::Pendulum;
use contact_examples::systems::constrained::RigidPendulum;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use discrete_herglotz::constraints::{Constrained, ConstrainedMethod, ConstrainedStart, ConstraintError};
use discrete_herglotz::{
    Checkpoint, Event, Events, InputError, Integrator, Observer, Outcome, Problem, ResumeState, Rows, SplittingScheme,
    Status, StepView, Steps, Stop, Until,
};
use std::ops::ControlFlow;

pub const METHODS: [ConstrainedMethod; 4] = [
    ConstrainedMethod::Rattle(SplittingScheme::STRANG),
    ConstrainedMethod::Rattle(SplittingScheme::KAHAN_LI_8),
    ConstrainedMethod::Lobatto { stages: 3 },
    ConstrainedMethod::Lobatto { stages: 5 },
];

/// The order of a method.
fn order(method: ConstrainedMethod) -> i32 {
    match method {
        ConstrainedMethod::Rattle(scheme) => scheme.order() as i32,
        ConstrainedMethod::Lobatto { stages } => 2 * stages as i32 - 2,
    }
}

/// A pendulum of gravity 1 in the plane, through its highest point, from an angle to the vertical with a speed.
pub fn swung(angle: f64, speed: f64) -> VelocityPoint<2> {
    let (s, c) = angle.sin_cos();
    VelocityPoint::new([s, -c], [speed * c, speed * s], 0.2)
}

/// The motion under the constraint is that of the pendulum in its angle, to the accuracy that is requested, with the
/// action, with rows and with events: here the zeros of a coordinate.
#[test]
fn an_accuracy_is_met() {
    let gamma = -0.05;
    let (system, in_angle) = (RigidPendulum::<2> { gravity: 1.0, gamma }, Pendulum { gamma });
    let until = Until::Time(10.0);
    let angles = Problem::new(&in_angle, 0.0, VelocityPoint::new([1.0], [2.5], 0.2)).unwrap();
    let (mut lowest, mut rows) = (Events::new([Event::new(|_, x| x.q[0].sin())]), Rows::at([3.3, 7.7]).unwrap());
    let expected = angles.accuracy(1e-13).observe(&mut lowest).observe(&mut rows).run(until).unwrap();
    // It passes its highest point.
    assert!(expected.q[0] > std::f64::consts::PI && lowest.crossings.len() > 3);
    for method in METHODS {
        let accuracy = if order(method) == 2 { 1e-6 } else { 1e-10 };
        let problem = Problem::new(&system, 0.0, swung(1.0, 2.5)).unwrap();
        let mut crossed = Events::new([Event::new(|_, x| x.q[0])]);
        let mut seen = Rows::at([3.3, 7.7]).unwrap();
        let run = problem.by(Constrained::new(&system, method)).accuracy(accuracy);
        let found = run.observe(&mut crossed).observe(&mut seen).run(until).unwrap();
        assert_eq!((found.status, found.unresolved), (Status::Completed, None), "{method:?}");
        let position = found.q[0] - expected.q[0].sin();
        assert!(position.abs() <= accuracy, "{method:?}: {position:e}");
        // The potential of the pendulum in its angle vanishes at the lowest point, that of the other one at the centre. The
        // action is no part of the requested accuracy; its rate is below 5 for an error 1 of the state.
        let action = found.z.unwrap() - expected.z.unwrap() - f64::exp_m1(10.0 * gamma) / gamma;
        assert!(action.abs() <= 50.0 * accuracy, "{method:?}: {action:e}");
        assert_eq!(crossed.crossings.len(), lowest.crossings.len(), "{method:?}");
        for (a, b) in crossed.crossings.iter().zip(&lowest.crossings) {
            // The rate of the coordinate there is the speed, above one half.
            assert!((a.t - b.t).abs() <= 4.0 * accuracy && a.state.q[0].abs() < 1e-13, "{method:?}: {a:?}, {b:?}");
        }
        for (a, b) in seen.rows.iter().zip(&rows.rows) {
            assert!((a.q[0] - b.q[0].sin()).abs() <= 2.0 * accuracy, "{method:?} at {}", b.t);
            assert!((a.q.norm() - 1.0).abs() < 1e-14);
        }
    }
}

/// Ends a run after this step.
struct StopsAt(usize);

impl Observer for StopsAt {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.k == self.0 { ControlFlow::Break(Stop::here("a test")) } else { ControlFlow::Continue(()) }
    }
}

/// A stopped run continues to the same bits.
#[test]
fn runs_are_resumed() {
    let system = RigidPendulum::<2> { gravity: 1.0, gamma: -0.1 };
    let problem = Problem::new(&system, 0.0, swung(1.0, 0.5)).unwrap();
    let path = std::env::temp_dir().join(format!("under_constraints_{}", std::process::id()));
    for method in METHODS {
        let run = || problem.by(Constrained::new(&system, method)).steps(Steps::Count(40)).with_conformal_factor();
        let whole = run().run(Until::Time(4.0)).unwrap();
        // Exact for a linear drag by RATTLE, of the order of the method otherwise.
        let bound = if matches!(method, ConstrainedMethod::Rattle(_)) { 1e-14 } else { 1e-10 };
        assert!((whole.log_factor.unwrap() + 0.4).abs() < bound, "{method:?}: {whole:?}");
        let mut saved = Checkpoint::every(13, &path).unwrap();
        let mut interrupt = StopsAt(13);
        let stopped = run().observe(&mut saved).observe(&mut interrupt).run(Until::Time(4.0)).unwrap();
        assert_eq!((stopped.steps, saved.error.is_none()), (13, true));
        let resumed = run().resume(ResumeState::read(&path).unwrap()).run(Until::Time(4.0)).unwrap();
        assert_eq!(resumed, whole, "{method:?}");
    }
    std::fs::remove_file(path).unwrap();
}

/// The derivative of a step along vectors that are tangent to the constraints is that of differences of steps.
#[test]
fn steps_are_differentiated_along_the_constraint() {
    let system = RigidPendulum::<2> { gravity: 1.0, gamma: -0.1 };
    for method in METHODS {
        let by = Constrained::new(&system, method);
        let end = |angle: f64, speed: f64| -> Outcome {
            let problem = Problem::new(&system, 0.0, swung(angle, speed)).unwrap();
            problem.by(by).steps(Steps::Count(1)).run(Until::Time(0.1)).unwrap()
        };
        let problem = Problem::new(&system, 0.0, swung(1.0, 0.5)).unwrap();
        let (from, to) =
            (problem.by(by).steps(Steps::Count(1)).run(Until::Time(0.0)).unwrap().state(), end(1.0, 0.5).state());
        let jacobian = by.step_jacobian(&problem, 0.1, (0.0, &from.fixed(), &to.fixed())).unwrap().unwrap();
        let (s, c) = f64::sin_cos(1.0);
        // Of the angle, with its rotation of the velocity, and of the speed.
        let directions = [[c, s, -0.5 * s, 0.5 * c, 0.0], [0.0, 0.0, c, s, 0.0]];
        for (direction, [da, dv]) in directions.into_iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
            let along = &jacobian * contact_geom::nalgebra::DVector::from_row_slice(&direction);
            let d = 1e-3;
            let numbers = |k: f64| {
                let x = end(1.0 + k * d * da, 0.5 + k * d * dv).state();
                SVector::<f64, 5>::from([x.q[0], x.q[1], x.p[0], x.p[1], x.z])
            };
            // Differences of fourth order: an error of d^4 / 30 of a fifth derivative below 10, and of round-off.
            let slope = ((numbers(1.0) - numbers(-1.0)) * 8.0 - (numbers(2.0) - numbers(-2.0))) / (12.0 * d);
            for i in 0..5 {
                assert!((along[i] - slope[i]).abs() < 2e-12, "{method:?} {i}: {} and {}", along[i], slope[i]);
            }
        }
    }
}

/// A potential with a kink.
struct Kinked;

impl Lagrangian<2> for Kinked {
    const HINTS: contact_geom::Hints = contact_geom::Hints { switching_functions: true, ..contact_geom::Hints::NONE };
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        v.dot(v) * 0.5 - if q[0].re() < 0.0 { -q[0] } else { q[0] }
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<2>, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, z_affine: true, separable: true, ..Structure::default() }
    }
}

/// What a run under constraints refuses before its first step.
#[test]
fn what_does_not_apply_is_refused() {
    let system = RigidPendulum::<2> { gravity: 1.0, gamma: -0.1 };
    let refused = |start: VelocityPoint<2>, method| {
        let problem = Problem::new(&system, 0.0, start).unwrap();
        problem.by(Constrained::new(&system, method)).steps(Steps::Count(10)).run(Until::Time(1.0)).err()
    };
    for method in METHODS {
        let off = refused(VelocityPoint::new([1.1, 0.0], [0.0, 0.0], 0.0), method);
        let named = matches!(off, Some(InputError::Constraint(ConstraintError::OffConstraint { index: 0, .. })));
        assert!(named, "{off:?}");
        let off = refused(VelocityPoint::new([1.0, 0.0], [0.1, 0.0], 0.0), method);
        assert!(matches!(off, Some(InputError::Constraint(ConstraintError::OffVelocity { .. }))), "{off:?}");
    }
    let stages = refused(swung(1.0, 0.0), ConstrainedMethod::Lobatto { stages: 9 });
    assert_eq!(stages, Some(InputError::Constraint(ConstraintError::Stages { found: 9 })));
    let nystrom = SplittingScheme::ALL.into_iter().find(SplittingScheme::is_nystrom).unwrap();
    let scheme = refused(swung(1.0, 0.0), ConstrainedMethod::Rattle(nystrom));
    assert!(matches!(scheme, Some(InputError::Hypothesis { .. })), "{scheme:?}");
    // A start off the constraint, resolved before.
    let off = ConstrainedStart {
        off_constraint: discrete_herglotz::constraints::OffConstraint::Project,
        ..ConstrainedStart::new(VelocityPoint::new([1.1, 0.0], [0.1, 0.0], 0.0))
    };
    assert_eq!(refused(off.resolved(&system, &system).unwrap(), METHODS[0]), None);

    let problem = Problem::new(&Kinked, 0.0, swung(1.0, 0.0)).unwrap();
    let kinked = problem.by(Constrained::new(&system, METHODS[0])).steps(Steps::Count(10)).run(Until::Time(1.0)).err();
    assert_eq!(kinked, Some(InputError::KinksUnderConstraints));
    // Round-off is not met.
    let problem = Problem::new(&system, 0.0, swung(1.0, 0.0)).unwrap();
    let missed = problem.by(Constrained::new(&system, METHODS[1])).accuracy(1e-17).run(Until::Time(1.0)).err();
    assert!(matches!(missed, Some(InputError::Accuracy { .. })), "{missed:?}");
}
