//! Section 3 of the paper as residuals: each statement is evaluated for a discrete Lagrangian at a point, relative to
//! the size of its terms. The statements on forces are beyond the paper.
//!
//! The residual of a true statement is round-off times the condition numbers of the matrices involved. The tolerances
//! belong to the tests that call this module.

// `f64::max` and `amax` ignore a NaN, which a check must report.
#![deny(clippy::disallowed_methods)]

mod flow;
mod forces;
mod forms;
mod measures;
mod paths;
mod symmetries;

use crate::{DiscreteLagrangian, theory::discrete_symmetry_defect};
use contact_geom::{DiscretePoint, GeometryError, Statement, Symmetry, numbers::MaxOrNan};
use flow::{
    both_local_diffeomorphisms, discrete_flow_is_conformal, flow_exists, hamiltonian_flow_is_conformal,
    momentum_matching, sigma_is_positive, three_expressions,
};
pub use forces::{FORCED_STATEMENTS, forced_residual};
use forms::{contact_forms, forms_are_related, reeb, volume};
use paths::{action_differential, principle, two_steps};
use symmetries::momentum_is_dissipated;

/// The statements of section 3 that [`residual`] evaluates.
pub const STATEMENTS: [Statement; 16] = [
    Statement::Volume,
    Statement::ReebField,
    Statement::ActionDifferential,
    Statement::TwoSteps,
    Statement::DiscreteHerglotzPrinciple,
    Statement::DiscreteRegularity,
    Statement::MomentumMatching,
    Statement::DiscreteFlowExists,
    Statement::HamiltonianFlowExpressions,
    Statement::DiscreteContactForms,
    Statement::DiscreteFormsAreConformal,
    Statement::DiscreteFlowIsConformal,
    Statement::HamiltonianFlowIsConformal,
    Statement::DiscreteInvariance,
    Statement::DiscreteNoether,
    Statement::MidpointRule,
];

/// The number of steps of the longest path along which the differential of the action is computed: the product of as
/// many `sigma_d` shows an error in their order.
const LONGEST_PATH: usize = 12;

/// The residual of a statement of section 3 for a discrete Lagrangian at a time and a point of Q x Q x R.
///
/// `None` where the hypotheses of the statement do not apply (a statement on symmetries without a symmetry), and for a
/// statement that is not one of [`STATEMENTS`]. [`Statement::Volume`] and [`Statement::ReebField`] are those of section
/// 2 on Q x Q x R.
///
/// # Errors
/// Those of the discrete Lagrangian and of its forms at a point where it is not regular.
pub fn residual<const N: usize>(
    statement: Statement,
    ld: &impl DiscreteLagrangian<N>,
    symmetries: &[Symmetry<N>],
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<Option<f64>, GeometryError> {
    Ok(match statement {
        Statement::Volume => Some(volume(ld, t, x)?),
        Statement::ReebField => Some(reeb(ld, t, x)?),
        Statement::ActionDifferential => Some(action_differential(ld, t, x, LONGEST_PATH)?),
        Statement::TwoSteps => Some(two_steps(ld, t, x)?),
        Statement::DiscreteHerglotzPrinciple => Some(principle(ld, t, x)?),
        Statement::DiscreteRegularity => Some(both_local_diffeomorphisms(ld, t, x)?),
        Statement::MomentumMatching => Some(momentum_matching(ld, t, x)?),
        Statement::DiscreteFlowExists => Some(flow_exists(ld, t, x)?),
        Statement::HamiltonianFlowExpressions => Some(three_expressions(ld, t, x)?),
        Statement::DiscreteContactForms => Some(contact_forms(ld, t, x)?),
        Statement::DiscreteFormsAreConformal => Some(forms_are_related(ld, t, x)?),
        Statement::DiscreteFlowIsConformal => Some(discrete_flow_is_conformal(ld, t, x)?),
        Statement::HamiltonianFlowIsConformal => Some(hamiltonian_flow_is_conformal(ld, t, x)?),
        Statement::DiscreteInvariance => worst(symmetries, |group| Ok(discrete_symmetry_defect(ld, group, t, x)?))?,
        Statement::DiscreteNoether => worst(symmetries, |group| momentum_is_dissipated(ld, group, t, x))?,
        Statement::MidpointRule => Some(sigma_is_positive(ld, t, x)?),
        _ => None,
    })
}

/// The largest residual over all symmetries; `None` if there are none.
fn worst<const N: usize>(
    symmetries: &[Symmetry<N>],
    mut residual: impl FnMut(&Symmetry<N>) -> Result<f64, GeometryError>,
) -> Result<Option<f64>, GeometryError> {
    let mut worst = None;
    for group in symmetries {
        let r = residual(group)?;
        worst = Some(worst.map_or(r, |w: f64| w.max_or_nan(r)));
    }
    Ok(worst)
}
