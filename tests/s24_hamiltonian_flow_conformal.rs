//! Statement 24 (section 3.1, theorem): `Phi~_d* eta = (sigma_d o (F-L_d)^-1) eta`.

use crate::common::{over_discretisations, pairs};

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(24), pairs().all);
}
