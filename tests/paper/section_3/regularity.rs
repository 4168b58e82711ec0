//! Statement 19 (section 3.1, theorem): the flow `Phi_d = (F-L_d)^-1 o F+L_d` exists exactly where F-L_d is a local
//! diffeomorphism; a discrete Lagrangian that is not regular is refused.

use crate::common::{over_discretisations, pairs};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, GeometryError, Lagrangian, PhasePoint, Scalar, Statement};
use discrete_herglotz::{Flow, InputError, Midpoint, StepError, discrete_flow, discrete_regularity};

/// F-L_d and F+L_d are inverted, with every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::DiscreteFlowExists), pairs().all);
}

/// A Lagrangian without kinetic energy gives a discrete one that is nowhere regular.
#[test]
fn a_singular_one_is_refused() {
    struct NoInertia;
    impl Lagrangian<1> for NoInertia {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            v[0] * q[0] - z * 0.1
        }
    }
    let ld = Midpoint::new(NoInertia, 0.1);
    let ld = ld.unwrap();
    let x = DiscretePoint::new([0.3], [0.5], 0.0);
    assert!(discrete_regularity(&ld, 0.0, &x).is_ok_and(|r| r.fibre.smallest == 0.0));
    let step = discrete_flow(&ld, 0.0, &x);
    assert!(matches!(step, Err(StepError::Singular { .. })), "{step:?}");
    let flow = Flow::from_points(&ld, 0.0, x).err();
    assert!(matches!(flow, Some(InputError::FirstStep(StepError::Singular { .. }))), "{flow:?}");
    // L itself is not regular, which is said first.
    let flow = Flow::new(&ld, 0.0, PhasePoint::new([0.3], [0.5], 0.0)).err();
    assert!(matches!(flow, Some(InputError::Geometry(GeometryError::Singular { .. }))), "{flow:?}");
}
