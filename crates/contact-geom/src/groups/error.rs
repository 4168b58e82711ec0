//! Invalid input to groups and rigid bodies.

use thiserror::Error;

/// Invalid input to a group, a rigid body or a step on a group, and the failure of a step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum GroupError {
    /// A number is infinite or NaN.
    #[error("{what} is {value}; it must be a finite number")]
    NonFinite {
        /// What the number is.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A quaternion is not a unit quaternion.
    #[error("the quaternion has the norm {norm}, but rotations are unit quaternions; divide it by its norm")]
    NonUnitQuaternion {
        /// Its norm.
        norm: f64,
    },
    /// An inertia tensor or a mass matrix is not symmetric.
    #[error("the {what} is not symmetric: two entries across the diagonal differ by {difference:e}")]
    NotSymmetric {
        /// The matrix.
        what: &'static str,
        /// The difference.
        difference: f64,
    },
    /// An inertia tensor or a mass matrix is not positive definite.
    #[error("the {what} is not positive definite: its smallest eigenvalue is {smallest:e}")]
    NotPositive {
        /// The matrix.
        what: &'static str,
        /// The smallest eigenvalue.
        smallest: f64,
    },
    /// The principal moments of inertia violate the triangle inequality, so no body has them.
    #[error(
        "the principal moments of inertia {moments:?} violate the triangle inequality: the largest exceeds the sum of \
         the others, and no distribution of mass has them"
    )]
    TriangleInequality {
        /// The moments, in ascending order.
        moments: [f64; 3],
    },
    /// The rotation in one step leaves the chart of the exponential map.
    #[error(
        "the step h = {h} turns the body by {angle} rad, beyond the chart of the exponential map (pi); take a step of \
         at most {largest:e}"
    )]
    BeyondChart {
        /// The step.
        h: f64,
        /// The angle.
        angle: f64,
        /// The largest step with the present angular velocity.
        largest: f64,
    },
    /// The step is 0 or not finite.
    #[error("the step h = {h} must be a finite nonzero number")]
    Step {
        /// The step that was passed.
        h: f64,
    },
    /// The number of stages of a collocation method is out of range.
    #[error("the number of stages is {found}; Gauss collocation on groups has from 1 to 16")]
    Stages {
        /// The number of stages that was passed.
        found: usize,
    },
    /// A splitting needs a scheme of another class.
    #[error(
        "the scheme {scheme} is a Runge-Kutta-Nyström splitting, whose order needs the exact flow of the free body; \
         the moments of inertia are all different, so use a composition instead"
    )]
    NeedsComposition {
        /// The name of the scheme.
        scheme: &'static str,
    },
    /// The stage equations were not solved.
    #[error(
        "the stage equations were not solved: after {iterations} iterations a velocity still changes by {change:e}; \
         take a smaller step"
    )]
    NotConverged {
        /// The number of iterations.
        iterations: u32,
        /// The last change of a velocity.
        change: f64,
    },
    /// The mass matrix `l_xixi` is singular.
    #[error("the mass matrix is singular (pivot {pivot:e}); choose a regular Lagrangian")]
    Singular {
        /// The pivot that vanishes.
        pivot: f64,
    },
    /// No motion between two configurations was found.
    #[error(
        "no motion between the configurations was found: after {iterations} corrections the end is off by {residual:e}; \
         give a guess of the momentum nearer to that of a motion, or take more time"
    )]
    NoMotionBetween {
        /// The remaining residual.
        residual: f64,
        /// The number of corrections.
        iterations: u32,
    },
    /// The integrating factor of the action is not positive in a step.
    #[error("sigma_d = {sigma} is not positive: the step is too long for the rate L_z; take a smaller step")]
    SigmaVanished {
        /// The conformal factor.
        sigma: f64,
    },
    /// The times of the rows of a run are not within it, or not in its order.
    #[error("row {index} is at t = {t}, but it must be between {from} and {to}, in the order of the motion")]
    Times {
        /// The number of the row, counted from 0.
        index: usize,
        /// Its time.
        t: f64,
        /// The time of the row before it, or the initial time.
        from: f64,
        /// The final time.
        to: f64,
    },
    /// A time at which a state is requested is outside of the motion.
    #[error("t = {t} is outside of the motion, which is from {from} to {to}; take more steps, or a time within")]
    OutsideSpan {
        /// The time.
        t: f64,
        /// The initial time.
        from: f64,
        /// The final time.
        to: f64,
    },
    /// The trial runs for an accuracy take too many steps.
    #[error(
        "the accuracy {requested:e} is not reached: {}, and the number of steps of trial runs is bounded; request a larger \
         error, choose a shorter time, or give the steps", if reached.is_finite() {
            format!("three runs with up to {steps} steps differ by {reached:e}")
        } else {
            format!("no three runs with up to {steps} steps can be compared")
        }
    )]
    Budget {
        /// The accuracy that was requested.
        requested: f64,
        /// The smallest number by which three runs, each with twice as many steps, differ; infinite if there is none.
        reached: f64,
        /// The number of steps of the last run.
        steps: usize,
    },
    /// The computation was interrupted.
    #[error("the computation was interrupted")]
    Interrupted,
    /// An accuracy is not positive, or is not reached.
    #[error(
        "the accuracy {requested:e} {}", if *steps > 0 {
            format!(
                "is not reached: with {steps} steps the roundings grow to {reached:e} at the end, and more steps are not \
                 better; request a larger error or choose a shorter time"
            )
        } else {
            "must be a positive number".to_owned()
        }
    )]
    Accuracy {
        /// The accuracy that was requested.
        requested: f64,
        /// The smallest number by which three runs, each with twice as many steps, differ, or the difference of runs with
        /// other roundings.
        reached: f64,
        /// The number of steps that reach it; 0 if there is none.
        steps: usize,
    },
}
