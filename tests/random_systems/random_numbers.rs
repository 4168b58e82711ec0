//! Random numbers that the number of a case determines.

use proptest::prelude::RngExt;
use proptest::test_runner::{RngAlgorithm, TestRng};

/// A stream of random numbers.
pub struct RandomNumbers(TestRng);

impl RandomNumbers {
    /// The stream of a case; different cases have different streams.
    pub fn of(case: u64) -> Self {
        let mut seed = *b"contact mechanics, a random case";
        seed[..8].copy_from_slice(&case.to_le_bytes());
        RandomNumbers(TestRng::from_seed(RngAlgorithm::ChaCha, &seed))
    }

    /// A number in an interval.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..=high)
    }

    /// A positive number with a uniform logarithm.
    pub fn scale(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// An integer from 0 to n - 1.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.random_range(0..n)
    }

    /// One of some values.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// True with a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random_bool(probability)
    }
}
