//! Random numbers that depend only on a seed and an index: the same in every run, on every machine, in any order of
//! evaluation.

/// A stream of random numbers for one problem of one case, by the counter-based generator SplitMix64 (Steele, Lea and
/// Flood, OOPSLA 2014).
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

/// The fractional part of the golden ratio as an odd integer: the increment of the generator.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

fn mixed(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Random {
    /// The stream of the problem with an index, in the case with a seed.
    pub fn new(seed: u64, index: usize) -> Self {
        Random { state: mixed(seed.wrapping_mul(STEP) ^ mixed(index as u64 + 1)) }
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(STEP);
        mixed(self.state)
    }

    /// A number in `[0, 1)`.
    pub fn fraction(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (0.5 * f64::EPSILON)
    }

    /// A uniformly distributed number between two bounds.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.fraction()
    }

    /// A number between two positive bounds whose logarithm is uniformly distributed.
    pub fn spread(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// An integer below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.fraction() * count as f64) as usize
    }

    /// True with the given probability.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.fraction() < probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_even_and_differ() {
        let mean: f64 = (0..4096).map(|i| Random::new(7, i).fraction()).sum::<f64>() / 4096.0;
        // The standard deviation of the mean of n uniform numbers is 1 / sqrt(12 n) = 0.0045.
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
        let mut one = Random::new(7, 1);
        let mean: f64 = (0..4096).map(|_| one.fraction()).sum::<f64>() / 4096.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
        assert_ne!(Random::new(7, 1).next(), Random::new(8, 1).next());
    }
}
