//! Statement 30 (section 4.1): `exp_h^xi = pr~_1 o exp_h^Gamma o (pi|M_L)^-1`.

use crate::common::over_motions;
use contact_geom::Statement;

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(Statement::NonHolonomicExponential);
}
