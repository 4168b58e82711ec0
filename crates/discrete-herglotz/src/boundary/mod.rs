//! The discrete Herglotz principle as a boundary-value problem.

mod continuation;
mod critical_path;
mod deflation;
mod elimination;
mod end;
mod index;
mod newton;
mod problem;
mod sweep;

pub use continuation::continuation;
pub use critical_path::{CriticalPath, PathStatus};
pub use end::End;
pub use problem::BoundaryPath;
