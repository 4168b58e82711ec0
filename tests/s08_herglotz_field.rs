//! Statement 8 (section 2.2): `xi_L = X_{E_L}` is a second-order equation, and its solutions solve Herglotz' equations.

use crate::common::{over_catalogue, systems};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Statement, VelocityPoint, herglotz_field};

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::HerglotzField), systems());
}

/// Where `L_v` depends on time, its drift enters: for `m(t) v^2/2 + gamma z`, `m a = gamma m v - m' v`.
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
