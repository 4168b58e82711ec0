//! Statements 7 and 8 (section 2.2): the Herglotz field of a Lagrangian that is singular, and of one that depends on
//! time.

use contact_geom::nalgebra::SVector;
use contact_geom::{
    ContactForm, GeometryError, Lagrangian, LagrangianForm, Scalar, VelocityPoint, herglotz_field, regularity,
    support::generic,
};

/// A Lagrangian linear in one velocity is singular: the volume is zero, and the Reeb and Herglotz fields are refused as
/// singular.
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

/// Where `L_v` depends on time, its derivative in time enters: for `m(t) v^2/2 + gamma z`, `m a = gamma m v - m' v`.
#[test]
fn a_mass_that_depends_on_time() {
    struct Rocket;
    impl Lagrangian<1> for Rocket {
        fn value<T: Scalar>(&self, t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            (t * 0.3 + 2.0) * v[0] * v[0] * 0.5 - z * 0.1
        }
    }
    let (t, v) = (0.7, 1.5);
    let field = herglotz_field(&Rocket, t, &VelocityPoint::new([0.2], [v], 0.4));
    let expected = -0.1 * v - 0.3 * v / (2.0 + 0.3 * t);
    assert!(field.is_ok_and(|f| (f.y[0] - expected).abs() < 1e-15), "{field:?} {expected}");
}
