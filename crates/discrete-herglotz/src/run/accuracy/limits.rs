//! The limits of the step-size selection: budgets, numbers of steps and stages, and the safety factors of predictions.
//!
//! The thresholds of unresolved steps are those of [`crate::resolution::thresholds`].

use crate::DividedGauss;

// Budgets, in evaluations of L at one stage.

/// The budget of all trial runs of a plan: some seconds.
pub(crate) const BUDGET: u64 = 1 << 26;

/// The budget of runs that are expected to reach their end, as those of long motions: so the total budget grows with
/// the cost of the run itself.
pub(crate) const RESERVE: u64 = 1 << 29;

/// The budget of the search for the time at which an observer ends the run: about a second.
pub(crate) const EVENT_SEARCH_BUDGET: u64 = 1 << 24;

/// The number of steps between two checks of budget, progress and interrupts, if steps are taken together.
pub(crate) const MAX_UNCHECKED_STEPS: usize = 1024;

/// The number of checks of the budget between two checks for an interrupt, if steps are taken one by one: single steps
/// take little time.
pub(crate) const CHECKS_PER_INTERRUPT_QUERY: usize = 16;

// Numbers of stages.

/// The number of stages of the reference for other methods.
pub(crate) const REFERENCE_STAGES: usize = 12;

/// The number of stages from which on a Gauss method is its own reference: with fewer stages, and so a lower order, a
/// reference with [`REFERENCE_STAGES`] stages costs less than a run with twice as many steps.
pub(crate) const MIN_OWN_REFERENCE_STAGES: usize = 6;

/// The number of stages for short runs, and for Lagrangians whose steps are expensive.
pub(crate) const DEFAULT_STAGES: usize = 8;

/// The number of stages for short runs with a small error, if only the accelerations are iterated: with fewer stages the error
/// would need steps that are far shorter than the iteration does.
pub(crate) const STAGES_OF_SMALL_ERRORS: usize = 12;

/// The largest error for which [`STAGES_OF_SMALL_ERRORS`] cost less than [`DEFAULT_STAGES`] for most motions.
pub(crate) const SMALL_ERROR: f64 = 3e-9;

/// The number of steps with [`DEFAULT_STAGES`] stages, estimated from the motion at its start, from which on the
/// largest number of stages is the least expensive if only the accelerations are iterated: it halves the evaluations
/// for an error, also in the trial runs, but its tables are four times as large.
pub(crate) const MIN_STEPS_FOR_MAX_STAGES: usize = 32;

/// The number of stages in transformed time, for every error: the motion is smooth in this time, and longer steps with
/// more stages would follow it, but their fixed-point iteration would not converge.
pub(crate) const TRANSFORMED_STAGES: usize = 8;

/// The number of stages of divided steps.
pub(crate) const DIVIDED_STAGES: usize = 8;

// The comparison of trial runs.

/// The number of parts of a span at whose ends runs are compared.
pub(crate) const COMPARED_PARTS: usize = 10;

/// The size of a motion, relative to its largest size so far, below which it may consist of the round-off of its
/// forces.
pub(crate) const MAX_DECAYED_SIZE: f64 = 1e-3;

/// The largest number of iterations of a search: each refines the steps or ends the search.
pub(crate) const MAX_ITERATIONS: usize = 64;

/// The number of refinements, of runs with more than [`LONG_SEARCH_STEPS`] steps, after which a step that still fails
/// or is unresolved at the same time ends the search. A narrow feature may need many halvings of the step; at a
/// singularity they never suffice.
pub(crate) const MAX_FAILURES_AT_ONE_TIME: usize = 8;

/// See [`MAX_FAILURES_AT_ONE_TIME`]: shorter runs are refined in any case, since they cost little.
pub(crate) const LONG_SEARCH_STEPS: usize = 512;

/// The distance of two times, relative to the span, up to which they count as the same.
pub(crate) const MAX_DISTANCE_OF_ONE_TIME: f64 = 0.01;

/// The number of refinements after which a narrow feature between the nodes is left to the comparison of runs.
pub(crate) const MAX_NARROW_RUNS: usize = 10;

/// The number of refinements in a row that do not halve the distance of two runs, after which the search ends.
pub(crate) const MAX_STAGNATIONS: usize = 3;

/// The largest distance of the runs with k and 2k steps, in units of the goal, at which both agree: the error of the
/// first is about this distance.
pub(crate) const MAX_DISTANCE_OF_AGREEING_RUNS: f64 = 0.25;

/// The largest distance of two runs from which the error of the finer one is predicted: at larger distances the runs
/// need not approximate the same motion.
pub(crate) const MAX_PREDICTIVE_DISTANCE: f64 = 1e-2;

/// The smallest number of steps from which on runs of a smooth motion with numbers of steps in the ratio 2 : 3 are
/// compared: fewer steps would be compared at too few times.
pub(crate) const MIN_STEPS_OF_RATIO: usize = 24;

/// The ratio of the numbers of steps of two runs if the error that is predicted for the coarser one is close to the goal.
pub(crate) const NEAR_RATIO: [usize; 2] = [4, 3];

/// The largest predicted error of the finer run, and the largest round-off, in units of the goal, at which both runs
/// count as agreeing although their distance is larger: a tenth, since predictions may be wrong by this factor.
pub(crate) const MAX_PREDICTED_ERROR: f64 = 0.1;

/// The round-off of a run with one step, relative to its size: some ten units in the last place, which grow with the
/// square root of the number of steps.
pub(crate) const ROUND_OFF_OF_A_STEP: f64 = 2e-15;

/// The error that the iterations of the steps of a run may add, in units of the goal, if it does not grow along the motion:
/// where it accumulates like the square of the time, it grows by a hundred from the first comparison on.
pub(crate) const OF_ITERATIONS: f64 = 1e-4;

/// The largest error that iterations may have left in a run, in units of the goal, at which its error is predicted.
pub(crate) const MAX_OF_ITERATIONS: f64 = 0.5;

/// The order with which the defect must at least decrease from one run to the next, below the order of every collocation
/// method that is its own reference. At a jump the defect does not decrease.
pub(crate) const MIN_DEFECT_ORDER: f64 = 3.0;

/// A defect below this, in units of the requested error, need not decrease.
pub(crate) const NEGLIGIBLE_DEFECT: f64 = 0.01;

/// A defect below this, in units of the requested error, is no narrow feature, whatever its ratio to the expected one.
pub(crate) const NEGLIGIBLE_SAMPLED_DEFECT: f64 = 0.1;

/// The order of the error in units of the observed order of the defect, for the prediction of the error of the finer
/// run. In theory it is two.
pub(crate) const ERROR_ORDER_PER_DEFECT_ORDER: f64 = 1.5;

/// The same for motions that are known to be smooth: that of the theory.
pub(crate) const ERROR_ORDER_OF_SMOOTH_MOTIONS: f64 = 2.0;

/// The smallest ratio of the numbers of steps of two runs for which [`ERROR_ORDER_OF_SMOOTH_MOTIONS`] is used.
pub(crate) const MIN_ASYMPTOTIC_RATIO: f64 = 1.5;

/// The decrease of the defect, in units of the order, above which it is not due to the order: the finer steps end at a
/// kink.
pub(crate) const MAX_DEFECT_ORDER: f64 = 2.0;

// The prediction of a number of steps from the defect of the first run.

/// The factor by which the predicted number of steps is reduced: the error is only about the square of the defect, and
/// too few steps are refined.
pub(crate) const PREDICTION_REDUCTION: f64 = 1.4;

/// The smallest and the largest factor between the predicted number of steps and that of the first run: below the first
/// the run is not repeated, above the second the defect is too large for a prediction.
pub(crate) const PREDICTION_RANGE: [f64; 2] = [1.2, 4.0];

/// The largest first guess for a number of steps: a stiff start need not be resolved.
pub(crate) const MAX_FIRST_GUESS: usize = 1 << 20;

// Other steps than equal ones.

/// The ratio of the number of equal steps to the number that the motion requires at its start, from which on divided
/// steps are tried: each part costs several times as much as a step.
pub(crate) const MIN_RATIO_FOR_DIVISION: usize = 32;

/// The smallest reduction of the number of steps for which a time transformation is tried: each of its steps costs
/// about as much as this number of equal steps with the same error. For Kepler orbits this holds for eccentricities
/// above one half.
pub(crate) const MIN_TRANSFORMATION_GAIN: f64 = 3.5;

/// The number of steps that may need Newton's method before other stages are tried, in addition to
/// [`MAX_NEWTON_FRACTION`].
pub(crate) const MAX_NEWTON_STEPS: f64 = 2.0;

/// The number of runs of a search that end where many steps need Newton's method: a run with twice as many steps usually
/// costs less, but not where short steps need it too.
pub(crate) const MAX_NEWTON_RUNS: usize = 2;

/// The fraction of all steps that may need Newton's method before other stages are tried. If a coarse run stays below
/// both bounds, a run with twice as many steps rarely needs Newton's method.
pub(crate) const MAX_NEWTON_FRACTION: f64 = 0.25;

/// The smallest and the largest number of steps before division: at least 2000 nodes, between which no wide feature is
/// missed, and as many sample points between them for the defect. Fast parts of the motion are resolved by the
/// division.
pub(crate) const DIVIDED_STEPS: [usize; 2] = [256, 1 << 14];

/// The largest defect of the parts that is tried: larger parts need not resolve the motion.
pub(crate) const MAX_PART_DEFECT: f64 = 0.02;

/// The first bound on the defect of the parts, in units of the square root of the requested error: the error of a part
/// is about the square of its defect.
pub(crate) const PART_DEFECT_PER_ROOT: f64 = 0.3;

/// The largest number of iterations of the search for divided steps, each with a finer division.
pub(crate) const MAX_DIVISIONS: usize = 8;

/// The largest distance of two divisions, in units of the requested error: the error of the finer run is smaller than
/// their distance.
pub(crate) const MAX_DISTANCE_OF_DIVISIONS: f64 = 0.5;

// The selection of a number of Gauss steps from two converged runs, in units of the requested error.

/// The largest error of a run whose steps are selected: the errors of neighbouring numbers of steps differ.
pub(crate) const TARGET_ERROR: f64 = 0.2;

/// The error at which predictions between and beyond the runs aim: a tenth of [`TARGET_ERROR`], since the errors of
/// neighbouring numbers of steps may differ by this factor.
pub(crate) const PREDICTED_ERROR: f64 = 0.02;

/// The smallest error from which a number of steps is predicted: smaller ones are round-off.
pub(crate) const MIN_PREDICTIVE_ERROR: f64 = 1e-14;

/// The smallest fraction of the steps of a converged run that is selected: the error of longer steps grows faster than
/// their order.
pub(crate) const MIN_STEP_FRACTION: f64 = 0.6;

/// The order with which the error of longer steps is assumed to grow, in units of the number of stages. In theory it is
/// two.
pub(crate) const ERROR_ORDER_OF_LONGER_STEPS: f64 = 2.5;

/// The largest predicted defect of longer steps: they still resolve the motion.
pub(crate) const MAX_DEFECT_OF_LONGER_STEPS: f64 = 1e-2;

/// The largest ratio of the number of stages to the observed order of the defect for a smooth motion: above it the
/// order is not used for predictions.
pub(crate) const MAX_STAGES_PER_ORDER: f64 = 3.0;

// The selection of a number of steps by comparison with a reference.

/// The error of the reference in units of the requested error.
pub(crate) const REFERENCE_ERROR: f64 = 1.0 / 8.0;

/// The largest distance from the reference, in units of the requested error, of steps that are selected: it includes
/// the error of the reference.
pub(crate) const MAX_DISTANCE_FROM_REFERENCE: f64 = 0.7;

/// The distance from the reference, in units of the requested error, at which predictions aim.
pub(crate) const PREDICTED_DISTANCE_FROM_REFERENCE: f64 = 0.5;

/// The distance from the reference, in units of the requested error, below which fewer steps are tried.
pub(crate) const MIN_DISTANCE_FROM_REFERENCE: f64 = 0.2;

/// The smallest and the largest fraction of the steps that is tried if fewer are expected to suffice.
pub(crate) const FEWER_STEPS: [f64; 2] = [1.0 / 16.0, 0.8];

/// The smallest and the largest factor by which the number of steps grows from one run to the next.
pub(crate) const MORE_STEPS: [f64; 2] = [1.2, 32.0];

/// The margin of a predicted number of steps.
pub(crate) const PREDICTION_MARGIN: f64 = 1.05;

/// The factor for steps that fail or whose error is not finite.
pub(crate) const FACTOR_AFTER_FAILURE: f64 = 2.0;

/// The ratio of two errors above which refining the steps has had no effect.
pub(crate) const MAX_STAGNATING_RATIO: f64 = 0.7;

/// The number of refinements in a row without effect after which the search ends.
pub(crate) const MAX_STAGNATIONS_FROM_REFERENCE: usize = 4;

/// The error that the distances of runs predict for a change of the last digit of the start, in units of the requested
/// error, from which it is measured: that of single coordinates is not seen.
pub(crate) const MIN_MEASURED_ERROR: f64 = 0.01;

/// The largest growth of distances, beyond the square of the time, that is none: of a regular motion.
pub(crate) const MAX_REGULAR_GROWTH: f64 = 100.0;

/// The growth that distances may have beside the one that is seen: ten before the first comparison, and a hundred by which
/// the square of the time hides it.
pub(crate) const UNSEEN_GROWTH: f64 = 1e3;

// The cause for which runs do not agree.

/// Runs that differ only by round-off show an order below this: that of the lowest collocation method.
pub(crate) const MIN_ORDER_ABOVE_ROUND_OFF: f64 = 2.0;

/// The smallest distance of two runs at the end, absolutely and in units of their distance at the first comparison,
/// that is due to chaos: round-off alone does not grow so fast in a regular motion.
pub(crate) const MIN_CHAOTIC_DISTANCE: f64 = 1e-8;

/// See [`MIN_CHAOTIC_DISTANCE`].
pub(crate) const MIN_CHAOTIC_GROWTH: f64 = 1e4;

/// A distance of two runs below this is round-off, if it does not decrease with their step size.
pub(crate) const MAX_ROUND_OFF: f64 = 1e-9;

/// A distance of two runs below this is round-off in any case.
pub(crate) const CERTAIN_ROUND_OFF: f64 = 64.0 * f64::EPSILON;

// Searches for the end of the motion.

/// The integrator of the search for the time at which an observer ends the run: steps that resolve the motion, with an
/// error of about the square of this defect.
pub(crate) const EVENT_SEARCH: DividedGauss = DividedGauss { stages: 8, max_defect: 1e-5 };

/// The smallest number of steps of that search.
pub(crate) const MIN_EVENT_SEARCH_STEPS: usize = 64;

/// The error of the linearised motion at the start that determines the number of steps of that search.
pub(crate) const EVENT_SEARCH_ERROR: f64 = 1e-6;

/// The decrease of the logarithm of the conformal factor that is at least required before a motion is at rest: the
/// logarithm of the amplitude of oscillations decreases by half of it, from one to about 1e-217.
pub(crate) const MIN_DECAY_TO_REST: f64 = 1000.0;

/// The largest number of steps of the search for the time of rest: some seconds.
pub(crate) const MAX_REST_SEARCH_STEPS: usize = 1 << 20;

/// The number of steps between two checks whether the motion is at rest.
pub(crate) const STEPS_BETWEEN_REST_CHECKS: usize = 64;

/// The error of the linearised motion at the start that determines the step size of that search: only the time of rest
/// is needed.
pub(crate) const REST_SEARCH_ERROR: f64 = 1e-3;
