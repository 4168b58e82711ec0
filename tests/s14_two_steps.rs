//! Statement 14 (section 3, remark): the differential of the discrete action of two steps.

use crate::common::{over_discretisations, pairs};
use contact_geom::Statement;

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::TwoSteps), pairs().all);
}
