//! Statement 33 (section 4.2): the solution formula of the linear equation for the variation of z, and `L_h^e = z(h) - z(0)`.

use crate::common::over_motions;
use contact_geom::Statement;

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(Statement::LinearEquation);
}
