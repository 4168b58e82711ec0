//! Statement 6 (section 2.1): `X_H(H) = -R(H) H`.

use crate::common::{over_catalogue, systems};

/// On every system of the catalogue.
#[test]
fn on_the_catalogue() {
    assert_eq!(over_catalogue(6), systems());
}
