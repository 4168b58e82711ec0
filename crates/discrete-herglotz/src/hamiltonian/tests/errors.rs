//! Typed errors of input and of steps.

use super::{Plane, random_point};
use crate::hamiltonian::{
    ActionPart, AffineFlow, ContactEuler, HamiltonianSplitting, Kinetic, PieceStepper, PieceSum, Potential, Prolonged,
    Quadratic,
};
use crate::splitting::Riccati;
use crate::{InputError, Integrator, Problem, SplittingScheme, StepError, Stepper, StepperOptions};
use contact_geom::nalgebra::SMatrix;
use contact_geom::{OfHamiltonian, PhasePoint};

fn form(a: f64) -> Quadratic<1> {
    let one = SMatrix::<f64, 1, 1>::identity();
    Quadratic::new(one * a, one * 0.0, one, -0.1)
}

#[test]
fn pieces_that_do_not_sum_to_the_hamiltonian() {
    let hamiltonian = OfHamiltonian(form(1.0));
    let problem = Problem::new(&hamiltonian, 0.0, PhasePoint::new([1.0], [1.0], 0.0)).unwrap();
    let shift = Prolonged(AffineFlow { z: 1e-8, ..AffineFlow::ZERO });
    let splitting = HamiltonianSplitting { pieces: (form(1.0), shift), scheme: SplittingScheme::STRANG };
    match splitting.stepper(&problem, 0.1, StepperOptions::default()).err() {
        // H = 1 and the piece 1: a difference of 1e-8 in terms of size 2.
        Some(InputError::PieceSum { size }) => assert!((size - 0.5e-8).abs() < 1e-14, "{size}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn flows_of_other_hamiltonians() {
    let new = |pieces| PieceStepper::new(pieces, &SplittingScheme::STRANG, 0.1, 0.0, random_point::<2>(0));
    assert!(new((Kinetic(Plane::Kinetic), Potential(Plane::Potential))).is_ok());
    // The potential depends on q, so that it has another flow.
    match new((Kinetic(Plane::Potential), Potential(Plane::Potential))).err() {
        Some(InputError::PieceFlow { index: 0, size }) => assert!(size > 1e-3),
        other => panic!("{other:?}"),
    }
    match new((Kinetic(Plane::Kinetic), Potential(Plane::Kinetic))).err() {
        Some(InputError::PieceFlow { index: 1, .. }) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn steps_and_schemes_that_are_not_possible() {
    let x = PhasePoint::new([1.0], [1.0], 0.0);
    let new = |scheme: SplittingScheme, h: f64| PieceStepper::new((form(1.0),), &scheme, h, 0.0, x).err();
    assert_eq!(new(SplittingScheme::STRANG, 0.0), Some(InputError::Step { h: 0.0 }));
    assert!(matches!(new(SplittingScheme::BLANES_MOAN_4, 0.1), Some(InputError::Hypothesis { .. })));
    let none = PieceStepper::new(Vec::<Quadratic<1>>::new(), &SplittingScheme::STRANG, 0.1, 0.0, x).err();
    assert!(matches!(none, Some(InputError::Count { found: 0, .. })));
    let nystrom = ContactEuler::Symmetric(SplittingScheme::BLANES_MOAN_4);
    assert!(matches!(nystrom.check(&OfHamiltonian(form(1.0))), Err(InputError::Hypothesis { .. })));
}

/// H = 5 z: sigma = 1 - 5 h of type II, 1/(1 + 5 h) of type III.
#[test]
fn a_factor_that_is_not_positive() {
    let drag = OfHamiltonian(PieceSum((Prolonged(AffineFlow::<1> { zz: -5.0, ..AffineFlow::ZERO }),)));
    let problem = Problem::new(&drag, 0.0, PhasePoint::new([1.0], [1.0], 1.0)).unwrap();
    let new = |by: ContactEuler, h| by.stepper(&problem, h, StepperOptions::default());
    match new(ContactEuler::TypeTwo, 0.3).err() {
        Some(InputError::Sigma { sigma }) => assert!((sigma + 0.5).abs() < 1e-15),
        other => panic!("{other:?}"),
    }
    assert!(matches!(new(ContactEuler::TypeThree, -0.3).err(), Some(InputError::Sigma { .. })));
    let mut forward = new(ContactEuler::TypeThree, 0.3).unwrap();
    forward.advance(1).unwrap();
    assert!((forward.sigma() - 0.4).abs() < 1e-15);
    // 1 + 5 h = 0 is a singular equation for z1.
    let singular = new(ContactEuler::TypeThree, -0.2).err();
    assert!(matches!(singular, Some(InputError::FirstStep(StepError::Singular { .. }))), "{singular:?}");
}

/// z' = z^2 from z = 1 ends at the time 1: the step that fails leaves the state before it.
#[test]
fn a_failed_step_keeps_the_state() {
    let pieces = (Prolonged(ActionPart(Riccati { b: 0.0, c: 1.0 })),);
    let start = PhasePoint::new([1.0], [1.0], 1.0);
    let mut motion = PieceStepper::new(pieces, &SplittingScheme::STRANG, 0.15, 0.0, start).unwrap();
    let failure = motion.advance(10).unwrap_err();
    assert_eq!((failure.taken, failure.cause), (6, StepError::NonFinite));
    // z = 1/(1 - t), whose condition is z.
    assert!((motion.state().z - 10.0).abs() < 1e-12 && (motion.time() - 0.9).abs() < 1e-15);
    assert_eq!(motion.evaluations(), 7);
}
