//! The defect of a step's collocation polynomial in Herglotz' equations, sampled between the nodes.

use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::numbers::registers::Stages;
use crate::resolution::thresholds::{MIN_EXACT_PRODUCT, VALUE_ROUND_OFF};
use contact_geom::numbers::max_or_nan;

/// The defect of a step at a set of sample points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DefectSample {
    /// The largest defect of the curve, relative to the momenta and actions: of `p' = L_q + L_z p` and `z' = L`, each
    /// times the step size, and of `p = L_v`. Infinite if a value is not finite.
    pub defect: f64,
    /// The absolute defect of momenta and forces alone, and that of the action alone.
    pub of_momenta: f64,
    pub of_action: f64,
    /// The size of the momenta, to which `defect` is relative.
    pub size: f64,
    /// The size of the actions, to which `defect` is relative.
    pub size_z: f64,
    /// An estimate of the defect from the last two Legendre coefficients of the step's polynomials.
    pub expected: f64,
    /// The largest defect of the values of L, beyond their round-off. It detects a jump of L between two points at
    /// which the gradient of the jumping term vanishes.
    pub of_value: f64,
    /// The largest `|p.v| + |z L_z|`, for comparison with `of_value`.
    pub kinetic: f64,
    /// The values of L at the start and at the end of the step's curve.
    pub ends: [f64; 2],
    /// Whether L may jump between the preceding step and this one.
    pub follows_a_jump: bool,
}

impl DefectSample {
    /// Whether the defect may be due to underflow, as where a force grows from zero.
    pub fn is_underflown(&self) -> bool {
        self.defect * self.size < MIN_EXACT_PRODUCT
    }

    /// The jump of the values of L to the next step, beyond their round-off.
    pub fn jump_to(&self, next: &DefectSample) -> f64 {
        let (before, after) = (self.ends[1], next.ends[0]);
        beyond_rounding((after - before).abs(), max_or_nan(before.abs(), after.abs()))
    }

    /// The sample of two consecutive parts of one step, between which L may jump: `self` and then `next`.
    pub fn joined(self, next: DefectSample) -> DefectSample {
        DefectSample {
            defect: max_or_nan(self.defect, next.defect),
            of_momenta: max_or_nan(self.of_momenta, next.of_momenta),
            of_action: max_or_nan(self.of_action, next.of_action),
            size: max_or_nan(self.size, next.size),
            size_z: max_or_nan(self.size_z, next.size_z),
            expected: max_or_nan(self.expected, next.expected),
            of_value: max_or_nan(self.of_value, next.of_value),
            kinetic: max_or_nan(self.kinetic, next.kinetic),
            ends: [self.ends[0], next.ends[1]],
            ..self
        }
    }

    /// The same sample, flagged as following a jump of L.
    pub fn after_a_jump(self) -> DefectSample {
        DefectSample { follows_a_jump: true, ..self }
    }

    /// Combined with a sample at the ends of the same step.
    pub fn with_ends(self, ends: DefectSample) -> DefectSample {
        DefectSample {
            defect: max_or_nan(self.defect, END_WEIGHT * ends.defect),
            of_momenta: max_or_nan(self.of_momenta, END_WEIGHT * ends.of_momenta),
            of_action: max_or_nan(self.of_action, END_WEIGHT * ends.of_action),
            ..self
        }
    }

    /// Combined with a sample at other points of the same step.
    pub fn and(self, other: DefectSample) -> DefectSample {
        DefectSample {
            defect: max_or_nan(self.defect, other.defect),
            of_momenta: max_or_nan(self.of_momenta, other.of_momenta),
            of_action: max_or_nan(self.of_action, other.of_action),
            of_value: max_or_nan(self.of_value, other.of_value),
            ..self
        }
    }
}

/// The part of a defect at the ends of a step that counts as a defect between the nodes. A smooth curve has its largest
/// defect there, some three times as large as between the nodes. Beyond the outermost sample points lies at most a
/// thirtieth of a step of two stages or more, and the momenta change by at most that part of the defect if a kink is
/// there.
pub(crate) const END_WEIGHT: f64 = 1.0 / 30.0;

/// The part of a defect of values of a size that is beyond their round-off.
pub(crate) fn beyond_rounding(defect: f64, size: f64) -> f64 {
    // Written so that a NaN is returned.
    if defect <= VALUE_ROUND_OFF * size { 0.0 } else { defect - VALUE_ROUND_OFF * size }
}

/// The largest number of sets of sample points: their union divides a step of s stages into 16 s parts.
pub(crate) const SAMPLE_SETS: usize = 16;

/// The sum of the sizes of the last two coefficients of values at the stages.
#[inline(always)]
pub(crate) fn tail(g: &Coefficients, y: &Stages) -> f64 {
    let mut sum = 0.0;
    for row in &g.last {
        sum += weighted(row, y).abs();
    }
    sum
}

/// The weighted sum of the stages; the weights after the last stage are 0.
#[inline(always)]
pub(crate) fn weighted(weights: &[f64; MAX_STAGES], y: &Stages) -> f64 {
    let mut sum = 0.0;
    for (weight, y) in weights.iter().zip(&y.0) {
        sum += weight * y;
    }
    sum
}
