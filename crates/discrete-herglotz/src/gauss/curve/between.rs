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

/// The linear maps from the s stages to s sample points between the nodes.
pub(super) struct Between {
    /// The points, as fractions of the step.
    pub points: Stages,
    /// The maps to the values of the polynomial, and to its integral from 0.
    value: StageMap,
    integral: StageMap,
}

impl Between {
    /// The maps of one set of sample points, for a number of stages from 1 to 16; computed once. The set
    /// [`ENDS`] has points next to the ends of the step.
    pub fn of(s: usize, set: usize) -> &'static Between {
        static TABLES: [[OnceLock<Box<Between>>; SAMPLE_SETS + 1]; MAX_STAGES] =
            [const { [const { OnceLock::new() }; SAMPLE_SETS + 1] }; MAX_STAGES];
        let (s, set) = (s.clamp(1, MAX_STAGES), set.min(ENDS));
        TABLES[s - 1][set].get_or_init(|| Box::new(Self::new(s, set)))
    }

    /// The values of a polynomial at the sample points.
    #[inline(always)]
    pub fn value<S: Simd>(&self, s: usize, y: &Stages, out: &mut Stages) {
        self.value.apply(y, s, out, Lanes::<S>::splat(0.0));
    }

    /// The integral of a polynomial up to the sample points, plus the value at the start of the step.
    #[inline(always)]
    pub fn grown<S: Simd>(&self, s: usize, h: f64, y: &Stages, from: f64, out: &mut Stages) {
        self.integral.apply(y, s, out, Lanes::<S>::splat(0.0));
        for r in 0..blocks::<S>(s) {
            out.set(r, out.block::<S>(r) * h + from);
        }
    }

    fn new(s: usize, set: usize) -> Self {
        let g = Coefficients::of(s);
        const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
        // Set 0: the Gauss points of s - 1 stages, which lie between those of s, and one point near the end of the
        // step, where the defect is largest. The other sets are equidistant, each shifted by the GOLDEN_RATIO ratio, so
        // that the gaps of their union are shortest.
        let inner = Coefficients::of(s.saturating_sub(1).max(1));
        let end = 0.5 * (1.0 + g.c[s - 1].0);
        let points = from_fn(|i| match set {
            0 if i + 1 < s => inner.c[i].0,
            0 => end,
            // A step of one stage has one sample point; the next point is the start of the next step.
            ENDS if i == 0 && s > 1 => END_DISTANCE,
            ENDS => 1.0 - END_DISTANCE,
            _ => (i.min(s - 1) as f64 + (set as f64 * GOLDEN_RATIO).fract()) / s as f64,
        });
        let [value, integral] = lagrange_rows(s, &points);
        Between { points: Stages(points), value: StageMap::new(&value, s), integral: StageMap::new(&integral, s) }
    }
}
