//! Statement 23 (section 3.1, theorem): `Phi_d* eta+ = (sigma_d o Phi_d) eta+` and `Phi_d* eta- = sigma_d eta-`.

use crate::common::{over_discretisations, pairs};

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(23), pairs().all);
}
