//! What steps of contact Gauss collocation compute and skip, in words.

use super::GaussRoute;
use crate::Item;
use crate::run::DECOUPLED;
use contact_geom::Structure;

fn mass_matrix(constant: bool) -> Item {
    if constant {
        Item::skipped("mass matrix", "W is constant: inverted once")
    } else {
        Item::computed("mass matrix", "at the stages, once a step")
    }
}

fn action(structure: &Structure) -> Item {
    let drives = !structure.is_affine_in_z();
    Item::computed("action z", if drives { "it drives the motion" } else { "the stages of this route carry it" })
}

/// By equal steps of time.
pub(super) fn account(route: GaussRoute, structure: &Structure) -> Vec<Item> {
    let newton = Item::skipped("Newton's method", "only in steps whose iteration does not contract");
    let gradients = Item::skipped("Jacobian", "the iteration needs gradients alone");
    match route {
        GaussRoute::Linear => vec![
            Item::skipped("iteration", "L is quadratic: the step is one matrix, made once"),
            Item::skipped("forces", "the matrix holds them"),
            Item::skipped("action z", DECOUPLED),
        ],
        GaussRoute::Condensed => vec![
            Item::computed("iteration", "the accelerations of the stages alone, to round-off"),
            mass_matrix(true),
            Item::skipped("integrating factor", "gamma is constant: its stages are computed once"),
            Item::skipped(
                "Jacobian",
                "one factorisation for a linear force, renewed where the force's slope has changed",
            ),
            newton,
            Item::skipped("action z", DECOUPLED),
        ],
        GaussRoute::ConstantMass | GaussRoute::General => vec![
            Item::computed("iteration", "velocities, actions and integrating factors of the stages, to round-off"),
            mass_matrix(route == GaussRoute::ConstantMass),
            gradients,
            newton,
            action(structure),
        ],
    }
}

/// By steps that are equal in the time of a clock.
pub(super) fn account_by_clock(structure: &Structure) -> Vec<Item> {
    vec![
        Item::computed(
            "time step",
            "the clock's rate follows the motion: equal steps of its time, a shorter one at the end",
        ),
        Item::computed("iteration", "velocities, actions, factors and rates of the stages, to round-off"),
        mass_matrix(structure.constant_mass),
        Item::skipped("Jacobian", "the iteration needs gradients alone"),
        Item::skipped("Newton's method", "steps whose iteration does not contract are refused"),
        action(structure),
    ]
}
