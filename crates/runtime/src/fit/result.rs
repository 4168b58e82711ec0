//! The result of a fit of a motion.

use crate::Motion;
use herglotz_fit::{Fit, FitError};

/// A motion that was fitted to data.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FittedMotion {
    /// The unknowns, residuals and how well the data determine the unknowns.
    pub fit: Fit,
    /// The data with the fitted values.
    pub series: Vec<FittedSeries>,
    /// The fitted parameters of the system, without the unknowns of the start.
    pub parameters: Vec<(String, f64)>,
    /// The fitted motion, to the last of the data, with the steps of the fit. Its parameters are
    /// [`parameters`](Self::parameters).
    pub motion: Motion,
    /// The fit from each start, in their order, or why there is none.
    pub starts: Vec<Result<Fit, FitError>>,
    /// The index of the start from which the best fit was found.
    pub best_start: usize,
    /// The largest matching defect of multiple shooting, relative to the size of its component; `None` without it.
    pub largest_defect: Option<f64>,
}

/// Measured values of a quantity with those of the fitted motion.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FittedSeries {
    /// The quantity.
    pub quantity: String,
    /// The times.
    pub times: Vec<f64>,
    /// The measured values.
    pub values: Vec<f64>,
    /// The values of the fitted motion.
    pub fitted: Vec<f64>,
    /// The residuals, fitted less measured values, each divided by its standard deviation where that is given.
    pub residuals: Vec<f64>,
}
