//! Section 4: the non-holonomic description of Herglotz' equations, the contact exponential map, and the exact discrete
//! Lagrangian. Statements 27 to 36.

mod composition;
mod derivatives;
mod exact_flow;
mod exponential_map;
mod herglotz_flow;
mod legendre_transforms;
mod nonholonomic;
mod retraction;

use crate::paper::table::{EXACT_TOLERANCE, Row, along_motions_of_every_system};
use contact_geom::Statement;

/// The statements about the motion from a point of TQ x R.
pub const ALONG_MOTIONS: &[Row] = &[
    // The multiplier is solved for together with the accelerations.
    Row::new(Statement::ChetaevMultiplier, EXACT_TOLERANCE),
    Row::new(Statement::ProjectedFlow, EXACT_TOLERANCE),
    Row::new(Statement::ExponentialMap, EXACT_TOLERANCE),
    Row::new(Statement::NonHolonomicExponential, EXACT_TOLERANCE),
    Row::new(Statement::ImageProjection, EXACT_TOLERANCE),
    // From a guess on the branch of the motion; [`retraction`] has the others.
    Row::new(Statement::ExactRetractions, EXACT_TOLERANCE),
    Row::new(Statement::LinearEquation, EXACT_TOLERANCE),
    // First and second derivatives, against duals through flow and shooting.
    Row::new(Statement::ExactDerivatives, EXACT_TOLERANCE),
    Row::new(Statement::ExactLegendreTransforms, EXACT_TOLERANCE),
    Row::new(Statement::ExactFlow, EXACT_TOLERANCE),
];

#[test]
fn statements_along_motions_of_every_system() {
    along_motions_of_every_system(ALONG_MOTIONS);
}
