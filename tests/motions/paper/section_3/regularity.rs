//! Statements 17 and 19 (section 3.1): discrete Lagrangians that are not regular.

use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, GeometryError, Lagrangian, PhasePoint, Scalar};
use discrete_herglotz::{
    DiscreteLagrangian, InputError, StepError,
    rules::{Flow, Rule},
    theory::{discrete_flow, discrete_regularity},
};

/// Statement 17 at a point where the mixed derivative `D1 D2 L_d` vanishes: neither F+L_d nor F-L_d is a local
/// diffeomorphism there.
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

/// Statement 19 for a Lagrangian without kinetic energy, whose discrete Lagrangian is nowhere regular.
#[test]
fn a_singular_one_is_refused() {
    struct NoInertia;
    impl Lagrangian<1> for NoInertia {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            v[0] * q[0] - z * 0.1
        }
    }
    let ld = Rule::MIDPOINT.of(NoInertia, 0.1);
    let ld = ld.unwrap();
    let x = DiscretePoint::new([0.3], [0.5], 0.0);
    assert!(discrete_regularity(&ld, 0.0, &x).is_ok_and(|r| r.fibre.smallest == 0.0));
    let step = discrete_flow(&ld, 0.0, &x);
    assert!(matches!(step, Err(StepError::Singular { .. })), "{step:?}");
    let flow = Flow::from_points(&ld, 0.0, x).err();
    assert!(matches!(flow, Some(InputError::FirstStep(StepError::Singular { .. }))), "{flow:?}");
    // From a state the singularity of L itself is found first.
    let flow = Flow::new(&ld, 0.0, PhasePoint::new([0.3], [0.5], 0.0)).err();
    assert!(matches!(flow, Some(InputError::Geometry(GeometryError::Singular { .. }))), "{flow:?}");
}
