//! What a time transformation would save.

use contact_geom::numbers::max_or_nan;

/// The estimate of the steps that a time transformation would save, compared with equal steps.
#[derive(Default)]
pub(crate) struct TransformationGain {
    steps: f64,
    /// The sum of the reciprocal rates, which is the span of tau in units of the step, and the largest of them.
    sum: f64,
    largest: f64,
}

impl TransformationGain {
    /// Adds the rate at the end of the next step; returns by which factor fewer steps of the time transformation cover
    /// the same span, if they are all as short in tau as the shortest of the equal steps.
    pub fn with_step(&mut self, rate: f64) -> f64 {
        let speed = 1.0 / rate;
        (self.steps, self.sum) = (self.steps + 1.0, self.sum + speed);
        self.largest = max_or_nan(self.largest, speed);
        self.largest * self.steps / self.sum
    }
}
