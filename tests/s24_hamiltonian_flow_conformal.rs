//! Statement 24 (section 3.1, theorem): `Phi~_d* eta = (sigma_d o (F-L_d)^-1) eta`.

use crate::common::{over_discretisations_within, pairs};
use contact_geom::Statement;

/// With every discretisation of every system, to 1e-12 of the terms of the pullback.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations_within(Statement::HamiltonianFlowIsConformal, 1e-12), pairs().all);
}
