//! Statement 20 (section 3.1): the three expressions of the discrete Hamiltonian flow, the commuting diagram.

use crate::common::{over_discretisations, pairs};
use contact_geom::Statement;

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::HamiltonianFlowExpressions), pairs().all);
}
