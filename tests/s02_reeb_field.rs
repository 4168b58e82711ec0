//! Statement 2 (section 2.1): the Reeb field satisfies `i_R d eta = 0`, `eta(R) = 1`; it is d/dz in Darboux coordinates;
//! `flat(R) = eta`; flat is an isomorphism, with inverse sharp. Each closed form agrees with the generic route.

use crate::common::{over_catalogue, over_discretisations, pairs, systems};
use contact_geom::Statement;

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::ReebField), systems());
}

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::ReebField), pairs().all);
}
