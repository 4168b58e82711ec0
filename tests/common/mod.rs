//! What every theorem test shares: random points of every system, with every discretisation.

pub mod oracle;

use contact_geom::systems::{
    CoupledPlane, DoublePendulum, Duffing, HarmonicOscillator, Kepler, QuadraticInZ, System, SystemVisitor,
    visit_catalogue,
};
use contact_geom::{DiscretePoint, Statement, VelocityPoint, legendre, statements as continuous};
use discrete_herglotz::{AnyDiscreteLagrangian, InputError, Method, statements as discrete};
use exact_lagrangian::{ExactError, statements as exact};
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

/// The bound on theorem residuals, relative to the terms' size: 5e4 eps, for the conditions of W and of F-L_d that the
/// samples allow (1e3) times the operations in a formula.
pub const TOLERANCE: f64 = 1e-11;

/// The random cases for each system and method.
pub const CASES: u32 = 256;

/// A runner whose cases are the same in every run.
pub fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// Runs a check on random vectors of `[0, 1]^dimension`; panics with the smallest failing case.
pub fn on_random(name: &str, dimension: usize, check: impl FnMut(&[f64]) -> Result<(), String>) {
    on_some(CASES, name, dimension, check);
}

/// The same on fewer cases, for checks that integrate motions.
pub fn on_some(cases: u32, name: &str, dimension: usize, mut check: impl FnMut(&[f64]) -> Result<(), String>) {
    let strategy = proptest::collection::vec(0.0..=1.0f64, dimension);
    let cell = std::cell::RefCell::new(&mut check);
    let outcome = runner(cases).run(&strategy, |u| (cell.borrow_mut())(&u).map_err(TestCaseError::fail));
    assert!(outcome.is_ok(), "{name}: {outcome:?}");
}

/// Whether a residual is within the [`TOLERANCE`]; a NaN is not.
pub fn within(residual: f64) -> Result<(), String> {
    bounded(residual, TOLERANCE)
}

/// Whether a residual is within a bound; a NaN is not.
pub fn bounded(residual: f64, bound: f64) -> Result<(), String> {
    if residual <= bound { Ok(()) } else { Err(format!("residual {residual:e}")) }
}

/// A residual as a check: an error of the library is a failure too.
fn check(residual: Result<Option<f64>, impl std::fmt::Display>, bound: f64, applies: &mut bool) -> Result<(), String> {
    match residual {
        Err(e) => Err(e.to_string()),
        Ok(Some(r)) => {
            *applies = true;
            bounded(r, bound)
        }
        Ok(None) => Ok(()),
    }
}

/// The two positions of a step of length `h` around a point of TQ x R.
pub fn around<const N: usize>(x: &VelocityPoint<N>, h: f64) -> DiscretePoint<N> {
    DiscretePoint { q0: x.q - x.v * (0.5 * h), q1: x.q + x.v * (0.5 * h), z0: x.z }
}

/// A step between 0.005 and 0.05 on a logarithmic scale: small enough for every system's fastest sample, so that F-L_d has
/// one inverse near the motion.
pub fn step_from(u: f64) -> f64 {
    0.005 * 10f64.powf(u)
}

/// Checks a statement of section 2 at random points of every system; returns on how many systems it applies.
pub fn over_catalogue(statement: Statement) -> usize {
    struct Visitor(Statement, usize);
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let mut applies = false;
            on_random(system.name(), 2 * N + 2, |u| {
                let (t, x) = system.sample(u);
                check(continuous::residual(self.0, system, t, &x), TOLERANCE, &mut applies)
            });
            self.1 += usize::from(applies);
        }
    }
    let mut visitor = Visitor(statement, 0);
    visit_catalogue(&mut visitor);
    visitor.1
}

/// The discrete Lagrangian by a method, where the form of L is verified at a point of TQ x R.
pub fn discretise<'a, const N: usize, S: System<N>>(
    method: Method,
    system: &'a S,
    h: f64,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<AnyDiscreteLagrangian<&'a S, N>, InputError> {
    method.discretise(system, h, t, &legendre(system, t, x))
}

/// Checks a statement of section 3 at random points of every system with every method whose hypothesis it meets; returns
/// with how many pairs the statement applies.
pub fn over_discretisations(statement: Statement) -> usize {
    over_discretisations_within(statement, TOLERANCE)
}

/// The same with another bound than the [`TOLERANCE`].
pub fn over_discretisations_within(statement: Statement, bound: f64) -> usize {
    struct Visitor {
        statement: Statement,
        bound: f64,
        applies: usize,
    }
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let symmetries = system.symmetries();
            for method in Method::applicable(&system.structure()) {
                let mut applies = false;
                on_random(&format!("{} with {method}", system.name()), 2 * N + 3, |u| {
                    let (t, x) = system.sample(&u[1..]);
                    let h = step_from(u[0]);
                    let ld = discretise(method, system, h, t, &x).map_err(|e| e.to_string())?;
                    let residual = discrete::residual(self.statement, &ld, &symmetries, t, &around(&x, h));
                    check(residual, self.bound, &mut applies)
                });
                self.applies += usize::from(applies);
            }
        }
    }
    let mut visitor = Visitor { statement, bound, applies: 0 };
    visit_catalogue(&mut visitor);
    visitor.applies
}

/// The pairs of a system and a method whose hypothesis it meets.
#[derive(Debug, Default, PartialEq)]
pub struct Pairs {
    /// All.
    pub all: usize,
    /// Those whose system declares a symmetry.
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

/// Counts the pairs by the methods' hypotheses alone.
pub fn pairs() -> Pairs {
    let mut pairs = Pairs::default();
    visit_catalogue(&mut pairs);
    pairs
}

/// The bound on the residuals of section 4, in units of the condition of the motion. They are
/// some 1e-15; a wrong formula (a sign, a factor e^b) is off by h.
pub const EXACT: f64 = 1e-12;

/// A step between 1e-3 and 1 on a logarithmic scale.
pub fn exact_step_from(u: f64) -> f64 {
    10f64.powf(3.0 * (u - 1.0))
}

/// A check at random points of every system with random steps: fewer for the systems with most coordinates, whose second
/// duals are long.
pub struct OverMotions<F>(pub F);

/// What [`OverMotions`] does at a time, a point of TQ x R and a step.
pub trait AlongMotion {
    /// The residual, which must be at most [`EXACT`].
    fn residual<const N: usize, S: System<N>>(
        &mut self,
        system: &S,
        t: f64,
        x: &VelocityPoint<N>,
        h: f64,
    ) -> Result<f64, ExactError<N>>;
}

impl<F: AlongMotion> SystemVisitor for OverMotions<F> {
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
        let cases = if N > 2 { 8 } else { 24 };
        let mut outside = 0;
        on_some(cases, system.name(), 2 * N + 3, |u| {
            let (t, x) = system.sample(&u[1..]);
            match self.0.residual(system, t, &x, exact_step_from(u[0])) {
                Ok(residual) if residual <= EXACT => Ok(()),
                Ok(residual) => Err(format!("residual {residual:e}")),
                // Not in U_h: the motion from there is not defined up to h. No statement is made.
                Err(ExactError::OutsideDomain { .. }) => {
                    outside += 1;
                    Ok(())
                }
                Err(error) => Err(error.to_string()),
            }
        });
        assert!(outside <= cases / 6, "{}: {outside} of {cases} starts are outside U_h", system.name());
    }
}

/// Checks a statement of section 4 along random motions of every system.
pub fn over_motions(statement: Statement) {
    struct Residual(Statement);
    impl AlongMotion for Residual {
        fn residual<const N: usize, S: System<N>>(
            &mut self,
            system: &S,
            t: f64,
            x: &VelocityPoint<N>,
            h: f64,
        ) -> Result<f64, ExactError<N>> {
            Ok(exact::residual(self.0, system, t, x, h)?.unwrap_or(f64::INFINITY))
        }
    }
    visit_catalogue(&mut OverMotions(Residual(statement)));
}

/// Visits one system of each kind of structure, for tests of integrators, which are long to compile: linear, separable, time
/// dependent, nonlinear in z, with a mass matrix that depends on q, and on q, v and z.
pub fn visit_kinds(visitor: &mut impl SystemVisitor) {
    visitor.visit(&HarmonicOscillator::default());
    visitor.visit(&Kepler::<2>::default());
    visitor.visit(&Duffing::forced());
    visitor.visit(&QuadraticInZ::default());
    visitor.visit(&DoublePendulum::default());
    visitor.visit(&CoupledPlane::default());
}

pub use contact_geom::systems::catalogue_size as systems;

/// The systems that declare a symmetry.
pub const SYMMETRIC: usize = 8;
