//! The table of checked statements: the worst residual for each statement, system, method and time step.

use crate::Failure;
use contact_geom::Statement;
use std::collections::BTreeMap;
use std::error::Error;

/// The largest residual that a true statement of sections 2 and 3 may have.
///
/// Residuals are relative to the size of their terms, so they are a few units of round-off (2e-16) times the conditions
/// of the matrices that are inverted: W, the derivative of F-L_d, the Jacobian of a step. Those of the catalogue stay
/// below 1e4; 1e-11 leaves a factor of ten. A false statement (a wrong sign, `1 + h gamma` for `e^(h gamma)`) has a
/// residual of the size of `h gamma`, 1e-3 and more.
pub const TOLERANCE: f64 = 1e-11;

/// The statement, system, method and step that a residual belongs to. The order is that of the table: by statement,
/// then by name, then by step.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Subject {
    /// The statement.
    pub statement: Statement,
    /// The system that it was checked on.
    pub system: &'static str,
    /// The discretisation, or a dash for the statements that need none.
    pub method: String,
    /// The bits of the time step, which order positive numbers; 0 for none.
    step: u64,
}

impl Subject {
    /// A statement without discretisation.
    pub fn continuous(statement: Statement, system: &'static str) -> Self {
        Subject { statement, system, method: "-".into(), step: 0 }
    }

    /// A statement for a discrete Lagrangian.
    pub fn discrete(statement: Statement, system: &'static str, method: &str, h: f64) -> Self {
        Subject { statement, system, method: method.into(), step: h.to_bits() }
    }

    /// The time step, 0 for none.
    pub fn time_step(&self) -> f64 {
        f64::from_bits(self.step)
    }

    /// The time step as text, a dash for none.
    pub fn step(&self) -> String {
        if self.step == 0 { "-".into() } else { f64::from_bits(self.step).to_string() }
    }
}

/// All residuals recorded so far.
#[derive(Clone, Debug, Default)]
pub struct Checks {
    /// The worst residual, and its tolerance.
    worst: BTreeMap<Subject, (f64, f64)>,
    /// The errors of statements that could not be evaluated.
    errors: BTreeMap<Subject, String>,
}

impl Checks {
    /// Records a residual that must be within [`TOLERANCE`]. A statement that cannot be evaluated has an infinite
    /// residual; `None` means that the hypotheses of the statement do not hold here.
    pub fn record<E: Error>(&mut self, subject: &Subject, residual: Result<Option<f64>, E>) {
        self.record_within(TOLERANCE, subject, residual);
    }

    /// Records a residual with a tolerance of its own.
    pub fn record_within<E: Error>(&mut self, tolerance: f64, subject: &Subject, residual: Result<Option<f64>, E>) {
        let residual = match residual {
            Ok(None) => return,
            Ok(Some(residual)) if !residual.is_nan() => residual,
            Ok(Some(_)) => {
                self.errors.insert(subject.clone(), "the residual is not a number".into());
                f64::INFINITY
            }
            Err(error) => {
                self.errors.insert(subject.clone(), error.to_string());
                f64::INFINITY
            }
        };
        match self.worst.get_mut(subject) {
            Some((worst, _)) => *worst = worst.max(residual),
            None => {
                self.worst.insert(subject.clone(), (residual, tolerance));
            }
        }
    }

    /// The subjects with their residuals, in the table's order.
    pub fn iter(&self) -> impl Iterator<Item = (&Subject, f64)> {
        self.worst.iter().map(|(subject, (residual, _))| (subject, *residual))
    }

    /// The worst residual of a statement, and the subject that has it.
    pub fn worst_of(&self, statement: Statement) -> Option<(&Subject, f64)> {
        let of = self.iter().filter(|(subject, _)| subject.statement == statement);
        of.reduce(|worst, other| if other.1 > worst.1 { other } else { worst })
    }

    /// The number of subjects that a statement was checked on.
    pub fn count(&self, statement: Statement) -> usize {
        self.iter().filter(|(subject, _)| subject.statement == statement).count()
    }

    /// The rows of `statements.csv`.
    pub fn rows(&self) -> impl Iterator<Item = Vec<String>> {
        self.worst.iter().map(|(subject, (residual, tolerance))| {
            let numbers = [format!("{residual:.3e}"), format!("{tolerance:e}")];
            let [residual, tolerance] = numbers;
            let statement = subject.statement.number().to_string();
            vec![statement, subject.system.into(), subject.method.clone(), subject.step(), residual, tolerance]
        })
    }

    /// Fails unless every residual is within the tolerance.
    pub fn verdict(&self) -> Result<(), Failure> {
        let wrong: Vec<String> = self
            .worst
            .iter()
            .filter(|(_, (residual, tolerance))| residual > tolerance)
            .map(|(subject, (residual, tolerance))| {
                let Subject { statement, system, method, .. } = subject;
                let cause = self.errors.get(subject).map_or(String::new(), |error| format!(" ({error})"));
                let step = subject.step();
                format!("  {statement}: {system}, {method}, h = {step}: {residual:.1e} > {tolerance:e}{cause}")
            })
            .collect();
        Failure::unless_empty(&wrong, self.worst.len(), "checks of the paper's statements fail")
    }
}

/// `count` numbers in `[0, 1)` for the sample of index `i`: a Kronecker sequence, which fills the cube evenly and is
/// the same in every run.
pub fn fractions(i: usize, count: usize) -> Vec<f64> {
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    let position = (i + 1) as f64;
    PRIMES.iter().cycle().take(count).map(|prime| (position * prime.sqrt()).fract()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::GeometryError;

    fn verdict(residual: Result<Option<f64>, GeometryError>) -> Result<(), Failure> {
        let mut checks = Checks::default();
        let subject = Subject::discrete(Statement::DiscreteHerglotzPrinciple, "pendulum", "midpoint", 0.1);
        checks.record(&subject, Ok::<_, GeometryError>(Some(1e-15)));
        checks.record(&subject, residual);
        checks.record(&subject, Ok::<_, GeometryError>(Some(2e-15)));
        checks.verdict()
    }

    #[test]
    fn one_bad_residual_fails_and_no_number_hides_it() {
        assert!(verdict(Ok(Some(9e-12))).is_ok());
        assert!(verdict(Ok(None)).is_ok());
        assert!(verdict(Ok(Some(1.1e-11))).is_err());
        assert!(verdict(Ok(Some(f64::NAN))).is_err());
        assert!(verdict(Err(GeometryError::Undefined { what: "the flow" })).is_err());
    }

    #[test]
    fn each_subject_has_its_own_tolerance() {
        let mut checks = Checks::default();
        let order = Subject::discrete(Statement::ErrorOrders, "pendulum", "midpoint", 0.0);
        checks.record_within(0.15, &order, Ok::<_, GeometryError>(Some(0.1)));
        assert!(checks.verdict().is_ok());
        checks.record_within(0.15, &order, Ok::<_, GeometryError>(Some(0.2)));
        assert!(checks.verdict().is_err());
    }

    #[test]
    fn samples_fill_the_cube() {
        for column in 0..10 {
            let mut values: Vec<f64> = (0..16).map(|i| fractions(i, 10)[column]).collect();
            values.sort_by(f64::total_cmp);
            assert!(values.windows(2).all(|pair| pair[1] - pair[0] < 0.25), "column {column}: {values:?}");
            assert!(values[0] >= 0.0 && values[0] < 0.25 && values[15] > 0.75 && values[15] < 1.0);
        }
    }
}
