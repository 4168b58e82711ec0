//! Tolerances and limits of the iteration.

/// Tolerances and limits of the iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Settings {
    /// Relative decrease of the cost, predicted and actual. A relative decrease of 1e-14 moves the parameters by about
    /// 1e-7 of their standard errors.
    pub cost_tolerance: f64,
    /// Relative change of the parameters, scaled by the columns of the Jacobian.
    pub parameter_tolerance: f64,
    /// Cosine of the angle between the residuals and the columns of the Jacobian.
    pub gradient_tolerance: f64,
    /// The first step is at most this multiple of the norm of the scaled parameters.
    pub step_bound: f64,
    /// The largest number of evaluations, if it is set.
    pub max_evaluations: Option<usize>,
    /// Singular values of the Jacobian below this multiple of the largest one are zero. Columns are scaled to norm 1
    /// before. Exact Jacobians have errors of 1e-15 to 1e-12; a combination of parameters whose error is 1e10 times
    /// larger than that of others is not determined in practice.
    pub rank_tolerance: f64,
    /// Whether standard errors are those of the weights, and are not scaled by the size of the residuals.
    pub absolute_deviations: bool,
}

impl Settings {
    /// The largest number of evaluations for this number of parameters.
    pub fn limit(&self, parameters: usize) -> usize {
        // What `levenberg-marquardt` and MINPACK allow by default.
        const EVALUATIONS_PER_PARAMETER: usize = 100;
        self.max_evaluations.unwrap_or(EVALUATIONS_PER_PARAMETER.saturating_mul(parameters.saturating_add(1)))
    }
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            cost_tolerance: 1e-14,
            parameter_tolerance: 1e-12,
            gradient_tolerance: 1e-12,
            step_bound: 100.0,
            max_evaluations: None,
            rank_tolerance: 1e-10,
            absolute_deviations: false,
        }
    }
}
