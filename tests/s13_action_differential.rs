//! Statement 13 (section 3): `z_k` from `z_0` and the path; the paper's formula for the differential of the discrete action
//! against the derivative of A_d through the whole recursion, for paths of 1 to 12 steps.

use crate::common::{over_discretisations, pairs};
use contact_geom::Statement;

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::ActionDifferential), pairs().all);
}
