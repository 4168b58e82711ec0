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
}

fn mass_matrix(constant: bool) -> PlanEntry {
    if constant {
        PlanEntry::skipped("mass matrix", "W is constant: inverted once")
    } else {
        PlanEntry::computed("mass matrix", "at the stages, once a step")
    }
}

fn action(structure: &Structure) -> PlanEntry {
    let drives = !structure.is_affine_in_z();
    PlanEntry::computed("action z", if drives { "it drives the motion" } else { "the stages of this route carry it" })
}

/// The summary for steps that are equal in physical time.
pub(crate) fn work_summary(route: GaussRoute, structure: &Structure) -> Vec<PlanEntry> {
    let newton = PlanEntry::skipped("Newton's method", "only in steps whose iteration does not contract");
    let gradients = PlanEntry::skipped("Jacobian", "the iteration needs gradients alone");
    match route {
        GaussRoute::Linear => vec![
            PlanEntry::skipped("iteration", "L is quadratic: the step is one matrix, made once"),
            PlanEntry::skipped("forces", "the matrix holds them"),
            PlanEntry::skipped("action z", DECOUPLED),
        ],
        GaussRoute::Condensed => vec![
            PlanEntry::computed("iteration", "the accelerations of the stages alone, to round-off"),
            mass_matrix(true),
            PlanEntry::skipped("integrating factor", "gamma is constant: its stages are computed once"),
            PlanEntry::skipped(
                "Jacobian",
                "one factorisation for a linear force, renewed where the force's slope has changed",
            ),
            newton,
            PlanEntry::skipped("action z", DECOUPLED),
        ],
        GaussRoute::ConstantMass | GaussRoute::General => vec![
            PlanEntry::computed("iteration", "velocities, actions and integrating factors of the stages, to round-off"),
            mass_matrix(route == GaussRoute::ConstantMass),
            gradients,
            newton,
            action(structure),
        ],
    }
}

/// The summary for steps that are equal in transformed time.
pub(crate) fn work_summary_in_transformed_time(structure: &Structure) -> Vec<PlanEntry> {
    vec![
        PlanEntry::computed(
            "time step",
            "the rate dt/dtau follows the motion: equal steps of its time, a shorter one at the end",
        ),
        PlanEntry::computed("iteration", "velocities, actions, factors and rates of the stages, to round-off"),
        mass_matrix(structure.constant_mass),
        PlanEntry::skipped("Jacobian", "the iteration needs gradients alone"),
        PlanEntry::skipped("Newton's method", "steps whose iteration does not contract are refused"),
        action(structure),
    ]
}
