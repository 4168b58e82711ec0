//! The statements of section 4 on every system, over six decades of the time step.

use contact_examples::systems::{System, SystemVisitor, catalogue_size, visit_catalogue};
use contact_examples::{Checks, Directory, Failure, Subject, fractions, number, progress_bar};
use exact_lagrangian::{ContactExponential, ExactError, statements};
use indicatif::ProgressBar;

/// The time steps.
const STEPS: [f64; 7] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0];

/// The largest residual, in units of the condition of the motion: round-off gives 1e-15, a wrong formula at least h.
const TOLERANCE: f64 = 1e-12;

/// The loss of accuracy of a velocity that is recovered from two positions, for one step.
pub struct Loss {
    system: &'static str,
    pub h: f64,
    /// The relative error of the velocity, `R_h^(e-) o exp_h` against the identity.
    pub found: f64,
    /// The error that the condition of the exponential map predicts.
    pub predicted: f64,
}

/// Checks all statements; returns the residuals, and the losses for steps down to 1e-8.
pub fn check() -> (Checks, Vec<Loss>) {
    let bar = progress_bar("checking statements", catalogue_size(), "  {msg}");
    let mut walk = Walk { checks: Checks::default(), losses: Vec::new(), bar: &bar };
    visit_catalogue(&mut walk);
    bar.finish_and_clear();
    (walk.checks, walk.losses)
}

struct Walk<'a> {
    checks: Checks,
    losses: Vec<Loss>,
    bar: &'a ProgressBar,
}

impl SystemVisitor for Walk<'_> {
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
        self.bar.set_message(system.name());
        // Second-order dual numbers are expensive for many coordinates, so fewer samples are taken.
        let samples = if N > 2 { 2 } else { 4 };
        for (h, statement) in STEPS.into_iter().flat_map(|h| statements::STATEMENTS.map(|s| (h, s))) {
            let subject = Subject::discrete(statement, system.name(), "exact", h);
            for i in 0..samples {
                let (t, x) = system.sample(&fractions(i, 2 * N + 2));
                match statements::residual(statement, system, t, &x, h) {
                    // Outside U_h the statements do not apply.
                    Err(ExactError::OutsideDomain { .. }) => {}
                    residual => self.checks.record_within(TOLERANCE, &subject, residual),
                }
            }
        }
        for k in 0..=8 {
            let h = 10f64.powi(-k);
            let loss = |i: usize| -> Result<(f64, f64), ExactError<N>> {
                let (t, x) = system.sample(&fractions(i, 2 * N + 2));
                let exponential = ContactExponential::new(system, h)?;
                let found = exponential.retract_near(t, &exponential.at(t, &x)?, &x.v)?.start;
                let predicted = f64::EPSILON * statements::condition(system, t, &x, h)?;
                Ok(((found.v - x.v).amax() / x.v.amax(), predicted))
            };
            let all: Vec<_> = (0..samples).filter_map(|i| loss(i).ok()).collect();
            let worst = |of: fn(&(f64, f64)) -> f64| all.iter().map(of).fold(0.0, f64::max);
            let (found, predicted) = (worst(|l| l.0), worst(|l| l.1));
            self.losses.push(Loss { system: system.name(), h, found, predicted });
        }
        self.bar.inc(1);
    }
}

/// Writes the losses as a table.
pub fn write_losses(out: &Directory, losses: &[Loss]) -> Result<(), Failure> {
    let rows = losses.iter().map(|l| vec![l.system.into(), l.h.to_string(), number(l.found), number(l.predicted)]);
    out.table("velocity_loss.csv", &["system", "h", "relative_error", "predicted_by_condition"], rows)
}

/// The worst residual of each statement at each step, and of each system at each step.
pub fn tables(checks: &Checks) -> String {
    let header = |first: &str| {
        let steps: String = STEPS.iter().map(|h| format!("{h:>9e}")).collect();
        format!("  {first:<40}{steps}\n")
    };
    let row = |name: &str, of: &dyn Fn(&Subject) -> bool| {
        let worst = |h: f64| {
            let at = checks.iter().filter(|(subject, _)| subject.time_step() == h && of(subject));
            at.map(|(_, residual)| residual).reduce(f64::max)
        };
        let entries: String =
            STEPS.iter().map(|h| worst(*h).map_or(format!("{:>9}", "-"), |r| format!("{r:>9.0e}"))).collect();
        format!("  {name:<40}{entries}\n")
    };
    let mut text = String::from(
        "The statements of section 4: largest residual over the catalogue, in units of the condition of the motion, \
         for each h\n\n",
    );
    text += &header("statement");
    for statement in statements::STATEMENTS {
        text += &row(&format!("{:>2}  {}", statement.number(), statement.title()), &|s| s.statement == statement);
    }
    text += "\nLargest residual over the statements of section 4 for each system, in the same units\n\n";
    text += &header("system");
    let mut systems: Vec<&str> = checks.iter().map(|(subject, _)| subject.system).collect();
    systems.sort_unstable();
    systems.dedup();
    for system in systems {
        text += &row(system, &|s| s.system == system);
    }
    text
}

/// The loss of the velocity and its prediction, worst over the catalogue, as text.
pub fn loss(losses: &[Loss]) -> String {
    let mut text = String::from(
        "\nRelative error of a velocity computed from two rounded positions, R_h^(e-) o exp_h, and its prediction \
         from the condition of exp_h\n\n",
    );
    let steps: Vec<f64> = (0..=8).rev().map(|k| 10f64.powi(-k)).collect();
    let row = |name: &str, of: &dyn Fn(&Loss) -> f64| {
        let worst = |h: f64| losses.iter().filter(|l| l.h == h).map(of).fold(0.0, f64::max);
        let entries: String = steps.iter().map(|h| format!("{:>9.0e}", worst(*h))).collect();
        format!("  {name:<12}{entries}\n")
    };
    text += &format!("  {:<12}{}\n", "h", steps.iter().map(|h| format!("{h:>9e}")).collect::<String>());
    text + &row("found", &|l| l.found) + &row("predicted", &|l| l.predicted)
}
