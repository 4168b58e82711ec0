//! The entries of a plan: what an integrator, or a run, computes and skips.

use std::borrow::Cow;

/// One line of a plan: something that could be computed, whether it is, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanEntry {
    /// What it is about.
    pub what: &'static str,
    /// Whether it is computed.
    pub computed: bool,
    /// Why, or how.
    pub why: Cow<'static, str>,
}

impl PlanEntry {
    /// Something that is computed, and why or how.
    pub fn computed(what: &'static str, why: impl Into<Cow<'static, str>>) -> Self {
        PlanEntry { what, computed: true, why: why.into() }
    }

    /// Something that is not computed, and why.
    pub fn skipped(what: &'static str, why: impl Into<Cow<'static, str>>) -> Self {
        PlanEntry { what, computed: false, why: why.into() }
    }
}

/// Why the action is left out.
pub(crate) const DECOUPLED: &str = "L = L0 + gamma z: it does not act back, and is not requested";
