//! Steps that end on the kinks and jumps of a Lagrangian, where one of its [switching
//! functions](contact_geom::Lagrangian::switching_functions) changes its sign along the motion.
//!
//! Between two zeros L is smooth, so that each part of a step has the order of its integrator and is conformally
//! contact. At a zero the position and z are continuous. Where L is continuous, so is the momentum. Where L jumps
//! across a surface `g(t, q) = 0`, the corner conditions of Weierstrass and Erdmann hold, for Herglotz' principle as
//! for Hamilton's: `p+ - p- = lambda g_q`, `E+ - E- = -lambda g_t`.

mod collocation;
mod corner;
mod departure;
mod divided;
mod jumps;
mod local_motion;
mod one_sided;
mod step_curve;
pub(crate) mod stepper;
mod surfaces;

pub(crate) use collocation::{Collocation, CollocationByPoints, CollocationOf, CollocationSteppers};
pub use divided::DividedGauss;
pub use jumps::jumps_between;
pub(crate) use local_motion::{phase_point, rates_along_motion};
pub(crate) use surfaces::has_switching_functions;
