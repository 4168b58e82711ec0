//! Statement 28 (section 4.1): `T pi (Gamma) = xi_L o pi`, the flows are pi-related, and the flow keeps to `M_L`.

use crate::common::over_motions;

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(28);
}
