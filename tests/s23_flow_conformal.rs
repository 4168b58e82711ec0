//! Statement 23 (section 3.1, theorem): `Phi_d* eta+ = (sigma_d o Phi_d) eta+` and `Phi_d* eta- = sigma_d eta-`.

use crate::common::{METHODS, over_discretisations, systems};

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(23), systems() * METHODS);
}
