//! The entries of a plan, which list what an integrator or a run computes and skips.

use std::borrow::Cow;

/// One entry of a plan: a quantity or an operation, whether it is computed, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanEntry {
    /// The quantity or the operation.
    pub what: &'static str,
    /// Whether it is computed.
    pub computed: bool,
    /// The reason, or the way of computation.
    pub why: Cow<'static, str>,
}

impl PlanEntry {
    /// An entry for something that is computed, and why or how.
    pub fn computed(what: &'static str, why: impl Into<Cow<'static, str>>) -> Self {
        PlanEntry { what, computed: true, why: why.into() }
    }

    /// An entry for something that is not computed, and why.
    pub fn skipped(what: &'static str, why: impl Into<Cow<'static, str>>) -> Self {
        PlanEntry { what, computed: false, why: why.into() }
    }
}

/// The reason for skipping the action.
pub(crate) const DECOUPLED: &str = "L = L0 + gamma z: the motion does not depend on z, and z is not requested";
