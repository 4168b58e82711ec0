//! The maps between the stages of a step, for its tangent and for the tangent of the step backward.

use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::registers::{StageMap, Stages};
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
    /// The extrapolation from the stages of one step to those of the next one in this direction.
    pub extrapolation: StageMap,
}

impl StepMaps {
    pub fn new(s: usize, h: f64, direction: Direction) -> Self {
        let g = Coefficients::of(s);
        let inside = |i: usize, j: usize, entry: &dyn Fn(usize, usize) -> f64| if i.max(j) < s { entry(i, j) } else { 0.0 };
        let map = |entry: &dyn Fn(usize, usize) -> f64| {
            StageMap::new(&from_fn(|i| from_fn(|j| inside(i, j, entry))), s)
        };
        match direction {
            Direction::Forward => StepMaps {
                s,
                h,
                to_stages: map(&|i, j| h * g.a[i][j].0),
                weights: Stages(from_fn(|j| if j < s { h * g.b[j].0 } else { 0.0 })),
                extrapolation: map(&|i, j| g.extrapolation[i][j]),
            },
            Direction::Backward => StepMaps {
                s,
                h: -h,
                // By symmetry of the nodes `b_j - a_ij` is an entry of A, which has no cancellation.
                to_stages: map(&|i, j| -h * g.a[s - 1 - i][s - 1 - j].0),
                weights: Stages(from_fn(|j| if j < s { -h * g.b[j].0 } else { 0.0 })),
                extrapolation: map(&|i, j| g.extrapolation[s - 1 - i][s - 1 - j]),
            },
        }
    }

    /// The values at the stages of the next step of the polynomial through those of this one.
    #[inline(always)]
    pub fn extrapolated(&self, x: &Stages) -> Stages {
        let mut next = Stages::ZERO;
        for (column, x) in self.extrapolation.0.iter().zip(&x.0).take(self.s) {
            for (next, entry) in next.0.iter_mut().zip(&column.0) {
                *next += entry * x;
            }
        }
        next
    }
}
