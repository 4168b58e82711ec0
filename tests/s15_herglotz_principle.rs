//! Statement 15 (section 3, theorem): a path satisfies the discrete Herglotz principle exactly if it solves the discrete
//! Herglotz equations, sigma_d not vanishing.

use crate::common::{over_discretisations, pairs};
use contact_geom::Statement;

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::DiscreteHerglotzPrinciple), pairs().all);
}
