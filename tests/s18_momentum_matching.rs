//! Statement 18 (section 3.1): `F+L_d(q0, q1, z0) = F-L_d(q1, q2, z1)` exactly for solutions of the discrete Herglotz
//! equations.

use crate::common::{over_discretisations, pairs};
use contact_geom::Statement;

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::MomentumMatching), pairs().all);
}
