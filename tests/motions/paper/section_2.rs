//! Section 2: contact manifolds, Hamiltonian and Herglotz fields, Herglotz' principle, dissipated quantities.
//! Statements 1 to 12.

mod conformal_factor;
mod contact_forms;
mod dissipated_quantities;
mod herglotz_field;
mod herglotz_principle;

use crate::common::TOLERANCE;
use crate::paper::table::{
    EXACT_TOLERANCE, Row, along_motions_of_every_system, at_points_of_every_system, with_every_method,
};
use contact_geom::Statement;

/// The statements about forms and fields at a point of a system.
pub const AT_POINTS: &[Row] = &[
    Row::new(Statement::Volume, TOLERANCE),
    Row::new(Statement::ReebField, TOLERANCE),
    Row::new(Statement::HamiltonianField, TOLERANCE),
    Row::new(Statement::InfinitesimalContactomorphism, TOLERANCE),
    Row::new(Statement::EnergyDecay, TOLERANCE),
    Row::new(Statement::Regularity, TOLERANCE),
    Row::new(Statement::HerglotzField, TOLERANCE),
    Row::new(Statement::LegendreTransformation, TOLERANCE),
    Row::new(Statement::DissipatedQuantities, TOLERANCE),
    Row::with_symmetry(Statement::Noether, TOLERANCE),
];

/// The statements about forms that hold on Q x Q x R as well.
pub const WITH_METHODS: &[Row] = &[Row::new(Statement::Volume, TOLERANCE), Row::new(Statement::ReebField, TOLERANCE)];

/// The statement about motions, and about bent curves with the same ends.
pub const ALONG_MOTIONS: &[Row] = &[Row::new(Statement::HerglotzPrinciple, EXACT_TOLERANCE)];

/// The statement that [`conformal_factor`] tests.
pub const BY_NAME: &[Statement] = &[Statement::ConformalFactor];

#[test]
fn statements_at_points_of_every_system() {
    at_points_of_every_system(AT_POINTS);
}

#[test]
fn statements_with_every_method() {
    with_every_method(WITH_METHODS);
}

#[test]
fn statements_along_motions_of_every_system() {
    along_motions_of_every_system(ALONG_MOTIONS);
}
