//! The discrete Herglotz principle as a boundary-value problem, with discrete forces if there are any.

mod block_elimination;
mod branch;
mod continuation;
mod critical_path;
mod deflation;
mod elimination;
mod end;
mod herglotz_equation;
mod index;
mod newton;
mod path_check;
mod problem;
mod step_forces;
mod thomas;

pub use branch::branch;
pub use continuation::continuation;
pub use critical_path::{CriticalPath, PathStatus};
pub use end::End;
pub use problem::BoundaryPath;
