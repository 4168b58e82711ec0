//! Helpers that several test files share: random points, the samples of a step, an independent integrator, slopes,
//! observers and Lagrangians.

pub mod draws;
pub mod forces;
pub mod gauss;
pub mod lagrangians;
pub mod observers;
pub mod oracle;

use contact_geom::{DiscretePoint, VelocityPoint, numbers::MaxOrNan};
use discrete_herglotz::State;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

/// The bound on the residuals of sections 2 and 3, relative to the size of the terms: 5e4 eps, which is the product of
/// the condition numbers of W and of F-L_d on the samples (up to 1e3) and the number of operations in a formula.
pub const TOLERANCE: f64 = 1e-11;

/// The number of random points for each system and method.
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

/// Checks that a residual is at most [`TOLERANCE`]; a NaN is not.
pub fn within(residual: f64) -> Result<(), String> {
    bounded(residual, TOLERANCE)
}

/// Checks that a residual is at most a bound; a NaN is not.
pub fn bounded(residual: f64, bound: f64) -> Result<(), String> {
    if residual <= bound { Ok(()) } else { Err(format!("residual {residual:e} above the bound {bound:e}")) }
}

/// The two positions of a step of length `h` around a point of TQ x R.
pub fn around<const N: usize>(x: &VelocityPoint<N>, h: f64) -> DiscretePoint<N> {
    DiscretePoint { q0: x.q - x.v * (0.5 * h), q1: x.q + x.v * (0.5 * h), z0: x.z }
}

/// A step between 0.005 and 0.05 on a logarithmic scale: small enough for the fastest sample of every system, so that
/// F-L_d has one inverse near the motion.
pub fn step_from(u: f64) -> f64 {
    0.005 * 10f64.powf(u)
}

/// The least-squares slope of log error against log step.
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<_> = points.iter().map(|(h, e)| (h.ln(), e.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let covariance: f64 = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    covariance / logs.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}

/// The largest difference of the components of two states, relative to the largest component.
pub fn relative_distance(a: impl Into<State>, b: impl Into<State>) -> f64 {
    let (a, b) = (a.into(), b.into());
    assert_eq!((a.q.len(), a.p.len()), (b.q.len(), b.p.len()), "states of different systems");
    let size = |x: &State| x.q.amax().max_or_nan(x.p.amax()).max_or_nan(x.z.abs());
    let difference = State { q: &a.q - &b.q, p: &a.p - &b.p, z: a.z - b.z };
    size(&difference) / size(&a).max_or_nan(size(&b))
}
