//! Steps that end on the kinks and jumps of a Lagrangian: where its [switching functions](contact_geom::Lagrangian::switching_functions) change
//! sign along the motion.
//!
//! Between two zeros L is smooth, so that each part of a step keeps the order of its integrator, and is as conformally contact. At a zero z and the
//! position are continuous. Where L is continuous too, so is the momentum; where L jumps across a surface `g(t, q) = 0`, the corner conditions of
//! Weierstrass and Erdmann hold, which Herglotz' principle shares with Hamilton's: `p+ - p- = lambda g_q`, `E+ - E- = -lambda g_t`.

mod corner;
mod divided;
mod jumps;
mod stepper;
mod surfaces;

pub use divided::DividedGauss;
pub use jumps::jumps_between;
pub(crate) use stepper::{Reach, SwitchingStepper, of_integrator};
pub(crate) use surfaces::has_switching_functions;
