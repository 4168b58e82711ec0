//! Random numbers for the tests of motions.

/// Numbers between 0 and 1, the same in each run of the test.
pub struct Draws(u64);

impl Draws {
    /// The numbers of a case.
    pub fn of(case: u64) -> Self {
        let mut draws = Draws(case.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        draws.next();
        draws
    }

    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.next() * (high - low)
    }
}
