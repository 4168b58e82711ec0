//! Modified Hamiltonians of steps: by differences of states, by Jacobi brackets, and in closed form.

use super::systems::One;
use crate::common::slope;
use contact_examples::systems::{HarmonicOscillator, OneCoordinate, Pendulum};
use contact_geom::nalgebra::SMatrix;
use contact_geom::numbers::max_abs_or_nan;
use contact_geom::{OfHamiltonian, PhasePoint, VelocityPoint};
use discrete_herglotz::hamiltonian::{modified_defects, modified_hamiltonian};
use discrete_herglotz::{GaussCollocation, InputError, Integrator, Problem, SplittingScheme, StepperOptions};

/// The states after consecutive steps of a method on a motion of the catalogue.
fn states(system: &OneCoordinate, start: VelocityPoint<1>, h: f64, steps: usize) -> (Vec<PhasePoint<1>>, f64) {
    let problem = Problem::new(system, 0.0, start).unwrap();
    let options = StepperOptions { action: true, check_resolution: false, ..StepperOptions::default() };
    let mut stepper = SplittingScheme::STRANG.stepper(&problem, h, options).unwrap();
    let mut states = vec![stepper.state().fixed()];
    for _ in 0..steps {
        stepper.advance(1).unwrap();
        states.push(stepper.state().fixed());
    }
    (states, stepper.sigma())
}

/// `H~_k o Phi = sigma_d H~_k + O(h^(k+1))` for k from 1 to 6: for the Strang splitting of a damped pendulum, and for the
/// implicit midpoint rule of an H that is nonlinear in all variables.
#[test]
fn a_step_keeps_its_modified_hamiltonian() {
    let pendulum: OneCoordinate = Pendulum { gamma: -0.3 }.into();
    let by_splitting = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.7], 0.2)).unwrap();
    let by_splitting = modified_defects(&by_splitting, &SplittingScheme::STRANG, 4.0, &[0.05, 0.1, 0.2], 6).unwrap();
    let nonlinear = OfHamiltonian(One::Nonlinear);
    let by_midpoint = Problem::of_hamiltonian(&nonlinear, 0.0, PhasePoint::new([0.4], [0.7], 0.3)).unwrap();
    let by_midpoint =
        modified_defects(&by_midpoint, &GaussCollocation { stages: 1 }, 4.0, &[0.0125, 0.025, 0.05], 6).unwrap();
    for (name, defects) in [("strang", by_splitting), ("midpoint", by_midpoint)] {
        for k in 1..=6 {
            let points: Vec<_> = defects.iter().filter(|d| d.k == k).map(|d| (d.h, d.defect)).collect();
            // Above the round-off of differences of order k, 2^k eps / h.
            assert!(points.len() == 3 && points.iter().all(|point| point.1 > 1e-12), "{name}, k = {k}: {points:?}");
            let order = slope(&points);
            assert!((order - (k as f64 + 1.0)).abs() < 0.15, "{name}, k = {k}: slope {order}, {points:?}");
        }
    }
}

/// For fixed h the smallest defect over k is small as `e^(-c/h)`: its logarithm falls at least in proportion to 1/h, until
/// round-off.
#[test]
fn the_smallest_defect_is_exponentially_small() {
    let pendulum: OneCoordinate = Pendulum { gamma: -0.3 }.into();
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.7], 0.2)).unwrap();
    let defects = modified_defects(&problem, &SplittingScheme::STRANG, 4.0, &[0.8, 0.4, 0.2], 8).unwrap();
    let smallest = |h: f64| {
        let of_h = defects.iter().filter(|d| d.h == h).map(|d| d.defect);
        of_h.fold(f64::INFINITY, |least, defect| if defect < least { defect } else { least })
    };
    let [long, middle, short] = [0.8, 0.4, 0.2].map(|h| smallest(h).ln());
    assert!(long < -2.0 && middle < 1.6 * long && short < 1.6 * middle, "{long} {middle} {short}");
}

/// The modified Hamiltonian of the Strang splitting of `A = 1 - cos q` and `B = p^2/2 - gamma z` consists of Jacobi
/// brackets: the difference of the interpolated one from `A + B - h^2 ({A, {A, B}}/24 + {B, {A, B}}/12)` is of order four.
#[test]
fn the_correction_of_the_splitting_consists_of_brackets() {
    let gamma = -0.3;
    let pendulum: OneCoordinate = Pendulum { gamma }.into();
    let start = VelocityPoint::new([1.0], [0.7], 0.2);
    let series = |x: &PhasePoint<1>, h: f64| {
        let (sin, cos) = x.q[0].sin_cos();
        let (a, p) = (1.0 - cos, x.p[0]);
        // {A, B} = gamma A - A' p, as X_A = (0, -A', -A) and R(B) = -gamma.
        let [aab, bab] = [sin * sin, gamma * sin * p - cos * p * p - gamma * gamma * a];
        a + 0.5 * p * p - gamma * x.z - h * h * (aab / 24.0 + bab / 12.0)
    };
    // The largest difference over a span: at single states its leading term may vanish.
    let off = |h: f64, corrected: f64| {
        let (states, _) = states(&pendulum, start, h, (4.0 / h).round() as usize);
        let of_states = states
            .windows(9)
            .map(|around| modified_hamiltonian(around, h).unwrap() - series(&around[4], h * corrected));
        max_abs_or_nan(of_states)
    };
    let points: Vec<_> = [0.05, 0.1, 0.2].map(|h| (h, off(h, 1.0))).into();
    let order = slope(&points);
    assert!((order - 4.0).abs() < 0.15, "order {order}, {points:?}");
    // Without it the difference is of order two.
    let points: Vec<_> = [0.05, 0.1, 0.2].map(|h| (h, off(h, 0.0))).into();
    assert!((slope(&points) - 2.0).abs() < 0.15, "{points:?}");
}

/// A step of the damped oscillator is a matrix on (q, p), and `sigma_d = e^(gamma h)`. The logarithm of the matrix gives the
/// modified Hamiltonian `b p^2/2 + a q p - c q^2/2 - gamma z` with `log(M)/h = ((a, b), (c, gamma - a))`.
#[test]
fn the_oscillator_has_it_in_closed_form() {
    let (gamma, h) = (-0.2, 0.1);
    let oscillator: OneCoordinate = HarmonicOscillator { gamma }.into();
    let image = |q: f64, p: f64| states(&oscillator, VelocityPoint::new([q], [p], 0.0), h, 1).0[1];
    let (of_q, of_p) = (image(1.0, 0.0), image(0.0, 1.0));
    let m = SMatrix::<f64, 2, 2>::new(of_q.q[0], of_p.q[0], of_q.p[0], of_p.p[0]);
    let root = m.determinant().sqrt();
    assert!((root - (0.5 * gamma * h).exp()).abs() < 1e-15);
    let cosine = 0.5 * m.trace() / root;
    let angle = cosine.acos();
    let unit = SMatrix::<f64, 2, 2>::identity();
    let field = (unit * (0.5 * gamma * h) + (m / root - unit * cosine) * (angle / angle.sin())) / h;
    let (found, _) = states(&oscillator, VelocityPoint::new([0.8], [0.5], 0.3), h, 8);
    let PhasePoint { q, p, z } = found[4];
    let (a, b, c) = (field[(0, 0)], field[(0, 1)], field[(1, 0)]);
    let closed = 0.5 * b * p[0] * p[0] + a * q[0] * p[0] - 0.5 * c * q[0] * q[0] - gamma * z;
    // The interpolation of order 8 has the error (2 h)^8 (4!)^2 / 9!, as the action has the frequency 2.
    let off = (modified_hamiltonian(&found, h).unwrap() - closed).abs();
    assert!(off < 4.0 * 0.2_f64.powi(8) * 576.0 / 362880.0, "{off:e}");
}

#[test]
fn what_has_no_modified_hamiltonian_is_refused() {
    let forced: OneCoordinate = contact_examples::systems::Duffing::forced().into();
    let problem = Problem::new(&forced, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let of = |most| modified_defects(&problem, &SplittingScheme::STRANG, 1.0, &[0.1], most).unwrap_err();
    assert_eq!(of(3), InputError::Unclaimed { claim: "autonomous" });
    let pendulum: OneCoordinate = Pendulum { gamma: -0.3 }.into();
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let of = |most| modified_defects(&problem, &SplittingScheme::STRANG, 1.0, &[0.1], most).unwrap_err();
    assert!(matches!([of(0), of(9)], [InputError::Count { found: 0, .. }, InputError::Count { found: 9, .. }]));
    assert_eq!(modified_hamiltonian(&[PhasePoint::<1>::new([0.0], [0.0], 0.0)], 0.1), None);
}
