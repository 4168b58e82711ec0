//! The defect samples along a trial run.

use crate::gauss::DefectSample;
use crate::resolution::thresholds::{DEFECT_ROUND_OFF, MAX_TRIAL_DEFECT, MAX_TRIAL_VALUE_DEFECT, MIN_EXACT_PRODUCT};
use contact_geom::numbers::max_or_nan;

/// A defect relative to a size; unchanged if the size is 0.
fn relative_to(defect: f64, size: f64) -> f64 {
    if defect == 0.0 || size == 0.0 { defect } else { defect / size }
}

/// The defect samples of a run so far.
#[derive(Default)]
pub(crate) struct DefectHistory {
    before: Option<DefectSample>,
    /// The largest momentum, and the largest quantity to which defects of the values of L are relative.
    size: f64,
    kinetic: f64,
    /// The largest absolute defects of the momenta and of the values of L. They are compared with the largest sizes
    /// along the whole run: in a motion that comes to rest only round-off is left, and a motion that starts at rest
    /// reaches its size later.
    of_momentum: f64,
    of_value: f64,
}

impl DefectHistory {
    /// Adds the defect sample of the next step; returns whether the step resolves the motion.
    pub fn resolves(&mut self, sample: &DefectSample) -> bool {
        let before = self.before.replace(*sample).filter(|_| !sample.follows_a_jump);
        let jump = before.map_or(0.0, |before| before.jump_to(sample));
        (self.size, self.kinetic) = (max_or_nan(self.size, sample.size), max_or_nan(self.kinetic, sample.kinetic));
        let of_value = max_or_nan(sample.of_value, jump);
        // A motion at rest crosses no jump, and values of L that have underflowed carry no information.
        let is_known = of_value != 0.0 && (self.kinetic >= MIN_EXACT_PRODUCT || self.kinetic.is_nan());
        let of_value = if is_known { of_value } else { 0.0 };
        let of_momentum = sample.defect * if sample.size > 0.0 { sample.size } else { 1.0 };
        self.of_momentum = max_or_nan(self.of_momentum, of_momentum);
        self.of_value = max_or_nan(self.of_value, of_value);
        // Written so that a NaN counts as unresolved.
        (sample.defect <= MAX_TRIAL_DEFECT || of_momentum <= DEFECT_ROUND_OFF * self.size || sample.is_underflown())
            && relative_to(of_value, self.kinetic) <= MAX_TRIAL_VALUE_DEFECT
    }

    /// The largest defect, relative to the largest momentum and to the size for defects of values.
    pub fn defect(&self) -> f64 {
        max_or_nan(relative_to(self.of_momentum, self.size), relative_to(self.of_value, self.kinetic))
    }
}
