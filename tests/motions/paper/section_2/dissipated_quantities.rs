//! Statements 6, 11 and 12: dissipated quantities of Hamiltonians without a Lagrangian, along a motion, and of a group
//! that is no symmetry.

use crate::common::oracle::motion_with_derivative;
use crate::common::{on_random, within};
use contact_examples::systems::{Kepler, Lienard, System, SystemVisitor, VanDerPol, visit_catalogue};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    AsFunction, ChartVector, Darboux, Energy, LagrangianForm, NoetherMomentum, OneParameterGroup, Smooth,
    SmoothFunction, Symmetry,
    hamiltonian::{DarbouxField, dissipation_defect, hamiltonian_vector_field},
    numbers::{MaxAbsOrNan, MaxOrNan},
};

/// Statement 6 for a contact Hamiltonian that belongs to no regular Lagrangian; its field has `q' = z`, and is the same
/// in closed form and from the form.
fn without_lagrangian(name: &str, h: &impl SmoothFunction<1>) {
    on_random(&format!("statement 6 on {name}"), 4, |u| {
        let (t, x) = (5.0 * u[3], ChartVector::<1>::from_fn(|i| 4.0 * u[i] - 2.0));
        let defect = dissipation_defect(&Darboux, h, h, t, &x).map_err(|e| e.to_string())?;
        let generic = hamiltonian_vector_field(&Darboux, h, t, &x).map_err(|e| e.to_string())?;
        let closed = DarbouxField { hamiltonian: h, t }.at(&x).map_err(|e| e.to_string())?;
        let routes = generic.minus(closed).max_abs_or_nan() / (1.0 + closed.max_abs_or_nan());
        let worst = defect.max_or_nan(routes).max_or_nan((closed.x[0] - x.z).abs());
        within(worst)
    });
}

#[test]
fn van_der_pol_and_lienard() {
    without_lagrangian("van der Pol", &AsFunction(&VanDerPol::default()));
    without_lagrangian("Lienard", &AsFunction(&Lienard::default()));
}

/// Statement 11 along the motion: the energy where L is autonomous, and every momentum, are multiplied by `sigma_t`,
/// and their quotient is conserved. The tolerance is the error of the oracle, 1e-12, relative to the size of the terms.
#[test]
fn along_the_motion() {
    struct Visitor(usize);
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let (t, start) = (system.initial_time(), system.initial());
            let (end, _, sigma) = motion_with_derivative(system, t, &start, 0.5);
            let at = |f: &dyn Fn(f64, &ChartVector<N>) -> f64| (f(t, &start.into()), f(t + 0.5, &end.into()));
            let mut quantities = Vec::new();
            let energy = Energy(system);
            if system.structure().autonomous {
                quantities.push(at(&|t, x| energy.value(t, x)));
            }
            for group in system.symmetries() {
                let momentum = NoetherMomentum { lagrangian: system, group: &group };
                quantities.push(at(&|t, x| momentum.value(t, x)));
            }
            for &(before, after) in &quantities {
                let defect = (after - sigma * before).abs() / (1.0 + before.abs());
                assert!(defect < 1e-12, "statement 11 on {}: {before} -> {after}, sigma {sigma}", system.name());
            }
            for pair in quantities.windows(2).filter(|p| p[1].0.abs() > 0.1) {
                let ratio = (pair[0].0 / pair[1].0, pair[0].1 / pair[1].1);
                assert!((ratio.0 - ratio.1).abs() < 1e-11 * (1.0 + ratio.0.abs()), "{}: {ratio:?}", system.name());
                self.0 += 1;
            }
        }
    }
    let mut visitor = Visitor(0);
    visit_catalogue(&mut visitor);
    assert!(visitor.0 >= 3, "quotients were compared {} times", visitor.0);
}

/// The momentum of a group that is no symmetry is not dissipated.
#[test]
fn without_symmetry_there_is_no_momentum() {
    let kepler = Kepler::<2>::default();
    let group = Symmetry::Translation(SVector::from([1.0, 0.5]));
    let (t, x) = kepler.sample(&[0.3, 0.7, 0.2, 0.6, 0.4, 0.5]);
    let momentum = NoetherMomentum { lagrangian: &kepler, group: &group };
    let form = LagrangianForm { lagrangian: &kepler, t };
    assert!(group.symmetry_defect(&kepler, t, &x) > 0.1);
    let defect = dissipation_defect(&form, &Energy(&kepler), &momentum, t, &x.into());
    assert!(defect.is_ok_and(|d| d > 0.01), "{defect:?}");
}
