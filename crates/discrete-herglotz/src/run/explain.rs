//! What a plan computes and skips, in words.

use super::Plan;
use crate::PlanEntry;
use contact_geom::{Lagrangian, Structure};
use std::fmt::{Display, Formatter};

impl<'p, L: Lagrangian<N>, const N: usize> Plan<'p, L, N> {
    /// What is computed, and what is not: by the steps, and beside them.
    pub fn items(&self) -> Vec<PlanEntry> {
        let mut items = self.work_summary.clone();
        if self.needs.action {
            items.retain(|item| item.what != "action z");
            items.push(PlanEntry::computed("action z", "requested"));
        }
        let what = "conformal factor";
        items.push(match (self.needs.conformal_factor, self.constant_rate) {
            (false, true) => {
                PlanEntry::skipped(what, "sigma_d is the same in every step, and the product is not requested")
            }
            (true, true) => {
                PlanEntry::computed(what, "requested; sigma_d is the same in every step: a power at the end")
            }
            (true, false) => {
                PlanEntry::computed(what, "requested, and different in every step: a product along the run")
            }
            (false, false) => {
                PlanEntry::skipped(what, "the product is not requested; each step checks that its own is positive")
            }
        });
        let structure = self.problem.structure;
        let what = "probes of the structure";
        items.push(if const { L::PROVED } {
            PlanEntry::skipped(what, "it is proved from the formula of L")
        } else if structure == Structure::default() {
            PlanEntry::skipped(what, "nothing is claimed of L")
        } else {
            PlanEntry::computed(what, "it is claimed: at the start, and along the run")
        });
        let (what, autonomous) = ("time at the stages", structure.autonomous);
        items.push(PlanEntry {
            what,
            computed: !autonomous,
            why: if autonomous { "L does not depend on it" } else { "L depends on it" }.into(),
        });
        items
    }
}

impl<L: Lagrangian<N>, const N: usize> Display for Plan<'_, L, N> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Plan { problem, count, h, info, t_end, .. } = self;
        let (t0, items) = (problem.t0, self.items());
        let of = if info.in_transformed_time { " of the transformed time" } else { "" };
        writeln!(f, "{count} steps of {h}{of} by {}, t = {t0} .. {t_end}", info.name)?;
        for (title, computed) in [("computed", true), ("skipped", false)] {
            writeln!(f, "{title}:")?;
            for item in items.iter().filter(|item| item.computed == computed) {
                writeln!(f, "  {}: {}", item.what, item.why)?;
            }
        }
        Ok(())
    }
}
