//! Statement 6 (section 2.1): `X_H(H) = -R(H) H`.

use crate::common::{on_random, over_catalogue, systems, within};
use contact_geom::systems::{Lienard, VanDerPol};
use contact_geom::{
    ChartVector, Darboux, DarbouxField, MaxAbsOrNan, MaxOrNan, Smooth, SmoothFunction, Statement, dissipation_defect,
    hamiltonian_vector_field,
};

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::EnergyDecay), systems());
}

/// For contact Hamiltonians that belong to no regular Lagrangian; their fields are `q' = z`, and agree by both routes.
fn without_lagrangian(name: &str, h: &impl SmoothFunction<1>) {
    on_random(name, 4, |u| {
        let (t, x) = (5.0 * u[3], ChartVector::<1>::from_fn(|i| 4.0 * u[i] - 2.0));
        let defect = dissipation_defect(&Darboux, h, h, t, &x).map_err(|e| e.to_string())?;
        let generic = hamiltonian_vector_field(&Darboux, h, t, &x).map_err(|e| e.to_string())?;
        let closed = DarbouxField { hamiltonian: h, t }.at(&x).map_err(|e| e.to_string())?;
        let routes = generic.minus(closed).max_abs_or_nan() / (1.0 + closed.max_abs_or_nan());
        let worst = defect.max_or_nan(routes).max_or_nan((closed.x[0] - x.z).abs());
        within(worst)
    });
}

/// Van der Pol's and Lienard's.
#[test]
fn van_der_pol_and_lienard() {
    without_lagrangian("van der Pol", &VanDerPol::default());
    without_lagrangian("Lienard", &Lienard::default());
}
