//! What a run has found out about its motion so far.

use crate::UnresolvedStep;
use crate::run::checks::energy_drift::EnergySums;

/// What a run has found out about its motion so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Findings {
    /// The logarithm of the product of the `sigma_d`.
    pub log_factor: f64,
    pub unresolved: Option<UnresolvedStep>,
    pub energy: EnergySums,
}
