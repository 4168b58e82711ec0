//! The maps between the stages of a step, for its tangent and for the tangent of the step backward.

use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages};
use crate::solve::inverse::inverse;
use contact_geom::nalgebra::DMatrix;
use pulp::Simd;
use std::array::from_fn;

/// The direction in which a linear system is integrated over a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    /// From the start to the end: the tangent of the step.
    Forward,
    /// From the end to the start, at the same stages: the tangent of the step backward, which is its adjoint.
    Backward,
}

/// The coefficients of a step of length h in one direction: stage values are `start + rates`, with the matrix `h a_ij`
/// forward and `-h (b_j - a_ij)` backward, and the end is `start + weights . rates`.
pub(crate) struct StepMaps {
    pub s: usize,
    /// The signed length: negative backward for h > 0.
    pub h: f64,
    pub to_stages: StageMap,
    pub weights: Stages,
    /// The times of the stages from the start of the step, forward.
    pub times: Stages,
    /// The extrapolation from the stages of one step to those of the next one in this direction.
    pub extrapolation: StageMap,
}

impl StepMaps {
    pub fn new(s: usize, h: f64, direction: Direction) -> Self {
        let g = Coefficients::of(s);
        let inside =
            |i: usize, j: usize, entry: &dyn Fn(usize, usize) -> f64| if i.max(j) < s { entry(i, j) } else { 0.0 };
        let times = Stages(from_fn(|i| h * g.c[i.min(s - 1)].0));
        let map =
            |entry: &dyn Fn(usize, usize) -> f64| StageMap::new(&from_fn(|i| from_fn(|j| inside(i, j, entry))), s);
        match direction {
            Direction::Forward => StepMaps {
                s,
                h,
                times,
                to_stages: map(&|i, j| h * g.a[i][j].0),
                weights: Stages(from_fn(|j| if j < s { h * g.b[j].0 } else { 0.0 })),
                extrapolation: map(&|i, j| g.extrapolation[i][j]),
            },
            Direction::Backward => StepMaps {
                s,
                h: -h,
                times,
                // By symmetry of the nodes `b_j - a_ij` is an entry of A, which has no cancellation.
                to_stages: map(&|i, j| -h * g.a[s - 1 - i][s - 1 - j].0),
                weights: Stages(from_fn(|j| if j < s { -h * g.b[j].0 } else { 0.0 })),
                extrapolation: map(&|i, j| g.extrapolation[s - 1 - i][s - 1 - j]),
            },
        }
    }

    /// The values at the stages of the next step of the polynomial through those of this one.
    #[inline(always)]
    pub fn extrapolated<S: Simd>(&self, x: &Stages) -> Stages {
        let mut next = Stages::ZERO;
        self.extrapolation.apply::<S>(x, self.s, &mut next, Lanes::<S>::splat(0.0));
        next
    }

    /// The map from `x` to the solution y of `y + factor A y = x`, for the matrix A of the maps to the stages.
    pub fn resolvent(&self, factor: f64) -> Option<StageMap> {
        let s = self.s;
        let entry = |i: usize, j: usize| f64::from(u8::from(i == j)) + factor * self.to_stages.0[j].0[i];
        let inverse = inverse(&DMatrix::from_fn(s, s, entry))?;
        Some(StageMap::new(&from_fn(|i| from_fn(|j| if i.max(j) < s { inverse[(i, j)] } else { 0.0 })), s))
    }

    /// The matrix `A D A`, for the diagonal matrix D of the inverses of these numbers.
    pub fn twice(&self, divided_by: &Stages) -> StageMap {
        let (s, a) = (self.s, |i: usize, j: usize| self.to_stages.0[j].0[i]);
        let entry = |i: usize, j: usize| (0..s).map(|k| a(i, k) / divided_by.0[k] * a(k, j)).sum();
        StageMap::new(&from_fn(|i| from_fn(|j| if i.max(j) < s { entry(i, j) } else { 0.0 })), s)
    }
}
