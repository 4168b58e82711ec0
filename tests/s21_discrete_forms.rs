//! Statement 21 (section 3.1): eta+ and eta- are contact forms; their local expressions are the pullbacks of eta.

use crate::common::{over_discretisations, pairs};

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(21), pairs().all);
}
