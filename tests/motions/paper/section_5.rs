//! Section 5: the examples and their figures. Statements 37 to 39.

mod figures;
pub mod free_particle;
mod midpoint_rule;
mod oscillator;

use crate::common::TOLERANCE;
use crate::paper::table::{Row, with_every_method};
use contact_geom::Statement;

/// The statement that sigma_d is positive on the samples; [`midpoint_rule`] has the equations.
pub const WITH_METHODS: &[Row] = &[Row::new(Statement::MidpointRule, TOLERANCE)];

/// The statements that [`free_particle`] and [`oscillator`] test.
pub const BY_NAME: &[Statement] = &[Statement::FreeParticle, Statement::HarmonicOscillator];

#[test]
fn statements_with_every_method() {
    with_every_method(WITH_METHODS);
}
