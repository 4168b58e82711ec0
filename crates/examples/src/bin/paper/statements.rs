//! The paper's statements by their numbers in the project's list, and the walk over the catalogue that checks them.

use crate::checks::{Checks, Subject, fractions};
use crate::{section2, section3, section5};
use contact_geom::systems::{System, SystemVisitor, visit_catalogue};
use indicatif::{ProgressBar, ProgressStyle};

/// The time steps at which discretisations are checked.
pub const STEPS: [f64; 2] = [0.1, 0.01];

/// A few words for a statement, for tables; NOTATION.md has the statements.
pub fn title(statement: u32) -> &'static str {
    match statement {
        1 => "contact condition",
        2 => "Reeb field, flat and sharp",
        3 => "contact Hamiltonian vector field",
        4 => "L_X eta = -R(f) eta",
        5 => "conformal factor of a flow",
        6 => "X_H(H) = -R(H) H",
        7 => "L regular iff eta_L contact",
        8 => "Herglotz field is of second order",
        9 => "FL is a contactomorphism",
        11 => "dissipated quantities",
        12 => "Noether's theorem",
        13 => "differential of the discrete action",
        14 => "the same for two steps",
        15 => "discrete Herglotz principle",
        16 => "condition on Q x Q x R^2",
        17 => "F+ and F- regular together",
        18 => "momentum matching",
        19 => "existence of the discrete flow",
        20 => "three expressions of the flow",
        21 => "eta+ and eta- are contact forms",
        22 => "eta+ = sigma_d eta-, pullback to eta+",
        23 => "conformal factors of Phi_d",
        24 => "conformal factor of the flow on T*Q x R",
        25 => "invariance of L_d",
        26 => "discrete Noether theorem",
        37 => "free particle, explicit",
        38 => "oscillator, explicit",
        39 => "midpoint rule for any V",
        41 => "rules on Q x Q x R^2",
        _ => "not in this program",
    }
}

/// Checks every statement on everything that it applies to.
pub fn check_all() -> Checks {
    let mut counter = Counter(0);
    visit_catalogue(&mut counter);
    let bar = ProgressBar::new(counter.0 + 1).with_style(
        ProgressStyle::with_template("checking statements {bar:30} {pos}/{len}  {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
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

/// Counts the systems.
struct Counter(u64);

impl SystemVisitor for Counter {
    fn visit<const N: usize, S: System<N>>(&mut self, _system: &S) {
        self.0 += 1;
    }
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
