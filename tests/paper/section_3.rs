//! Statement 21 (section 3.1): eta+ and eta- are contact forms; their local expressions are the pullbacks of eta.

use crate::common::{over_discretisations, pairs};
use contact_geom::Statement;

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::DiscreteContactForms), pairs().all);
}
