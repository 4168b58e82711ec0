//! Closed motions with linear drag: a change of time, and the free rigid body by elliptic functions.

mod change_of_time;
mod free_rigid_body;
mod jacobi;

pub use change_of_time::ChangeOfTime;
pub use free_rigid_body::FreeRigidBody;
pub use jacobi::jacobi_functions;
