//! Statement 1 (section 2.1): `eta ^ (d eta)^n` is a volume form on T*Q x R, on TQ x R for a regular L, and on Q x Q x R for
//! a regular L_d.

use crate::common::{over_catalogue, over_discretisations, pairs, systems};
use contact_geom::{ChartVector, Darboux, Form, GeometryError, Scalar, Smooth, Statement, generic};

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::Volume), systems());
}

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::Volume), pairs().all);
}

/// The form dz is closed, so nowhere contact: the volume vanishes.
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
