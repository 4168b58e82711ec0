//! The thresholds of the measures that are listed in [`crate::resolution`].
//!
//! Most thresholds are relative errors of a step, from 0.05 to 0.5, far above the errors of steps that resolve their
//! motion: a flagged step is certainly wrong, whereas a step that is not flagged need not be accurate.
//! The others are bounds on round-off, in units of the round-off of the terms from which a defect is computed.

// Second differences of the velocity.

/// The smallest second difference of the velocity that makes an interval suspect, in units of the velocity. A smooth
/// oscillation reaches it with 28 steps per period.
pub(crate) const MIN_SUSPECT_DIFFERENCE: f64 = 0.05;

/// The ratio of the second difference of a suspect interval to that of the suspect interval before it. A factor of two
/// bounds their number by the binary exponents that the differences can have.
pub(crate) const MIN_SUSPECT_GROWTH: f64 = 2.0;

/// The relative change of position that two second differences cause at least if they count. Less is the round-off of
/// velocities in a motion that has come to rest, or the error of the substeps of a long scheme where velocity and force
/// vanish together. Differences of velocities in half steps are bounded in the same way.
pub(crate) const MIN_RELATIVE_DISPLACEMENT: f64 = 1.0 / 256.0;

/// A change of position below this fraction of the position is round-off: half a million units in the last place, for
/// the round-off that a run accumulates.
pub(crate) const POSITION_ROUND_OFF: f64 = 1e-10;

/// The largest factor by which a step with a rational conformal factor may expand or contract. The factor
/// `(1 + x)/(1 - x)` reaches it at `x = 1/2`, where its error relative to the exponential is about a tenth.
pub(crate) const MAX_RATIONAL_FACTOR: f64 = 3.0;

// Half steps, and methods of order one.

/// The largest difference between a step and two half steps, relative to the motion. The error of a step of order p is
/// then this number divided by `1 - 2^-p`, at most a tenth.
pub(crate) const MAX_HALF_STEP_DIFFERENCE: f64 = 0.05;

/// The number of steps from rest after which a method of order one is judged: after n steps its relative error is
/// `1/n`, in the displacement and in the energy, also where the steps resolve the motion.
pub(crate) const FIRST_ORDER_STEPS: f64 = 16.0;

// Jumps of the acceleration.

/// The largest change of velocity by a jump of the acceleration over one step, relative to the velocity: a tenth. A
/// step has this error if it takes the acceleration of the wrong side of the jump throughout.
pub(crate) const MAX_ACCELERATION_JUMP: f64 = 0.1;

// Gauss collocation: stages and defect samples.

/// The number of stages up to which the stage values of a step do not show whether it resolves the motion: the last
/// coefficient of a polynomial of degree zero or one is not small in a step that resolves it.
pub(crate) const FEW_STAGES: usize = 2;

/// The largest error of `ln sigma_d` in a step of Gauss collocation: a tenth. The method with one stage reaches it at
/// `gamma h = 1`, where the factor changes by e.
pub(crate) const MAX_LOG_FACTOR_ERROR: f64 = 0.1;

/// The largest last Legendre coefficient of the stages, in units of the largest stage: one half. A harmonic motion
/// reaches it with three to four stages per period.
pub(crate) const MAX_LAST_COEFFICIENT: f64 = 0.5;

/// The displacement by the last coefficient, relative to the positions, below which the stages are taken for round-off:
/// half of the digits.
pub(crate) const STAGE_ROUND_OFF: f64 = 1e-8;

/// The change of the first iteration, relative to the stages, above which the last coefficient is checked. A step that
/// the polynomial of the last step predicts to a tenth is resolved.
pub(crate) const MIN_CHECKED_CHANGE: f64 = 0.1;

/// The largest defect between the nodes of a step with more than [`FEW_STAGES`] stages: for harmonic motions the error
/// of such a step is then 0.01 to 0.1.
pub(crate) const MAX_STEP_DEFECT: f64 = 0.1;

/// The same for at most [`FEW_STAGES`] stages, for which the defect between the nodes is large even in resolved steps.
pub(crate) const MAX_STEP_DEFECT_OF_FEW_STAGES: f64 = 1.0;

/// The round-off of a defect, or of a converged iteration, in units of the round-off of one force or momentum: for
/// sixteen stages and the weights of an interpolation between them.
pub(crate) const COLLOCATION_ROUNDINGS: f64 = 256.0;

/// The relative round-off of a value of L: some hundred units, for the sums that it consists of.
pub(crate) const VALUE_ROUND_OFF: f64 = 256.0 * f64::EPSILON;

/// Products of two numbers below this may have lost digits by underflow.
pub(crate) const MIN_EXACT_PRODUCT: f64 = f64::MIN_POSITIVE / f64::EPSILON;

// Trial runs.

/// The largest defect between the nodes of a step of a trial run: its momenta would have an error of a twentieth. It is
/// half of [`MAX_STEP_DEFECT`], since a trial run that ends here costs little, and the next one has shorter steps.
pub(crate) const MAX_TRIAL_DEFECT: f64 = 0.05;

/// The same for the values of L, whose polynomials have to approximate twice the frequencies.
pub(crate) const MAX_TRIAL_VALUE_DEFECT: f64 = 0.2;

/// The largest ratio of the defect to the defect that the last coefficients predict: smooth motions stay below it, and
/// above it a narrow feature lies between the nodes.
pub(crate) const MAX_DEFECT_RATIO: f64 = 30.0;

/// The smallest number of sample points over the span of a trial run: features wider than their distance are detected. The
/// two trial runs of a smooth motion, which have other points, share them.
pub(crate) const MIN_SAMPLE_POINTS: usize = 2000;

/// Defects below this, relative to the momenta, are not distinguished from round-off where defects of two runs or of
/// two estimates are compared: some ten thousand units in the last place.
pub(crate) const MIN_COMPARED_DEFECT: f64 = 1e-11;

/// A defect below this, in units of the largest momentum of the run, is round-off: some hundred units, for the sums in
/// the forces.
pub(crate) const DEFECT_ROUND_OFF: f64 = 1e-13;

/// The round-off of a defect of a trial run, in units of the round-off of a force.
pub(crate) const TRIAL_ROUNDINGS: f64 = 64.0;

// Energy drift.

/// The step of an oscillation, in radians, whose energy error is allowed: the p-th power of this number, for a method
/// of order p. With such an error a frequency has a relative error of the same size.
pub(crate) const MAX_OSCILLATION_STEP: f64 = 0.5;

/// The drift that is allowed for every order, relative to the kinetic energy: with it the phase is lost in about ten
/// periods.
pub(crate) const MIN_ALLOWED_DRIFT: f64 = 0.01;

/// The number of energy roundings that a run without steps may have; the round-off of each step is added to it.
pub(crate) const ENERGY_ROUNDINGS: f64 = 64.0;

/// The part of the allowed drift above which the two ends of a run indicate a drift. By chance, an oscillating drift
/// that a run would flag is smaller than this at the end in about one of twenty members.
pub(crate) const MIN_SUSPECT_DRIFT: f64 = 0.05;

// Claims of structure.

/// The displacement since the last check, relative to the extent of the motion in the same coordinate or momentum, from
/// which on the claims are checked again: an eighth, which is then about the distance of two checks.
pub(crate) const MIN_CLAIM_DISPLACEMENT: f64 = 0.125;

/// The largest relative difference of a quantity that counts as constant: round-off reaches it only if ten digits are
/// lost.
pub(crate) const MAX_CONSTANT_DIFFERENCE: f64 = 1e-6;

/// The same bound in units of the estimated round-off, which both must exceed: a margin, since the estimate is that of
/// one evaluation and does not contain the round-off of the state.
pub(crate) const CLAIM_ROUNDINGS: f64 = 1e4;

// Rest.

/// Positions and momenta below this are at rest. Numbers smaller than it by some ten powers of ten lose digits in
/// products, so that an error relative to the motion is no longer defined.
pub(crate) const MAX_SIZE_AT_REST: f64 = 1e-280;

/// The largest rate of the action at rest, in units of its round-off: for the sums that L consists of.
pub(crate) const REST_ROUNDINGS: f64 = 256.0;

// Members of an ensemble in SIMD lanes: bounds on fewer measures, which are therefore stricter.

/// [`MAX_LAST_COEFFICIENT`] in lanes. A single run also samples the defect between the nodes of its last step, which
/// this bound covers.
pub(crate) const MAX_LAST_COEFFICIENT_IN_LANES: f64 = 0.1;

/// For Gauss collocation with few stages in lanes, the largest change of the acceleration from step to step, times the
/// step size, relative to the velocity. A single run flags two consecutive changes as unresolved if their sum exceeds
/// one; in general the two are not equal.
pub(crate) const MAX_TURN_IN_LANES: f64 = 0.4;

/// For splittings in lanes, the fraction of the bound on the longest drift above which a step is suspect: a margin for
/// motions that do not turn uniformly.
pub(crate) const DRIFT_MARGIN_IN_LANES: f64 = 0.8;

// Paths of a boundary-value problem.

/// The largest error estimate of a resolved path, relative to its range: a quarter. At a conjugate point the estimate
/// is of order one.
pub(crate) const MAX_PATH_ERROR: f64 = 0.25;
