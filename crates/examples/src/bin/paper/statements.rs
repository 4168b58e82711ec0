//! The walk over the catalogue that checks the paper's statements.

use crate::{section2, section3, section5};
use contact_examples::systems::{System, SystemVisitor, catalogue_size, visit_catalogue};
use contact_examples::{Checks, Subject, fractions, progress_bar};
use indicatif::ProgressBar;

/// Checks every statement on everything that it applies to.
pub fn check_all() -> Checks {
    let bar = progress_bar("checking statements", catalogue_size() + 1, "  {msg}");
    let mut walk = Walk { checks: Checks::default(), bar: &bar };
    visit_catalogue(&mut walk);
    let mut checks = walk.checks;
    bar.set_message("examples of section 5");
    section2::closed_flows(&mut checks);
    section2::without_lagrangian(&mut checks);
    section5::check(&mut checks);
    bar.finish_and_clear();
    checks
}

/// Checks the statements of sections 2 and 3 on each system.
struct Walk<'a> {
    checks: Checks,
    bar: &'a ProgressBar,
}

impl SystemVisitor for Walk<'_> {
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
        self.bar.set_message(system.name());
        for statement in contact_geom::statements::STATEMENTS {
            let subject = Subject::continuous(statement, system.name());
            for i in 0..section2::SAMPLES {
                let (t, x) = system.sample(&fractions(i, 2 * N + 2));
                self.checks.record(&subject, contact_geom::statements::residual(statement, system, t, &x));
            }
        }
        section3::check(system, &mut self.checks);
        self.bar.inc(1);
    }
}
