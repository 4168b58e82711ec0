//! Statement 11 (section 2.2.2, corrected): `L_{X_H} f = -R(H) f` exactly if `f o phi_t = sigma_t f`; quotients of two
//! dissipated quantities are conserved.

use crate::common::oracle::motion_with_derivative;
use crate::common::{over_catalogue, systems};
use contact_geom::systems::{System, SystemVisitor, visit_catalogue};
use contact_geom::{ChartVector, Energy, NoetherMomentum, SmoothFunction, Statement};

/// Infinitesimally, on every system.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::DissipatedQuantities), systems());
}

/// Along the motion: the energy where L is autonomous, and every momentum, are multiplied by `sigma_t`; their quotient
/// stays. The tolerance is the oracle's error, 1e-12, against the size of the terms.
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
                assert!(defect < 1e-12, "{}: {before} -> {after}, sigma {sigma}", system.name());
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
