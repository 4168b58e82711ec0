//! Errors of constrained problems.

use thiserror::Error;

/// Invalid constraints, or a start that they do not admit, detected before the first step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ConstraintError {
    /// The start is not on the constraint.
    #[error(
        "the start is off the constraints by the distance {distance:e} (constraint {index} has the value {value:e}); \
         give a start with c(q) = 0, or request the projection with `OffConstraint::Project`"
    )]
    OffConstraint {
        /// The distance to the constraint manifold, to first order.
        distance: f64,
        /// The constraint with the largest value, counted from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The initial velocity is not tangent to the constraint, or not in the distribution.
    #[error(
        "the initial velocity violates the constraints by the velocity {distance:e}; give a velocity with c_q v = 0 \
         (or omega v = 0), or request the projection with `OffConstraint::Project`"
    )]
    OffVelocity {
        /// The distance to the admissible velocities.
        distance: f64,
    },
    /// The projection of the start does not converge.
    #[error(
        "the start could not be projected onto the constraints: the distance {distance:e} remains; give a start nearer \
         to c(q) = 0"
    )]
    NotProjected {
        /// The last correction.
        distance: f64,
    },
    /// The rows of `c_q`, or of omega, are dependent.
    #[error(
        "the constraints are dependent at the start: the matrix c_q (or omega) has the rank {rank}, but there are \
         {expected} constraints, and the row of constraint {index} follows from the others; remove constraints that follow from others, start at another position, or request \
         multipliers of least norm with `Redundancy::LeastNorm` if the constraints are redundant everywhere"
    )]
    RankDeficient {
        /// The rank.
        rank: usize,
        /// The number of constraints.
        expected: usize,
        /// A constraint whose row follows from those of the others, counted from 0.
        index: usize,
    },
    /// The rank of `c_q` is smaller at the start than near it, or dependent constraints contradict each other.
    #[error(
        "the constraints are dependent only at the start: near it constraint {index} has the value {value:e} where \
         {rank} independent ones hold; start at a position at which c_q has its full rank"
    )]
    SingularPosition {
        /// The rank at the start.
        rank: usize,
        /// A constraint that does not follow from the independent ones.
        index: usize,
        /// Its value near the start.
        value: f64,
    },
    /// The number of stages is out of range.
    #[error("the number of stages is {found}; contact Lobatto methods have from 2 to 8")]
    Stages {
        /// The number that was passed.
        found: usize,
    },
}
