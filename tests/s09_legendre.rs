//! Statement 9 (section 2.2): FL is a local contactomorphism from eta_L to eta_Q; `E_L = H o FL` and `FL_* xi_L = X_H`.

use crate::common::{over_catalogue, systems};
use contact_geom::Statement;

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(Statement::LegendreTransformation), systems());
}
