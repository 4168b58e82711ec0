//! Statements 1 and 4 (section 2.1): the sign of the canonical volume, a form that is not contact, a field that is not
//! conformal.

use contact_geom::{
    ChartVector, Darboux, Form, GeometryError, Scalar, Smooth, hamiltonian::infinitesimal_conformality,
    support::generic,
};

/// The form dz is closed, so that it is nowhere a contact form: the volume vanishes.
#[test]
fn a_closed_form_is_not_contact() {
    struct Closed;
    impl<const N: usize> Smooth<N> for Closed {
        fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
            Ok(ChartVector { x: x.x.map(|_| T::zero()), y: x.y.map(|_| T::zero()), z: T::one() })
        }
    }
    let x = ChartVector::<2>::from_fn(|i| i as f64);
    assert_eq!(generic::volume(&Form(Closed), &x), Ok(0.0));
    assert!(matches!(generic::reeb(&Form(Closed), &x), Err(GeometryError::Singular { .. })));
}

/// The canonical volume is `(-1)^(n(n-1)/2) n!` in the order q, p, z.
#[test]
fn the_canonical_volume_has_its_sign() {
    let volumes = (
        generic::volume(&Darboux, &ChartVector::<1>::from_fn(|i| i as f64)),
        generic::volume(&Darboux, &ChartVector::<2>::from_fn(|i| i as f64)),
        generic::volume(&Darboux, &ChartVector::<3>::from_fn(|i| i as f64)),
    );
    assert_eq!(volumes, (Ok(1.0), Ok(-2.0), Ok(-6.0)));
}

/// A shear of z that is no contact Hamiltonian field is not conformal.
#[test]
fn another_field_is_not_conformal() {
    struct Shear;
    impl<const N: usize> Smooth<N> for Shear {
        fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
            Ok(ChartVector { x: x.y, y: x.x, z: x.x[0] * x.x[0] })
        }
    }
    let x = ChartVector::<2>::from_fn(|i| 0.3 + i as f64);
    let measured = infinitesimal_conformality(&Darboux, &Shear, &x);
    assert!(measured.is_ok_and(|m| m.defect > 0.1), "{measured:?}");
}
