//! Splittings of contact flows, with the exact conformal factor for a linear drag.

mod action_flow;
mod action_strang;
pub(crate) mod drag;
mod integrator;
pub(crate) mod linear_drag;
mod motion;
mod nonlinear_drag;
pub(crate) mod separable;
mod strang;
#[cfg(test)]
mod tests;
mod velocity_drag;
pub(crate) mod velocity_drag_flow;

pub use action_flow::{ActionFlow, ActionMap, Riccati, RiccatiMap};
pub use action_strang::ActionStrang;
pub use linear_drag::Splitting;
pub use nonlinear_drag::ActionSplitting;
pub use strang::Strang;
pub use velocity_drag::DragSplitting;

use crate::PlanEntry;

/// The work summary of the steps of a splitting, with the given entry for the action.
fn work_summary(action: PlanEntry) -> Vec<PlanEntry> {
    vec![
        PlanEntry::skipped("Newton's method", "each step is explicit and evaluates only forces"),
        PlanEntry::skipped("Jacobian", "each step is explicit"),
        PlanEntry::skipped("shared kicks", "the last force of a step is reused as the first of the next"),
        action,
    ]
}
