//! How a fit ended.

use crate::NullSpace;
use std::fmt::{Display, Formatter};

/// How a fit ended.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FitStatus {
    /// A minimum, at which the data determine all parameters that are not held at a bound.
    Converged(Criterion),
    /// The cost is at a minimum, but the data do not determine all parameters: the normal matrix is singular, and the
    /// cost does not change along the directions of the null space. The values of these parameters depend on the start.
    Undetermined(NullSpace),
    /// The limit of the number of evaluations was reached first; the parameters are the best so far.
    EvaluationLimit {
        /// The limit.
        limit: usize,
    },
}

impl FitStatus {
    /// Whether a minimum was found that determines the parameters.
    pub fn is_converged(&self) -> bool {
        matches!(self, FitStatus::Converged(_))
    }
}

impl Display for FitStatus {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            FitStatus::Converged(criterion) => write!(f, "converged: {criterion}"),
            FitStatus::Undetermined(null_space) => write!(
                f,
                "a minimum that does not determine the parameters: {null_space}; hold a parameter fixed, or measure \
                 what depends on it"
            ),
            FitStatus::EvaluationLimit { limit } => write!(
                f,
                "not converged after {limit} evaluations; start nearer, scale the parameters, or allow more evaluations"
            ),
        }
    }
}

/// The criterion of convergence that was met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// The cost no longer decreases.
    Cost,
    /// The parameters no longer change.
    Parameters,
    /// The residuals are orthogonal to the columns of the Jacobian.
    Gradient,
    /// All residuals are zero.
    ZeroResiduals,
    /// The remaining changes are round-off.
    RoundOff,
    /// All parameters are held at bounds.
    AllAtBounds,
}

impl Display for Criterion {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Criterion::Cost => "the cost no longer decreases",
            Criterion::Parameters => "the parameters no longer change",
            Criterion::Gradient => "the gradient is zero",
            Criterion::ZeroResiduals => "all residuals are zero",
            Criterion::RoundOff => "the remaining changes are round-off",
            Criterion::AllAtBounds => "all parameters are held at bounds",
        })
    }
}
