//! The numbers by which contact Gauss collocation selects a method of solution and ends an iteration.

/// The largest dimension for which a linear motion is advanced by one precomputed matrix: in more coordinates the
/// matrix costs more than the iterations that it saves, and does not fit on the stack.
pub(crate) const MAX_LINEAR_DIMENSION: usize = 32;

/// The largest dimension for which W is inverted at several stages at once, in SIMD lanes; the matrices are on the
/// stack.
pub(crate) const MAX_DIMENSION_IN_LANES: usize = 8;

// Fixed-point iteration.

/// The number of iterations after which a fixed-point iteration counts as not converging: a contraction by one half
/// reaches round-off in 53.
pub(crate) const MAX_ITERATIONS: u32 = 60;

/// The number of times that a change may exceed the one before it: the first iterations of a convergent iteration are
/// not monotone.
pub(crate) const MAX_INCREASES: u32 = 3;

/// A change of at most this many units of round-off may be round-off, if it no longer decreases: rounded forces are
/// multiplied by the step.
pub(crate) const ROUND_OFF_CHANGE: f64 = 256.0;

/// The largest contraction factor for which a secant step is taken: for slower iterations the last two values of a force
/// lie on different parts of its curve.
pub(crate) const MAX_SECANT_RATIO: f64 = 0.5;

/// The largest relative change for which the last two values of a force determine its slope.
pub(crate) const MAX_SECANT_CHANGE: f64 = 0.1;

// The predictor of the condensed step.

/// The extrapolated predictor is dropped if its first change exceeds the part of the force that is outside the linear
/// force by this factor. Its error is rough, and the first iterations remove it, whereas the error of a motion by the
/// linear force alone is smooth and decreases more slowly.
pub(crate) const MAX_PREDICTOR_ERROR: f64 = 16.0;

/// The number of steps after which a dropped predictor is tried again: the trial costs an iteration, a thirtieth of the
/// work of these steps.
pub(crate) const PREDICTOR_PAUSE: u32 = 31;

// The matrices of the condensed step.

/// The largest relative change of an iteration after which its values are accurate enough for the terms with the tails
/// of the matrices.
pub(crate) const MAX_CHANGE_FOR_TAILS: f64 = 1e-3;

/// The tails of the matrices are applied in one of this many steps, with a weight of this number: their accumulated
/// effect is the same at a fraction of the cost. The number is odd, so that all phases are met if the period of the
/// motion is a power of two of steps.
pub(crate) const TAIL_PERIOD: usize = 7;

/// The number of steps after which the matrix of the iteration is expected to be kept for long.
pub(crate) const LONG_RUN: usize = 64;

/// The smallest pivot of `1 + kappa B` for which kappa is used: a smaller one loses three digits.
pub(crate) const MIN_PIVOT: f64 = 1e-3;

// Newton methods.

/// The number of steps by a Newton method after which a less expensive iteration is tried again for the first time.
pub(crate) const FIRST_NEWTON_PAUSE: usize = 8;

/// The number of simplified Newton iterations above which the Jacobian is recomputed: three times the usual number.
pub(crate) const SLOW_NEWTON: u32 = 18;

/// The smallest number of steps for which a Jacobian is kept, unless a step fails: second derivatives by dual numbers
/// cost as much as ten steps.
pub(crate) const MIN_JACOBIAN_AGE: u32 = 16;

/// The largest number of damped Newton iterations of a step: three times the number for forces that grow like a third
/// power.
pub(crate) const MAX_NEWTON_ITERATIONS: u32 = 24;

/// The damping factor that is tried if the full correction fails the test. Smaller factors find few further solutions,
/// and each of them costs an evaluation.
pub(crate) const DAMPING_FACTOR: f64 = 0.3;

/// The relative decrease of the next correction that the test requires of a full correction; for a damped one it is
/// multiplied by the damping factor.
pub(crate) const MIN_DECREASE: f64 = 0.25;

/// The ratio of two successive corrections above which the Jacobian is recomputed. An iteration with the old Jacobian
/// costs at most a tenth of one with a new Jacobian.
pub(crate) const MAX_CONTRACTION: f64 = 0.2;

/// The number of unknowns from which on a factorisation costs more than a step whose iteration contracts.
pub(crate) const EXPENSIVE_FACTORISATION: usize = 16;

/// The change of the integrating factor in a step above which it is compared with the integral of `L_z`.
pub(crate) const MAX_UNCHECKED_FACTOR_CHANGE: f64 = 0.2;
