//! Section 3: the discrete Herglotz principle, discrete Legendre transforms and flows, the contact forms of a discrete
//! Lagrangian, discrete symmetries. Statements 13 to 26.

mod exact_discrete_lagrangian;
mod noether;
mod regularity;
mod vermeeren_bravetti_seri;

use crate::common::TOLERANCE;
use crate::paper::table::{Row, with_every_method};
use contact_geom::Statement;

/// The bound for pullbacks of contact forms by the flow, relative to the terms of the pullback.
const PULLBACK: f64 = 1e-12;

/// The statements about a discrete Lagrangian at a point of Q x Q x R.
pub const WITH_METHODS: &[Row] = &[
    Row::new(Statement::ActionDifferential, TOLERANCE),
    Row::new(Statement::TwoSteps, TOLERANCE),
    Row::new(Statement::DiscreteHerglotzPrinciple, TOLERANCE),
    Row::new(Statement::DiscreteRegularity, TOLERANCE),
    Row::new(Statement::MomentumMatching, TOLERANCE),
    Row::new(Statement::DiscreteFlowExists, TOLERANCE),
    Row::new(Statement::HamiltonianFlowExpressions, TOLERANCE),
    Row::new(Statement::DiscreteContactForms, TOLERANCE),
    Row::new(Statement::DiscreteFormsAreConformal, TOLERANCE),
    Row::new(Statement::DiscreteFlowIsConformal, PULLBACK),
    Row::new(Statement::HamiltonianFlowIsConformal, PULLBACK),
    // Cartesian rules keep the linear symmetries of the catalogue.
    Row::with_symmetry(Statement::DiscreteInvariance, TOLERANCE),
    Row::with_symmetry(Statement::DiscreteNoether, TOLERANCE),
];

/// The statement that [`vermeeren_bravetti_seri`] tests.
pub const BY_NAME: &[Statement] = &[Statement::VermeerenBravettiSeri];

#[test]
fn statements_with_every_method() {
    with_every_method(WITH_METHODS);
}
