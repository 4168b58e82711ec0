//! Section 6, future work: orders of the error and of the method, statement 40. Rules on Q x Q x R^2, statement 41, are
//! tested together with statement 16 in `section_3::vermeeren_bravetti_seri`.

mod error_orders;
mod method_orders;

use contact_geom::Statement;

/// The statements that [`error_orders`] and `section_3::vermeeren_bravetti_seri` test.
pub const BY_NAME: &[Statement] = &[Statement::ErrorOrders, Statement::ExtendedRules];
