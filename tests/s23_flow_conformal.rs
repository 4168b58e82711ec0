//! Statement 23 (section 3.1, theorem): `Phi_d* eta+ = (sigma_d o Phi_d) eta+` and `Phi_d* eta- = sigma_d eta-`.

use crate::common::{over_discretisations_within, pairs};
use contact_geom::Statement;

/// With every discretisation of every system, to 1e-12 of the terms of the pullback.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations_within(Statement::DiscreteFlowIsConformal, 1e-12), pairs().all);
}
