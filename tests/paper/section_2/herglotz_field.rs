//! Statement 7 (section 2.2): L is regular exactly if eta_L is a contact form;
//! `R_L = d/dz - W^ij L_{qdot^i z} d/dqdot^j`.

use crate::common::{over_catalogue, systems};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ContactForm, GeometryError, Lagrangian, LagrangianForm, Scalar, Statement, VelocityPoint, generic, herglotz_field,
    regularity,
};

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::Regularity), systems());
}

/// A Lagrangian linear in one velocity is singular: no volume, no Reeb field, no Herglotz field, and the error says so.
#[test]
fn a_singular_lagrangian_is_refused() {
    struct Singular;
    impl Lagrangian<2> for Singular {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
            v[0] * v[0] * 0.5 + v[1] * q[0] - q[1] * q[1] - z * 0.1
        }
    }
    let x = VelocityPoint::new([0.3, 0.4], [1.0, 2.0], 0.5);
    let form = LagrangianForm { lagrangian: &Singular, t: 0.0 };
    assert_eq!(regularity(&Singular, 0.0, &x).smallest, 0.0);
    assert_eq!(regularity(&Singular, 0.0, &x).condition(), f64::INFINITY);
    assert_eq!(generic::volume(&form, &x.into()), Ok(0.0));
    assert!(matches!(form.reeb(&x.into()), Err(GeometryError::Singular { .. })));
    let refused = herglotz_field(&Singular, 0.0, &x);
    assert!(matches!(refused, Err(GeometryError::Singular { what: "W = L_vv", .. })), "{refused:?}");
}
