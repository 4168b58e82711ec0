//! Description of what the steps of contact Gauss collocation compute and what they skip.

use crate::PlanEntry;
use crate::integration::plan_entry::DECOUPLED;
use contact_geom::Structure;

/// How the steps of contact Gauss collocation are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaussRoute {
    /// The motion is linear: each step applies one precomputed matrix.
    Linear,
    /// Constant mass matrix and constant rate of the conformal factor: the iteration is in the accelerations of the
    /// stages.
    Condensed,
    /// The iteration is in the velocities, actions and integrating factors of the stages; the mass matrix W is
    /// constant.
    ConstantMass,
    /// As [`ConstantMass`](Self::ConstantMass), with W evaluated at the stages of each step.
    General,
    /// L is given by a contact Hamiltonian: the iteration is in the positions, momenta, actions and integrating factors
    /// of the stages.
    Hamiltonian,
}

fn mass_matrix(constant: bool) -> PlanEntry {
    if constant {
        PlanEntry::skipped("mass matrix", "W is constant and is inverted once")
    } else {
        PlanEntry::computed("mass matrix", "W is evaluated at the stages, once a step")
    }
}

fn action(drives: bool) -> PlanEntry {
    PlanEntry::computed(
        "action z",
        if drives { "the motion depends on it" } else { "the stage equations of this route include it" },
    )
}

/// The summary for steps that are equal in physical time; `drives` states that the motion depends on the action, and
/// `to_round_off` that the iteration does not end before.
pub(crate) fn work_summary(route: GaussRoute, drives: bool, to_round_off: bool) -> Vec<PlanEntry> {
    let iteration = |exact, within| PlanEntry::computed("iteration", if to_round_off { exact } else { within });
    let newton =
        PlanEntry::skipped("Newton's method", "used only in steps whose fixed-point iteration does not contract");
    let gradients = PlanEntry::skipped("Jacobian", "the fixed-point iteration needs only gradients");
    match route {
        GaussRoute::Linear => vec![
            PlanEntry::skipped("iteration", "L is quadratic: each step applies one precomputed matrix"),
            PlanEntry::skipped("forces", "the precomputed matrix contains them"),
            PlanEntry::skipped("action z", DECOUPLED),
        ],
        GaussRoute::Condensed => vec![
            iteration(
                "determines the accelerations of the stages to round-off",
                "determines the accelerations of the stages to a small part of the requested error",
            ),
            mass_matrix(true),
            PlanEntry::skipped("integrating factor", "gamma is constant: the values at the stages are computed once"),
            PlanEntry::skipped(
                "Jacobian",
                "factorised once for a linear force, and again only where the derivative of the force has changed",
            ),
            newton,
            PlanEntry::skipped("action z", DECOUPLED),
        ],
        GaussRoute::Hamiltonian => vec![
            iteration(
                "determines the positions, momenta, actions and integrating factors of the stages to round-off",
                "determines the positions, momenta, actions and integrating factors of the stages to a small part of the \
                 requested error",
            ),
            PlanEntry::skipped("mass matrix", "the steps evaluate the Hamiltonian, whatever the rank of H_pp"),
            gradients,
            newton,
            action(drives),
        ],
        GaussRoute::ConstantMass | GaussRoute::General => vec![
            iteration(
                "determines the velocities, actions and integrating factors of the stages to round-off",
                "determines the velocities, actions and integrating factors of the stages to a small part of the \
                 requested error",
            ),
            mass_matrix(route == GaussRoute::ConstantMass),
            gradients,
            newton,
            action(drives),
        ],
    }
}

/// The summary for steps that are equal in transformed time.
pub(crate) fn work_summary_in_transformed_time(structure: &Structure) -> Vec<PlanEntry> {
    vec![
        PlanEntry::computed(
            "time step",
            "the steps are equal in transformed time, with a shorter one at the end; dt/dtau depends on the position",
        ),
        PlanEntry::computed(
            "iteration",
            "determines the velocities, actions, integrating factors and rates dt/dtau of the stages to round-off",
        ),
        mass_matrix(structure.constant_mass),
        PlanEntry::skipped("Jacobian", "the fixed-point iteration needs only gradients"),
        PlanEntry::skipped("Newton's method", "a step whose fixed-point iteration does not contract fails"),
        action(!structure.is_affine_in_z()),
    ]
}
