//! Statement 4 (section 2.1): `L_X eta = a eta` for `X = X_f`, with `a = -R(f)`; a strict contactomorphism where `R(f) = 0`.
//! The Jacobi bracket: `X_{f,g} = [X_f, X_g]`.

use crate::common::{over_catalogue, systems};
use contact_geom::{ChartVector, Darboux, GeometryError, Scalar, Smooth, Statement, infinitesimal_conformality};

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::InfinitesimalContactomorphism), systems());
}

/// A field that is no contact Hamiltonian one is seen not to be conformal: `q d/dp`-like shears of z are not.
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
