//! Generating functions: contact, orders, adjointness, symmetry, for contact Hamiltonians whatever the rank of H_pp.

use super::{Plane, assert_order, distance, pullback, random_point, runge_kutta};
use crate::hamiltonian::generating::{
    Adjoint, Arrangement, ContactEuler, Euler, GeneratingStepper, type_three_step, type_two_step,
};
use crate::{Integrator, Problem, SplittingScheme, Stepper};
use contact_geom::{OfHamiltonian, PhasePoint};

const SYSTEMS: [Plane; 3] = [Plane::Coupled, Plane::Linear, Plane::Ray];
const DURATION: f64 = 1.5;

fn start() -> PhasePoint<2> {
    PhasePoint::new([0.5, -0.3], [0.7, 0.4], 0.3)
}

fn stepper(system: Plane, arrangement: Arrangement, h: f64) -> GeneratingStepper<Euler<Plane>, 2> {
    GeneratingStepper::new(Euler(system), arrangement, h, 0.0, start()).unwrap()
}

#[test]
fn maps_of_both_types_are_contact_and_adjoint() {
    for system in SYSTEMS {
        for k in 0..6 {
            // Momenta away from 0, where the rays are singular.
            let mut x = random_point::<2>(k);
            x.p[0] += 2.0;
            let (t, h, euler) = (0.3, 0.1, Euler(system));
            let two = type_two_step(&euler, t, h, &x, &mut 0).unwrap();
            let three = type_three_step(&euler, t, h, &x, &mut 0).unwrap();
            let (defect, sigma) =
                pullback(&x, |x| type_two_step(&euler, t, h, x, &mut 0).map(|change| change.after(x)));
            assert!(defect < 1e-14 && (sigma - 1.0 - two.sigma_minus_one).abs() < 1e-14, "{system:?} {defect:e}");
            let (defect, sigma) =
                pullback(&x, |x| type_three_step(&euler, t, h, x, &mut 0).map(|change| change.after(x)));
            assert!(defect < 1e-14 && (sigma - 1.0 - three.sigma_minus_one).abs() < 1e-14, "{system:?} {defect:e}");
            // A step back with the other type.
            let end = two.after(&x);
            let back = type_three_step(&euler, t + h, -h, &end, &mut 0).unwrap();
            assert!(distance(&back.after(&end), &x) < 1e-14, "{system:?}");
            let factors = (1.0 + two.sigma_minus_one) * (1.0 + back.sigma_minus_one);
            assert!((factors - 1.0).abs() < 1e-14, "{system:?} {factors}");
            let end = three.after(&x);
            let back = type_two_step(&euler, t + h, -h, &end, &mut 0).unwrap();
            assert!(distance(&back.after(&end), &x) < 1e-14, "{system:?}");
            // The adjoint function is that of the other type.
            let adjoint = type_three_step(&Adjoint(euler), t, h, &x, &mut 0).unwrap();
            assert!(distance(&adjoint.after(&x), &three.after(&x)) < 1e-15, "{system:?}");
            let again = type_two_step(&Adjoint(Adjoint(euler)), t, h, &x, &mut 0).unwrap();
            assert!(distance(&again.after(&x), &two.after(&x)) < 1e-15, "{system:?}");
        }
    }
}

#[test]
fn arrangements_have_their_orders() {
    for system in SYSTEMS {
        let (exact, _) = runge_kutta(&system, (0.0, DURATION), &start(), 10_000, false);
        for arrangement in [
            Arrangement::TypeTwo,
            Arrangement::TypeThree,
            Arrangement::Symmetric(SplittingScheme::STRANG),
            Arrangement::Symmetric(SplittingScheme::MCLACHLAN_4),
        ] {
            check_order(system, arrangement, DURATION, &exact);
        }
    }
}

fn check_order(system: Plane, arrangement: Arrangement, duration: f64, exact: &PhasePoint<2>) {
    let info = Integrator::<OfHamiltonian<Plane>, 2>::info(&ContactEuler { arrangement });
    assert_order(&format!("{system:?} {}", info.name), info.order, (duration, exact), |h| {
        stepper(system, arrangement, h)
    });
}

/// The high orders need more evaluations and longer steps, and do not depend on the system. For the composition of order
/// 10, which is the reference, too few steps are long enough for errors above round-off and short enough for a slope.
#[test]
fn compositions_have_their_high_orders() {
    let (duration, system) = (4.0 * DURATION, Plane::Coupled);
    let (exact, _) = runge_kutta(&system, (0.0, duration), &start(), 20_000, false);
    let mut fine = stepper(system, Arrangement::Symmetric(SplittingScheme::SOFRONIOU_SPALETTA_10), duration / 200.0);
    fine.advance(200).unwrap();
    assert!(distance(&fine.state(), &exact) < 1e-11, "{:?}, {exact:?}", fine.state());
    for scheme in [SplittingScheme::KAHAN_LI_6, SplittingScheme::KAHAN_LI_8] {
        check_order(system, Arrangement::Symmetric(scheme), duration, &fine.state());
    }
}

#[test]
fn compositions_are_contact_and_symmetric() {
    let hamiltonian = OfHamiltonian(Plane::Coupled);
    let problem = Problem::new(&hamiltonian, 0.0, start()).unwrap();
    for scheme in [SplittingScheme::STRANG, SplittingScheme::MCLACHLAN_4, SplittingScheme::SOFRONIOU_SPALETTA_10] {
        let arrangement = Arrangement::Symmetric(scheme);
        let mut motion = stepper(Plane::Coupled, arrangement, 0.1);
        motion.advance(1).unwrap();
        let mut back =
            GeneratingStepper::new(Euler(Plane::Coupled), arrangement, -0.1, motion.time(), motion.state()).unwrap();
        back.advance(1).unwrap();
        assert!(distance(&back.state(), &start()) < 1e-14, "{} {:?}", scheme.name(), back.state());
        let step = (0.0, &start(), &motion.state());
        let jacobian = ContactEuler { arrangement }.step_jacobian(&problem, 0.1, step).unwrap().unwrap();
        let (from, to) = (start().into(), motion.state().into());
        let darboux = contact_geom::Darboux;
        let found =
            contact_geom::support::conformality_with_jacobian(&darboux, &darboux, &from, &to, &jacobian).unwrap();
        assert!(found.defect < 1e-13 && (found.sigma - motion.sigma()).abs() < 1e-13, "{} {found:?}", scheme.name());
    }
}
