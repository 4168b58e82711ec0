//! Errors of exact motions, and of their input.

use contact_geom::{GeometryError, VelocityPoint};
use discrete_herglotz::{InputError, StepError, solve::ITERATION_LIMIT};
use thiserror::Error;

/// The reason why a motion, or the motion between two points, could not be computed. Errors along a motion carry the
/// state that was reached, so that the computation can be continued from there.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ExactError<const N: usize> {
    /// The input is not acceptable; nothing was computed.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The motion is not defined up to the end: it blows up, meets a singular W, or leaves the domain of L. The start
    /// is outside `U_h`, the domain of the exponential map; paper, section 4.1.
    #[error(
        "the motion is defined only until t = {t}: it blows up there, or leaves the domain on which L is regular; \
         take a smaller h or another start"
    )]
    OutsideDomain {
        /// The time that was reached.
        t: f64,
        /// The state at that time.
        reached: VelocityPoint<N>,
        /// The error of the geometric formulas beyond that time, if there is one.
        cause: Option<GeometryError>,
    },
    /// The motion needs more work than [`EVALUATIONS`](crate::EVALUATIONS): the drag is very strong, or the time very
    /// long.
    #[error("the largest number of evaluations was reached at t = {t}; continue from there, or take a smaller h")]
    Unfinished {
        /// The time that was reached.
        t: f64,
        /// The state at that time.
        reached: VelocityPoint<N>,
    },
    /// No motion through the two points was found.
    #[error(
        "no motion through the two points was found: with the initial velocity {:?} it misses the second point by \
         {residual:e}; pass a guess of the initial velocity, or take a smaller h", last.v.as_slice()
    )]
    NotConverged {
        /// The start of the last motion tried.
        last: VelocityPoint<N>,
        /// The largest component of the distance between its end and the second point.
        residual: f64,
        /// The smallest singular value of `dq1/dv0` there, in units of time.
        smallest: f64,
    },
    /// The points are conjugate along the motion: `dq1/dv0` is singular to round-off, and the exponential map is not a
    /// local diffeomorphism there.
    #[error(
        "the two points are conjugate along the motion (smallest singular value of dq1/dv0 {smallest:e}), so that \
         they do not determine it; take another h"
    )]
    ConjugatePoint {
        /// The start of the last motion tried.
        last: VelocityPoint<N>,
        /// The largest component of the distance between its end and the second point.
        residual: f64,
        /// The smallest singular value of `dq1/dv0` there, in units of time.
        smallest: f64,
    },
}

impl<const N: usize> From<GeometryError> for ExactError<N> {
    fn from(error: GeometryError) -> Self {
        ExactError::Input(InputError::Geometry(error))
    }
}

/// The conversion to the error of a step of a discrete Lagrangian, which carries no state.
impl<const N: usize> From<ExactError<N>> for StepError {
    fn from(error: ExactError<N>) -> Self {
        match error {
            ExactError::Input(InputError::FirstStep(cause)) => cause,
            ExactError::Input(InputError::Geometry(GeometryError::Singular { pivot, .. })) => {
                StepError::Singular { pivot }
            }
            ExactError::Input(_) => StepError::NonFinite,
            ExactError::OutsideDomain { t, .. } | ExactError::Unfinished { t, .. } => StepError::OutsideDomain { t },
            ExactError::NotConverged { residual, .. } => {
                StepError::NotConverged { residual, iterations: ITERATION_LIMIT }
            }
            ExactError::ConjugatePoint { smallest, .. } => StepError::ConjugatePoint { smallest },
        }
    }
}

/// The conversion to the error of a geometric formula.
impl<const N: usize> From<ExactError<N>> for GeometryError {
    fn from(error: ExactError<N>) -> Self {
        match error {
            ExactError::Input(InputError::Geometry(cause)) | ExactError::OutsideDomain { cause: Some(cause), .. } => {
                cause
            }
            _ => GeometryError::Undefined { what: "the exact motion" },
        }
    }
}
