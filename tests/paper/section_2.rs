//! Statement 3 (section 2.1): `flat(X_f) = df - (f + R(f)) eta`, and `f = -eta(X_f)`.

use crate::common::{over_catalogue, systems};
use contact_geom::Statement;

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::HamiltonianField), systems());
}
