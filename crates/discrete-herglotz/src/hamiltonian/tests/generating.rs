//! Generating functions: contact, orders, adjointness, symmetry, for contact Hamiltonians whatever the rank of H_pp.

use super::{Plane, assert_order, distance, pullback, random_point, runge_kutta};
use crate::hamiltonian::generating::{ContactEuler, GeneratingType, generated_step};
use crate::{Integrator, Problem, SplittingScheme, Stepper, StepperOptions};
use contact_geom::{OfHamiltonian, PhasePoint};

const SYSTEMS: [Plane; 3] = [Plane::Coupled, Plane::Linear, Plane::Ray];
const DURATION: f64 = 1.5;

fn start() -> PhasePoint<2> {
    PhasePoint::new([0.5, -0.3], [0.7, 0.4], 0.3)
}

fn stepper<'a>(problem: &Problem<'a, OfHamiltonian<Plane>, 2>, by: ContactEuler, h: f64) -> Box<dyn Stepper + 'a> {
    by.stepper(problem, h, StepperOptions::default()).unwrap()
}

#[test]
fn maps_of_both_types_are_contact_and_adjoint() {
    let types = [GeneratingType::Two, GeneratingType::Three];
    for (system, k) in SYSTEMS.into_iter().flat_map(|system| (0..6).map(move |k| (system, k))) {
        // Momenta away from 0, where the rays are singular.
        let mut x = random_point::<2>(k);
        x.p[0] += 2.0;
        let (t, h) = (0.3, 0.1);
        for (of_type, other) in [(types[0], types[1]), (types[1], types[0])] {
            let there = generated_step(&system, of_type, (t, h), &x, &mut 0).unwrap();
            let (defect, sigma) =
                pullback(&x, |x| generated_step(&system, of_type, (t, h), x, &mut 0).map(|change| change.after(x)));
            assert!(defect < 1e-14 && (sigma - 1.0 - there.sigma_minus_one).abs() < 1e-14, "{system:?} {defect:e}");
            // A step back with the other type.
            let end = there.after(&x);
            let back = generated_step(&system, other, (t + h, -h), &end, &mut 0).unwrap();
            assert!(distance(&back.after(&end), &x) < 1e-14, "{system:?}");
            let factors = (1.0 + there.sigma_minus_one) * (1.0 + back.sigma_minus_one);
            assert!((factors - 1.0).abs() < 1e-14, "{system:?} {factors}");
        }
    }
}

#[test]
fn arrangements_have_their_orders() {
    for system in SYSTEMS {
        let (exact, _) = runge_kutta(&system, (0.0, DURATION), &start(), 10_000, false);
        for by in [
            ContactEuler::TypeTwo,
            ContactEuler::TypeThree,
            ContactEuler::Symmetric(SplittingScheme::STRANG),
            ContactEuler::Symmetric(SplittingScheme::MCLACHLAN_4),
        ] {
            check_order(system, by, DURATION, &exact);
        }
    }
}

fn check_order(system: Plane, by: ContactEuler, duration: f64, exact: &PhasePoint<2>) {
    let info = Integrator::<OfHamiltonian<Plane>, 2>::info(&by);
    let hamiltonian = OfHamiltonian(system);
    let problem = Problem::new(&hamiltonian, 0.0, start()).unwrap();
    let name = format!("{system:?} {}", info.name);
    assert_order(&name, info.order, (duration, exact), |h| stepper(&problem, by, h));
}

/// The high orders need more evaluations and longer steps, and do not depend on the system. For the composition of order
/// 10, which is the reference, too few steps are long enough for errors above round-off and short enough for a slope.
#[test]
fn compositions_have_their_high_orders() {
    let (duration, system) = (4.0 * DURATION, Plane::Coupled);
    let (exact, _) = runge_kutta(&system, (0.0, duration), &start(), 20_000, false);
    let (hamiltonian, by) = (OfHamiltonian(system), ContactEuler::Symmetric(SplittingScheme::SOFRONIOU_SPALETTA_10));
    let problem = Problem::new(&hamiltonian, 0.0, start()).unwrap();
    let mut fine = stepper(&problem, by, duration / 200.0);
    fine.advance(200).unwrap();
    let end = fine.state().fixed();
    assert!(distance(&end, &exact) < 1e-11, "{end:?}, {exact:?}");
    for scheme in [SplittingScheme::KAHAN_LI_6, SplittingScheme::KAHAN_LI_8] {
        check_order(system, ContactEuler::Symmetric(scheme), duration, &end);
    }
}

#[test]
fn compositions_are_contact_and_symmetric() {
    let hamiltonian = OfHamiltonian(Plane::Coupled);
    let problem = Problem::new(&hamiltonian, 0.0, start()).unwrap();
    for scheme in [SplittingScheme::STRANG, SplittingScheme::MCLACHLAN_4, SplittingScheme::SOFRONIOU_SPALETTA_10] {
        let by = ContactEuler::Symmetric(scheme);
        let mut motion = stepper(&problem, by, 0.1);
        motion.advance(1).unwrap();
        let end: PhasePoint<2> = motion.state().fixed();
        let onward = Problem::new(&hamiltonian, motion.time(), end).unwrap();
        let mut back = stepper(&onward, by, -0.1);
        back.advance(1).unwrap();
        assert!(distance(&back.state().fixed(), &start()) < 1e-14, "{} {:?}", scheme.name(), back.state());
        let step = (0.0, &start(), &end);
        let jacobian = by.step_jacobian(&problem, 0.1, step).unwrap().unwrap();
        let (from, to) = (start().into(), end.into());
        let darboux = contact_geom::Darboux;
        let found =
            contact_geom::support::conformality_with_jacobian(&darboux, &darboux, &from, &to, &jacobian).unwrap();
        assert!(found.defect < 1e-13 && (found.sigma - motion.sigma()).abs() < 1e-13, "{} {found:?}", scheme.name());
    }
}
