//! Statement 21 (section 3.1): eta+ and eta- are contact forms; their local expressions are the pullbacks of eta.

use crate::common::{METHODS, over_discretisations, systems};

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(21), systems() * METHODS);
}
