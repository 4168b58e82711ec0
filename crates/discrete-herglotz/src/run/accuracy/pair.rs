//! The numbers of steps of two trial runs of a smooth motion whose distance gives the error of the coarser one.
//!
//! With order 2s a step that is longer by a half has an error that is larger by a factor of a thousand or more: then two runs
//! with numbers of steps in the ratio 2 : 3 tell as much as runs with k and 2k steps, and the finer one, whose error is
//! predicted from their distance, is the run itself or close to it.

use crate::run::accuracy::comparison_grid::ComparisonGrid;
use crate::run::accuracy::limits::{
    ERROR_ORDER_PER_DEFECT_ORDER, MAX_DISTANCE_OF_AGREEING_RUNS, MAX_PREDICTED_ERROR, MAX_PREDICTIVE_DISTANCE,
    MIN_STEPS_OF_RATIO, NEAR_RATIO,
};

/// The number of steps of the first run, as a multiple of the base of the comparison grid; the runs beside it have
/// [`COARSER`] and [`FINER`] times the base.
const FIRST: usize = 6;
const COARSER: usize = 4;
const FINER: usize = 9;

/// The ratio of their numbers of steps.
const RATIO: f64 = 1.5;

/// The part of what a prediction allows at which it aims, since the error is only about the square of the defect.
const MARGIN: f64 = 0.1;

/// How the numbers of steps of a search follow each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pairs {
    /// Whether runs in the ratio 2 : 3 are compared; otherwise those with k and 2k steps.
    close: bool,
    s: f64,
    goal: f64,
}

impl Pairs {
    /// The pairs of a motion, by a method of s stages, for an error. The search starts with k steps.
    pub fn of(smooth: bool, k: usize, stages: usize, goal: f64) -> Self {
        Pairs { close: smooth && k >= MIN_STEPS_OF_RATIO, s: stages as f64, goal }
    }

    /// The error of the first run from which that of the finer one is predicted to be small enough.
    pub fn goal_of_first(smooth: bool, stages: usize, goal: f64) -> f64 {
        if !smooth {
            return goal;
        }
        let gain = RATIO.powf(ERROR_ORDER_PER_DEFECT_ORDER * stages as f64);
        (MAX_PREDICTED_ERROR * goal * gain).min(MARGIN * MAX_PREDICTIVE_DISTANCE).max(goal)
    }

    /// The base of the grid on which a first run with about k steps is compared.
    pub fn base(&self, k: usize) -> usize {
        if self.close { k.div_ceil(FIRST) } else { k }
    }

    /// The number of steps of the first run, if the grid determines it.
    pub fn first(&self, grid: &ComparisonGrid) -> Option<usize> {
        self.close.then(|| FIRST * grid.base())
    }

    /// The number of steps of the second run, with a defect of the first: fewer steps if that is too accurate already.
    pub fn second(&self, grid: &ComparisonGrid, k: usize, defect: f64, may_be_coarser: bool) -> usize {
        if !self.close {
            return 2 * k;
        }
        // The error is about the square of the defect.
        let of_coarser = defect.powi(2) * RATIO.powf(2.0 * self.s);
        let of_first = of_coarser / RATIO.powf(ERROR_ORDER_PER_DEFECT_ORDER * self.s);
        // Both must be such that the runs agree.
        let coarser = of_coarser <= MAX_PREDICTIVE_DISTANCE && of_first <= MARGIN * MAX_PREDICTED_ERROR * self.goal;
        if coarser && may_be_coarser { COARSER * grid.base() } else { FINER * grid.base() }
    }

    /// The number of steps after two runs with k and fewer steps that do not agree; the error of the finer one is
    /// predicted to be `beyond`.
    pub fn next(&self, grid: &ComparisonGrid, k: usize, beyond: f64) -> usize {
        if self.close && k == FIRST * grid.base() {
            return FINER * grid.base();
        }
        let [numerator, denominator] = NEAR_RATIO;
        // The decrease of the error by the order of the method.
        let decrease = (numerator as f64 / denominator as f64).powf(2.0 * self.s);
        let near = beyond <= decrease * MAX_DISTANCE_OF_AGREEING_RUNS * self.goal;
        if self.close && near && (numerator * k).is_multiple_of(denominator * grid.base()) {
            numerator * k / denominator
        } else {
            2 * k
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the number of steps that a search starts with, the runs of a pair differ, and the grid divides them.
    #[test]
    fn runs_of_a_pair_end_steps_at_the_same_times() {
        for (smooth, k, defect) in
            [(true, 24, 1e-3), (true, 100, 1e-3), (true, 100, 1e-7), (true, 23, 1e-7), (false, 100, 1e-7)]
        {
            let pairs = Pairs::of(smooth, k, 8, 1e-9);
            let grid = ComparisonGrid::of(pairs.base(k));
            let first = pairs.first(&grid).unwrap_or_else(|| grid.whole(k as f64));
            assert!((k..k + 6).contains(&first), "{k}: {first}");
            let seconds = [true, false].map(|may_be_coarser| pairs.second(&grid, first, defect, may_be_coarser));
            // A defect of 1e-7 is that of an error of 1e-14, far below the goal, and of 7e-12 for two thirds of the steps.
            let coarser = pairs.close && defect < 1e-4;
            assert!(if coarser { 3 * seconds[0] == 2 * first } else { seconds[0] > first }, "{seconds:?}, {first}");
            assert!(2 * seconds[1] == if pairs.close { 3 } else { 4 } * first, "{seconds:?}, {first}");
            let mut finer = first.max(seconds[0]);
            for beyond in [1e-3, 1e-9, 1e-9, 1e-9, 1e-3] {
                let next = pairs.next(&grid, finer, beyond);
                assert!((finer + 1..=2 * finer).contains(&next) && next.is_multiple_of(grid.base()), "{finer}: {next}");
                finer = next;
            }
        }
    }

    #[test]
    fn the_first_run_may_have_a_larger_error() {
        // 1.5^12 is 130, and 1.5^24 is 17,000.
        assert!((Pairs::goal_of_first(true, 8, 1e-9) / 1.3e-8 - 1.0).abs() < 0.01);
        assert!((Pairs::goal_of_first(true, 16, 1e-9) / 1.68e-6 - 1.0).abs() < 0.01);
        assert_eq!([Pairs::goal_of_first(true, 16, 1e-2), Pairs::goal_of_first(false, 16, 1e-9)], [1e-2, 1e-9]);
    }
}
