//! Intermediate results of the checks of a run.

use crate::UnresolvedStep;
use crate::run::checks::energy_drift::EnergySums;

/// Intermediate results of the checks of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Findings {
    /// The logarithm of the product of the `sigma_d`.
    pub log_factor: f64,
    pub unresolved: Option<UnresolvedStep>,
    pub energy: EnergySums,
}
