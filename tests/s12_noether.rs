//! Statement 12 (section 2.2.2, Noether): where L is invariant, the lifted action is by contactomorphisms of eta_L and the
//! momentum `J = -eta_L(xi)` is dissipated.

use crate::common::{SYMMETRIC, over_catalogue};
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{Kepler, System};
use contact_geom::{
    Energy, LagrangianForm, NoetherMomentum, OneParameterGroup, Statement, Symmetry, dissipation_defect,
};

/// On every system that has a symmetry.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::Noether), SYMMETRIC);
}

/// A group that is no symmetry gives a momentum that is not dissipated.
#[test]
fn without_symmetry_there_is_no_momentum() {
    let kepler = Kepler::<2>::default();
    let group = Symmetry::Translation(SVector::from([1.0, 0.5]));
    let (t, x) = kepler.sample(&[0.3, 0.7, 0.2, 0.6, 0.4, 0.5]);
    let momentum = NoetherMomentum { lagrangian: &kepler, group: &group };
    let form = LagrangianForm { lagrangian: &kepler, t };
    assert!(group.symmetry_defect(&kepler, t, &x) > 0.1);
    let defect = dissipation_defect(&form, &Energy(&kepler), &momentum, t, &x.into());
    assert!(defect.is_ok_and(|d| d > 0.01), "{defect:?}");
}
