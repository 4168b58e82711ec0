//! The sample points of a step, between its nodes.

use crate::gauss::curve::ENDS;
use crate::gauss::resolution::defect_sample::SAMPLE_SETS;
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES, lagrange_rows};
use crate::numbers::array::from_fn;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages, blocks};
use pulp::Simd;
use std::sync::OnceLock;

/// The distance of the sample points of [`ENDS`] from the ends, as a fraction of the step: at a kink on which a step ends
/// the gradient need not exist.
const END_DISTANCE: f64 = 1.0 / (1u64 << 30) as f64;

/// Sets of sample points that are evaluated at once, each with as many points as the step has stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PointSets {
    One(usize),
    /// A set with an odd number, and the next one, of a step with at most [`MAX_STAGES_OF_TWO`] stages.
    Two(usize),
}

/// The largest number of stages of a step of which two sets of points fill the registers.
pub(super) const MAX_STAGES_OF_TWO: usize = MAX_STAGES / 2;

/// The linear maps from the s stages to sample points between the nodes.
pub(super) struct Between {
    /// The number of points.
    pub count: usize,
    /// The points, as fractions of the step.
    pub points: Stages,
    /// The maps to the values of the polynomial, and to its integral from 0.
    value: StageMap,
    integral: StageMap,
}

impl Between {
    /// The maps of sets of sample points, for a number of stages from 1 to 16; computed once. The set [`ENDS`] has points
    /// next to the ends of the step.
    pub fn of(s: usize, sets: PointSets) -> &'static Between {
        const TABLES_OF_TWO: usize = SAMPLE_SETS / 2;
        static TABLES: [[OnceLock<Box<Between>>; SAMPLE_SETS + 1 + TABLES_OF_TWO]; MAX_STAGES] =
            [const { [const { OnceLock::new() }; SAMPLE_SETS + 1 + TABLES_OF_TWO] }; MAX_STAGES];
        let s = s.clamp(1, MAX_STAGES);
        let table = match sets {
            PointSets::One(set) => set.min(ENDS),
            PointSets::Two(set) => ENDS + 1 + (set / 2).min(TABLES_OF_TWO - 1),
        };
        TABLES[s - 1][table].get_or_init(|| Box::new(Self::new(s, sets)))
    }

    /// The values of a polynomial at the sample points.
    #[inline(always)]
    pub fn value<S: Simd>(&self, s: usize, y: &Stages, out: &mut Stages) {
        self.value.apply_rows(y, s, self.count, out, Lanes::<S>::splat(0.0));
    }

    /// The integral of a polynomial up to the sample points, plus the value at the start of the step.
    #[inline(always)]
    pub fn grown<S: Simd>(&self, s: usize, h: f64, y: &Stages, from: f64, out: &mut Stages) {
        self.integral.apply_rows(y, s, self.count, out, Lanes::<S>::splat(0.0));
        for r in 0..blocks::<S>(self.count) {
            out.set(r, out.block::<S>(r) * h + from);
        }
    }

    fn new(s: usize, sets: PointSets) -> Self {
        let g = Coefficients::of(s);
        const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
        // Set 0: the Gauss points of s - 1 stages, which lie between those of s, and one point near the end of the
        // step, where the defect is largest. The other sets are equidistant, each shifted by the GOLDEN_RATIO ratio, so
        // that the gaps of their union are shortest.
        let inner = Coefficients::of(s.saturating_sub(1).max(1));
        let end = 0.5 * (1.0 + g.c[s - 1].0);
        let point = |set: usize, i: usize| match set {
            0 if i + 1 < s => inner.c[i].0,
            0 => end,
            // A step of one stage has one sample point; the next point is the start of the next step.
            ENDS if i == 0 && s > 1 => END_DISTANCE,
            ENDS => 1.0 - END_DISTANCE,
            _ => (i.min(s - 1) as f64 + (set as f64 * GOLDEN_RATIO).fract()) / s as f64,
        };
        let (count, points) = match sets {
            PointSets::One(set) => (s, from_fn(|i| point(set, i))),
            PointSets::Two(set) => (2 * s, from_fn(|i| if i < s { point(set, i) } else { point(set + 1, i - s) })),
        };
        let [value, integral] = lagrange_rows(s, &points);
        let [value, integral] = [value, integral].map(|rows| StageMap::new(&rows, count));
        Between { count, points: Stages(points), value, integral }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Scalar, Simd};

    /// Two sets at once are one after the other: their points, and the values and integrals of a polynomial, bitwise.
    #[test]
    fn two_sets_are_one_after_the_other() {
        fn values<S: Simd>(_: S, between: &Between, s: usize) -> [Stages; 3] {
            let y = Stages(from_fn(|i| if i < s { 1.0 / (i as f64 + 0.7) } else { 0.0 }));
            let (mut value, mut grown) = (Stages::ZERO, Stages::ZERO);
            between.value::<S>(s, &y, &mut value);
            between.grown::<S>(s, 0.3, &y, 0.1, &mut grown);
            [between.points, value, grown]
        }
        for s in 1..=MAX_STAGES_OF_TWO {
            for set in (1..SAMPLE_SETS - 1).step_by(2) {
                let of = |sets| values(Scalar::new(), Between::of(s, sets), s);
                let [first, second, both] = [PointSets::One(set), PointSets::One(set + 1), PointSets::Two(set)].map(of);
                for ((first, second), both) in first.iter().zip(&second).zip(&both) {
                    assert_eq!([&first.0[..s], &second.0[..s]].concat(), both.0[..2 * s], "{s}, {set}");
                }
            }
        }
    }
}
