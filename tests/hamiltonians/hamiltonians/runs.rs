//! Runs on a contact Hamiltonian: a requested accuracy, rows, events, dense output, checkpoints, ensembles, forces.

use super::systems::{Line, One, Push, Two};
use crate::common::observers::StopsAt;
use crate::common::relative_distance;
use contact_examples::systems::Pendulum;
use contact_geom::{Forced, OfHamiltonian, PhasePoint, VelocityPoint};
use discrete_herglotz::{
    Checkpoint, Ensemble, Event, Events, GaussCollocation, InputError, Problem, ResumeState, Rows, Status, Stepper,
    StepperOptions, Steps, Until, gauss::GaussStepper,
};

/// The start of a motion with one coordinate.
fn one() -> PhasePoint<1> {
    PhasePoint::new([0.4], [0.7], 0.3)
}

/// A requested accuracy is met, for each rank of `H_pp`: against eight times as many steps.
#[test]
fn a_requested_accuracy_is_met() {
    for (name, system) in [("nonlinear", One::Nonlinear), ("linear", One::Linear), ("homogeneous", One::Homogeneous)] {
        let hamiltonian = OfHamiltonian(system);
        let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, one()).unwrap();
        for accuracy in [1e-6, 1e-9, 1e-12] {
            let found = problem.accuracy(accuracy).run(Until::Time(10.0)).unwrap();
            assert_eq!((found.status, found.unresolved), (Status::Completed, None), "{name} to {accuracy:e}");
            let steps = 8 * found.steps.max(64);
            let method = GaussCollocation { stages: 8 };
            let exact = problem.by(method).steps(Steps::Count(steps)).run(Until::Time(10.0)).unwrap();
            let off = relative_distance(found.state(), exact.state());
            assert!(off <= accuracy, "{name} to {accuracy:e} in {} steps: {off:e}", found.steps);
        }
    }
}

/// Rows and events of a run with H are those of its collocation polynomial; the energy of an autonomous H decays with
/// the conformal factor, `H(t) = sigma H(0)`.
#[test]
fn rows_events_and_the_energy() {
    let hamiltonian = OfHamiltonian(One::Homogeneous);
    let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, one()).unwrap();
    let mut rows = Rows::at([0.7, 1.9, 3.3]).unwrap().with_energy().with_velocity();
    let mut events = Events::new([Event::new(|_, x| x.q[0] - 2.0)]);
    let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.25));
    run.observe(&mut rows).observe(&mut events).run(Until::Time(4.0)).unwrap();
    let energy = |t: f64| (0.7 * (1.0 + 0.25 * 0.4_f64.sin().powi(2)) + 0.03) * (-0.1 * t).exp();
    assert_eq!(rows.rows.len(), 3);
    for row in &rows.rows {
        let off = (row.energy.unwrap() - energy(row.t)).abs();
        assert!(off <= 1e-13, "t = {}: {off:e}", row.t);
        // q' = H_p = 1 + sin(q)^2/4.
        let v = row.v.as_ref().unwrap()[0] - (1.0 + 0.25 * row.q[0].sin().powi(2));
        assert!(v.abs() <= 1e-15, "t = {}: {v:e}", row.t);
    }
    // The time from q0 to q is the integral of dq / (1 + sin^2/4) = 2 atan(sqrt(5)/2 tan q)/sqrt(5), on its branch.
    let primitive = |q: f64| {
        let turns = (q / std::f64::consts::PI + 0.5).floor();
        ((5.0_f64.sqrt() / 2.0 * q.tan()).atan() + turns * std::f64::consts::PI) * 2.0 / 5.0_f64.sqrt()
    };
    let expected = primitive(2.0) - primitive(0.4);
    assert_eq!(events.crossings.len(), 1);
    let off = (events.crossings[0].t - expected).abs();
    assert!(off <= 1e-13, "{off:e}");
}

/// A run that is resumed from a checkpoint continues bit by bit.
#[test]
fn a_resumed_run_is_the_same() {
    let hamiltonian = OfHamiltonian(Two::Ray);
    let start = PhasePoint::new([0.4, -0.2], [0.7, 0.5], 0.3);
    let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, start).unwrap();
    let run = || problem.by(GaussCollocation { stages: 6 }).steps(Steps::Size(0.125));
    let whole = run().run(Until::Time(10.0)).unwrap();
    let path = std::env::temp_dir().join(format!("a_ray_{}.checkpoint", std::process::id()));
    let mut saved = Checkpoint::every(7, &path).unwrap();
    let mut enough = StopsAt(30, "a test");
    run().observe(&mut saved).observe(&mut enough).run(Until::Time(10.0)).unwrap();
    let resumed = run().resume(ResumeState::read(&path).unwrap()).run(Until::Time(10.0)).unwrap();
    std::fs::remove_file(path).unwrap();
    assert_eq!(resumed, whole);
}

/// The members of an ensemble are single runs.
#[test]
fn an_ensemble_of_hamiltonian_motions() {
    let hamiltonian = OfHamiltonian(One::Linear);
    let start = |i: usize| PhasePoint::new([0.2 + 0.1 * i as f64], [0.3], 0.1);
    let method = GaussCollocation { stages: 8 };
    let ensemble = Ensemble::new(&hamiltonian, 0.0, 5, start).by(method).steps(Steps::Size(0.05));
    let mut ends = Vec::new();
    ensemble
        .run(Until::Time(3.0), |member| {
            ends.push(member.ending.as_ref().unwrap().state.clone());
        })
        .unwrap();
    assert_eq!(ends.len(), 5);
    for (i, end) in ends.into_iter().enumerate() {
        let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, start(i)).unwrap();
        let single = problem.by(method).steps(Steps::Size(0.05)).run(Until::Time(3.0)).unwrap();
        assert_eq!(end, single.state());
    }
}

/// A force on a Hamiltonian motion is that on the Lagrangian motion: `f = -0.3 v + sin t`.
#[test]
fn a_force_acts_on_a_hamiltonian_motion() {
    let pendulum = Pendulum { gamma: -0.1 };
    let x = VelocityPoint::new([1.0], [0.5], 0.2);
    let by_lagrangian = Line::from(Forced::new(pendulum, Push));
    let by_hamiltonian = Forced::new(OfHamiltonian(One::Of(pendulum.into())), Push);
    let options = StepperOptions { action: true, check_resolution: false, ..StepperOptions::default() };
    let a = Problem::new(&by_lagrangian, 0.0, x).unwrap();
    let mut a = GaussStepper::new(&a, 8, 0.1, options).unwrap();
    a.advance(50).unwrap();
    let b = Problem::new(&by_hamiltonian, 0.0, PhasePoint::new([1.0], [0.5], 0.2)).unwrap();
    let mut b = GaussStepper::new(&b, 8, 0.1, options).unwrap();
    b.advance(50).unwrap();
    let off = relative_distance(a.state(), b.state());
    assert!(off <= 1e-13, "{off:e}");
}

/// Bad input is refused before the first step, with its reason.
#[test]
fn invalid_input_is_refused() {
    let refused = |system: One, start: PhasePoint<1>| {
        let hamiltonian = OfHamiltonian(system);
        Problem::of_hamiltonian(&hamiltonian, 0.0, start).unwrap_err()
    };
    let nan = PhasePoint::new([0.4], [f64::NAN], 0.3);
    assert!(matches!(refused(One::Linear, nan), InputError::Geometry(_)));
    assert_eq!(refused(One::Undefined, PhasePoint::new([-1.0], [1.0], 0.0)), InputError::Undefined);
    assert!(matches!(
        refused(One::FalseClaim, one()),
        InputError::FalseClaim { claim: "degree", size } if size > 1e-3
    ));
    // A velocity has no momentum where H is linear in p.
    let hamiltonian = OfHamiltonian(One::Linear);
    let from_velocity = Problem::new(&hamiltonian, 0.0, VelocityPoint::new([0.4], [0.7], 0.3)).unwrap_err();
    assert_eq!(from_velocity, InputError::NoMomentum);
    assert!(from_velocity.to_string().contains("start from a momentum"));
    // A regular H can start from a velocity.
    let hamiltonian = OfHamiltonian(One::Nonlinear);
    let problem = Problem::new(&hamiltonian, 0.0, VelocityPoint::new([0.4], [0.7], 0.3)).unwrap();
    let p = problem.state().p[0];
    assert!((p + 0.2 * p.powi(3) - 0.7).abs() <= 4.0 * f64::EPSILON, "{p}");
}
