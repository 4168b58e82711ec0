//! Generating functions of types II and III.

mod adjoint;
mod euler;
mod exact_type_two;
mod integrator;
mod lift;
mod stepper;
mod type_three;
mod type_two;

pub use adjoint::Adjoint;
pub use euler::Euler;
pub use exact_type_two::ExactTypeTwo;
pub use integrator::{ContactEuler, GeneratingFunction};
pub use stepper::{Arrangement, GeneratingMaps, GeneratingStepper};
pub use type_three::{TypeThree, type_three_step};
pub use type_two::{TypeTwo, type_two_step};
