//! The exact generating function of a quadratic contact Hamiltonian.

use super::{distance, pieces::quadratic, random_point};
use crate::hamiltonian::generating::{Arrangement, ExactTypeTwo, GeneratingFunction, type_two_step};
use crate::hamiltonian::{ContactPiece, Quadratic};
use crate::{Integrator, Problem, StepError, StepperOptions};
use contact_geom::nalgebra::SMatrix;
use contact_geom::{OfHamiltonian, PhasePoint};
use std::f64::consts::{FRAC_PI_2, PI};

#[test]
fn its_map_is_the_flow() {
    for (k, h) in [0.1, 0.7, -0.4, 3.0].into_iter().enumerate() {
        let (x, piece) = (random_point::<2>(k), quadratic());
        let flow = piece.change(&piece.over(h), 0.0, &x);
        let step = type_two_step(&ExactTypeTwo(piece), 0.0, h, &x, &mut 0).unwrap();
        // The condition of E_pp is below 100.
        assert!(distance(&flow.after(&x), &step.after(&x)) < 1e-13, "{h}: {flow:?} {step:?}");
        assert!((flow.sigma_minus_one - step.sigma_minus_one).abs() < 1e-15);
    }
}

/// At h = pi points of the oscillator are conjugate, and L_d does not exist; at h = pi/2 H+ does not.
#[test]
fn it_exists_at_conjugate_points() {
    let one = SMatrix::<f64, 1, 1>::identity();
    let oscillator = Quadratic::new(one, one * 0.0, one, 0.0);
    let start = PhasePoint::new([1.0], [0.5], 0.2);
    let hamiltonian = OfHamiltonian(oscillator);
    let problem = Problem::new(&hamiltonian, 0.0, start).unwrap();
    let method =
        GeneratingFunction { function: ExactTypeTwo(oscillator), order: 64, arrangement: Arrangement::TypeTwo };
    let mut stepper = method.stepper(&problem, PI, StepperOptions::default()).unwrap();
    stepper.advance(2).unwrap();
    assert!(distance(&stepper.state(), &start) < 1e-14, "{:?}", stepper.state());
    let quarter = type_two_step(&method.function, 0.0, FRAC_PI_2, &start, &mut 0);
    // cos(pi/2) is 6e-17 in doubles: the function is finite, and its map loses all digits, or is refused.
    let lost = quarter.is_ok_and(|change| distance(&change.after(&start), &PhasePoint::new([0.5], [-1.0], 0.2)) < 1e-8);
    assert!(!lost);
    let none: Result<_, StepError> = type_two_step(&method.function, 0.0, f64::NAN, &start, &mut 0);
    assert_eq!(none, Err(StepError::NonFinite));
}
