//! Statement 17 (section 3.1, lemma): F+L_d is a local diffeomorphism exactly if F-L_d is.

use crate::common::{over_discretisations, pairs};
use contact_geom::{DiscretePoint, Scalar, Statement};
use discrete_herglotz::{DiscreteLagrangian, StepError};

/// Where both are: `det T F+L_d = sigma_d^(n+1) det T F-L_d`, none of them zero.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::DiscreteRegularity), pairs().all);
}

/// Where neither is: a discrete Lagrangian whose mixed derivative `D1 D2 L_d` vanishes at one point.
#[test]
fn both_fail_together() {
    struct Cubic;
    impl DiscreteLagrangian<1> for Cubic {
        fn step_size(&self) -> f64 {
            1.0
        }
        fn value<T: Scalar>(&self, _t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
            let d = x.q1[0] - x.q0[0];
            Ok(d * d * d + x.q0[0] * x.q0[0] - x.z0 * 0.1)
        }
    }
    let determinants = |q1: f64| {
        let jet = Cubic.second_jet(0.0, &DiscretePoint::new([0.0], [q1], 0.3));
        jet.map(|j| (j.legendre_minus_jacobian().determinant(), j.legendre_plus_jacobian().determinant()))
    };
    assert_eq!(determinants(0.0), Ok((0.0, 0.0)));
    assert!(determinants(0.5).is_ok_and(|(minus, plus)| minus != 0.0 && plus != 0.0));
}
