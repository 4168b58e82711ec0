//! Statement 27 (section 4.1): Chetaev's multiplier is `-L_z`, and the equations of (L~, M_L) are Herglotz'. The multiplier is
//! solved for with the accelerations.

use crate::common::over_motions;
use contact_geom::Statement;

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(Statement::ChetaevMultiplier);
}
