//! Tables of statements, and the functions that evaluate every statement of a table on all systems and methods to which
//! it applies.
//!
//! The residuals are those of the modules `statements` of the libraries. A failure names the statement, the system and
//! the method, with the smallest random sample that fails.

use crate::common::{around, bounded, on_random, on_some, step_from};
use contact_examples::systems::{System, SystemVisitor, catalogue_size, visit_catalogue};
use contact_geom::{Statement, VelocityPoint, legendre, statements as continuous};
use discrete_herglotz::{
    InputError,
    rules::{AnyDiscreteLagrangian, Method},
    statements as discrete,
};
use exact_lagrangian::{ExactError, statements as exact};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The bound on the residuals of section 4, in units of the condition of the motion. They are some 1e-15; a wrong
/// formula (a sign, a factor e^b) is off by h.
pub const EXACT_TOLERANCE: f64 = 1e-12;

/// The number of systems of the catalogue that declare a symmetry.
pub const SYMMETRIC: usize = 7;

/// The systems to which a statement applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hypothesis {
    /// All systems.
    None,
    /// The systems that declare a symmetry.
    Symmetry,
}

/// A statement, its hypothesis, and the bound on its residual.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub statement: Statement,
    pub hypothesis: Hypothesis,
    pub bound: f64,
}

impl Row {
    /// A statement about all systems.
    pub const fn new(statement: Statement, bound: f64) -> Self {
        Row { statement, hypothesis: Hypothesis::None, bound }
    }

    /// A statement about the systems that declare a symmetry.
    pub const fn with_symmetry(statement: Statement, bound: f64) -> Self {
        Row { statement, hypothesis: Hypothesis::Symmetry, bound }
    }

    /// Whether the statement applies to a system.
    pub fn applies_to<const N: usize>(&self, system: &impl System<N>) -> bool {
        self.hypothesis == Hypothesis::None || !system.symmetries().is_empty()
    }

    /// The number of systems to which the statement applies.
    fn systems(&self) -> usize {
        if self.hypothesis == Hypothesis::None { catalogue_size() } else { SYMMETRIC }
    }

    /// The number of pairs of a system and a method to which the statement applies.
    fn pairs(&self) -> usize {
        let Pairs { all, symmetric } = pairs();
        if self.hypothesis == Hypothesis::None { all } else { symmetric }
    }

    /// Compares a residual with the bound, where an error of the library is a failure too; notes whether the statement
    /// was evaluated.
    fn check(&self, residual: Result<Option<f64>, impl std::fmt::Display>, evaluated: &mut bool) -> Result<(), String> {
        match residual {
            Err(e) => Err(e.to_string()),
            Ok(Some(r)) => {
                *evaluated = true;
                bounded(r, self.bound)
            }
            Ok(None) => Ok(()),
        }
    }
}

/// Checks the rows of a table on all processors. The message of a row that fails is that of its thread.
fn for_each_row(table: &[Row], check: impl Fn(&Row) + Sync) {
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(row) = table.get(next.fetch_add(1, Ordering::Relaxed)) {
            check(row);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
}

/// Evaluates the statements of section 2 at random points of every system.
pub fn at_points_of_every_system(table: &[Row]) {
    struct Visitor<'a>(&'a Row, usize);
    impl SystemVisitor for Visitor<'_> {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let row = self.0;
            let name = format!("statement {} on {}", row.statement, system.name());
            let mut evaluated = false;
            on_random(&name, 2 * N + 2, |u| {
                let (t, x) = system.sample(u);
                row.check(continuous::residual(row.statement, system, t, &x), &mut evaluated)
            });
            assert_eq!(evaluated, row.applies_to(system), "{name}: evaluated, and applies");
            self.1 += usize::from(evaluated);
        }
    }
    for_each_row(table, |row| {
        let mut visitor = Visitor(row, 0);
        visit_catalogue(&mut visitor);
        assert_eq!(visitor.1, row.systems(), "the number of systems of statement {}", row.statement);
    });
}

/// Evaluates the statements of section 3 at random points of every system, with every method whose hypothesis the
/// system meets.
pub fn with_every_method(table: &[Row]) {
    struct Visitor<'a>(&'a Row, usize);
    impl SystemVisitor for Visitor<'_> {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let row = self.0;
            let symmetries = system.symmetries();
            for method in Method::applicable(&system.structure()) {
                let name = format!("statement {} on {} with {method}", row.statement, system.name());
                let mut evaluated = false;
                on_random(&name, 2 * N + 3, |u| {
                    let (t, x) = system.sample(&u[1..]);
                    let h = step_from(u[0]);
                    let ld = discretise(method, system, h, t, &x).map_err(|e| e.to_string())?;
                    let residual = discrete::residual(row.statement, &ld, &symmetries, t, &around(&x, h));
                    row.check(residual, &mut evaluated)
                });
                assert_eq!(evaluated, row.applies_to(system), "{name}: evaluated, and applies");
                self.1 += usize::from(evaluated);
            }
        }
    }
    for_each_row(table, |row| {
        let mut visitor = Visitor(row, 0);
        visit_catalogue(&mut visitor);
        assert_eq!(visitor.1, row.pairs(), "the number of systems and methods of statement {}", row.statement);
    });
}

/// The discrete Lagrangian of a system by a method, which verifies the structure of L at a point of TQ x R.
pub fn discretise<'a, const N: usize, S: System<N>>(
    method: Method,
    system: &'a S,
    h: f64,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<AnyDiscreteLagrangian<&'a S, N>, InputError> {
    method.discretise(system, h, t, &legendre(system, t, x))
}

/// The numbers of pairs of a system and a method whose hypothesis the system meets.
#[derive(Debug, Default, PartialEq)]
pub struct Pairs {
    /// All pairs.
    pub all: usize,
    /// The pairs whose system declares a symmetry.
    pub symmetric: usize,
}

impl SystemVisitor for Pairs {
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
        let structure = system.structure();
        let met = Method::ALL.iter().filter(|method| method.check(&structure).is_ok()).count();
        self.all += met;
        self.symmetric += if system.symmetries().is_empty() { 0 } else { met };
    }
}

/// Counts the pairs by the hypotheses of the methods alone.
pub fn pairs() -> Pairs {
    let mut pairs = Pairs::default();
    visit_catalogue(&mut pairs);
    pairs
}

/// Evaluates the statements of section 4 along random motions of every system.
pub fn along_motions_of_every_system(table: &[Row]) {
    struct Residual(Statement);
    impl AlongMotion for Residual {
        fn residual<const N: usize, S: System<N>>(
            &mut self,
            system: &S,
            t: f64,
            x: &VelocityPoint<N>,
            h: f64,
        ) -> Result<f64, ExactError<N>> {
            // A statement that is not evaluated is above every bound.
            Ok(exact::residual(self.0, system, t, x, h)?.unwrap_or(f64::INFINITY))
        }
    }
    for_each_row(table, |row| {
        visit_catalogue(&mut OverMotions {
            name: format!("statement {}", row.statement),
            bound: row.bound,
            residual: Residual(row.statement),
        });
    });
}

/// A residual at a time, a point of TQ x R and a step.
pub trait AlongMotion {
    fn residual<const N: usize, S: System<N>>(
        &mut self,
        system: &S,
        t: f64,
        x: &VelocityPoint<N>,
        h: f64,
    ) -> Result<f64, ExactError<N>>;
}

/// Checks a residual at random points of every system with random steps between 1e-3 and 1 on a logarithmic scale: at
/// fewer points of the systems with most coordinates, whose second duals are long.
pub struct OverMotions<F> {
    /// What is checked, for the message of a failure.
    pub name: String,
    /// The bound on the residual.
    pub bound: f64,
    pub residual: F,
}

impl<F: AlongMotion> SystemVisitor for OverMotions<F> {
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
        let name = format!("{} on {}", self.name, system.name());
        let cases = if N > 2 { 8 } else { 24 };
        let mut outside = 0;
        on_some(cases, &name, 2 * N + 3, |u| {
            let (t, x) = system.sample(&u[1..]);
            let h = 10f64.powf(3.0 * (u[0] - 1.0));
            match self.residual.residual(system, t, &x, h) {
                Ok(residual) => bounded(residual, self.bound),
                // The motion from this point is not defined up to h, so that the statement says nothing about it.
                Err(ExactError::OutsideDomain { .. }) => {
                    outside += 1;
                    Ok(())
                }
                Err(error) => Err(error.to_string()),
            }
        });
        assert!(outside <= cases / 6, "{name}: {outside} of {cases} starts are outside U_h");
    }
}
