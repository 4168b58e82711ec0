//! Statement 22 (section 3.1, lemma): `eta+ = sigma_d eta-` and `Phi_d* eta- = eta+`.

use crate::common::{over_discretisations, pairs};
use contact_geom::Statement;

/// With every discretisation of every system.
#[test]
fn with_every_discretisation() {
    assert_eq!(over_discretisations(Statement::DiscreteFormsAreConformal), pairs().all);
}
