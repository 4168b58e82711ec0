//! Single steps and short runs: orders, the contact form, symmetry, round-off, steps whose iteration does not contract.

use super::systems::{One, Two};
use crate::common::{relative_distance, slope};
use contact_geom::support::conformality_with_jacobian;
use contact_geom::{ChartVector, ContactHamiltonian, Darboux, OfHamiltonian, PhasePoint};
use discrete_herglotz::{GaussCollocation, Integrator, Problem, StepperOptions, Steps, Until};

/// The start of a motion with one coordinate.
fn one() -> PhasePoint<1> {
    PhasePoint::new([0.4], [0.7], 0.3)
}

/// The start of a motion with two coordinates.
fn two() -> PhasePoint<2> {
    PhasePoint::new([0.4, -0.2], [0.7, 0.5], 0.3)
}

fn end<H: ContactHamiltonian<N>, const N: usize>(
    hamiltonian: &OfHamiltonian<H>,
    start: PhasePoint<N>,
    stages: usize,
    h: f64,
    span: f64,
) -> PhasePoint<N> {
    let problem = Problem::of_hamiltonian(hamiltonian, 0.0, start).unwrap();
    let outcome = problem.by(GaussCollocation { stages }).steps(Steps::Size(h)).run(Until::Time(span)).unwrap();
    assert!((outcome.t - span).abs() < 1e-12, "{stages} stages, h = {h}: {outcome:?}");
    outcome.state().fixed()
}

fn order<H: ContactHamiltonian<N>, const N: usize>(
    name: &str,
    hamiltonian: H,
    start: PhasePoint<N>,
    span: f64,
    most: usize,
) {
    let hamiltonian = &OfHamiltonian(hamiltonian);
    let exact = end(hamiltonian, start, 12, 0.05, span);
    for stages in 1..=most {
        let counts = (2..20).map(|k| (2.0_f64).powf(0.5 * f64::from(k)).round());
        let of =
            |count: f64| (1.0 / count, relative_distance(end(hamiltonian, start, stages, 1.0 / count, span), exact));
        // The three finest steps whose error is far above the round-off of the two runs.
        let points: Vec<_> = counts.map(of).filter(|(_, error)| *error > 1e-13).collect();
        assert!(points.len() >= 3, "{name}, {stages} stages: {points:?}");
        let points = &points[points.len() - 3..];
        let found = slope(points);
        assert!((found - 2.0 * stages as f64).abs() < 0.15, "{name}, {stages} stages: order {found}, {points:?}");
    }
}

#[test]
fn the_order_is_twice_the_number_of_stages() {
    order("nonlinear", One::Nonlinear, one(), 4.0, 4);
    // It comes to rest: with four stages its error is too near round-off.
    order("linear in p", One::Linear, one(), 1.0, 3);
    order("homogeneous", One::Homogeneous, one(), 2.0, 4);
    order("ray", Two::Ray, two(), 2.0, 4);
    order("two coordinates", Two::Nonlinear, two(), 2.0, 4);
}

/// The pullback of `dz - p dq` by a step is `sigma_d` times it, whatever the rank of `H_pp` and the step size. The bound
/// is a hundred units of round-off, since the Jacobian is that of the solved equations.
#[test]
fn steps_are_conformally_contact() {
    fn check<H: ContactHamiltonian<N>, const N: usize>(name: &str, hamiltonian: H, start: PhasePoint<N>) {
        let hamiltonian = &OfHamiltonian(hamiltonian);
        let problem = Problem::of_hamiltonian(hamiltonian, 0.0, start).unwrap();
        for stages in [1, 2, 3, 5, 8] {
            for h in [0.01, 0.2, -0.3, 0.7] {
                let method = GaussCollocation { stages };
                let mut stepper = method.stepper(&problem, h, StepperOptions::default()).unwrap();
                stepper.advance(1).unwrap();
                let image = stepper.state().fixed();
                let jacobian = method.step_jacobian(&problem, h, (0.0, &start, &image)).unwrap().unwrap();
                let found =
                    conformality_with_jacobian(&Darboux, &Darboux, &start.into(), &image.into(), &jacobian).unwrap();
                assert!(found.defect <= 100.0 * f64::EPSILON, "{name}, {stages}, h = {h}: {found:?}");
                let off = (found.sigma - stepper.sigma()).abs() / found.sigma;
                assert!(off <= 100.0 * f64::EPSILON, "{name}, {stages} stages, h = {h}: sigma_d off by {off:e}");
            }
        }
    }
    check("nonlinear", One::Nonlinear, one());
    check("linear in p", One::Linear, one());
    check("homogeneous", One::Homogeneous, one());
    check("ray", Two::Ray, two());
    check("two coordinates", Two::Nonlinear, two());
}

/// The Jacobian of a step is that of its map: compared with central differences, whose error is h^2 + eps / h.
#[test]
fn the_derivative_of_a_step_is_that_of_its_map() {
    let hamiltonian = OfHamiltonian(Two::Ray);
    let (method, h) = (GaussCollocation { stages: 4 }, 0.3);
    let image = |start: PhasePoint<2>| {
        let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, start).unwrap();
        let mut stepper = method.stepper(&problem, h, StepperOptions::default()).unwrap();
        stepper.advance(1).unwrap();
        stepper.state().fixed::<2>()
    };
    let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, two()).unwrap();
    let jacobian = method.step_jacobian(&problem, h, (0.0, &two(), &two())).unwrap().unwrap();
    for j in 0..5 {
        let small = 1e-5;
        let moved = |by: f64| {
            let x = ChartVector::from(two()).plus(ChartVector::from_fn(|i| if i == j { by } else { 0.0 }));
            ChartVector::from(image(x.into()))
        };
        let difference = moved(small).minus(moved(-small)).scale(0.5 / small);
        for i in 0..5 {
            let off = (difference.component(i) - jacobian[(i, j)]).abs();
            assert!(off <= 1e-9, "{i}, {j}: {off:e}");
        }
    }
}

/// A step forward and one backward end at the start, to a few units of round-off.
#[test]
fn steps_are_symmetric() {
    for (name, system) in [("nonlinear", One::Nonlinear), ("linear", One::Linear), ("homogeneous", One::Homogeneous)] {
        let hamiltonian = OfHamiltonian(system);
        let there = end(&hamiltonian, one(), 4, 0.25, 2.0);
        let problem = Problem::of_hamiltonian(&hamiltonian, 2.0, there).unwrap();
        let back = problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.25)).run(Until::Time(0.0)).unwrap();
        let off = relative_distance(back.state(), one());
        assert!(off <= 64.0 * f64::EPSILON, "{name}: {off:e}");
    }
}

/// Stiff relaxation `q' = -k (q - cos t)` has `H = -k p (q - cos t)`: the fixed-point iteration does not contract for
/// `k h = 50`, and Newton's method solves the step.
#[test]
fn stiff_steps_are_solved_by_newtons_method() {
    let hamiltonian = OfHamiltonian(One::Stiff);
    let start = PhasePoint::new([1.0], [1e-30], 0.0);
    let q = end(&hamiltonian, start, 3, 0.05, 2.0).q[0];
    // The slow solution, up to 1/k^3: q = c + s/k - c/k^2 with c = cos t, s = sin t.
    let (k, t) = (1000.0, 2.0_f64);
    let slow = t.cos() + t.sin() / k - t.cos() / (k * k);
    assert!((q - slow).abs() < 1e-6, "{q} {slow}");
}
