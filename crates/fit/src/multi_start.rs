//! Fits from several starts.

use crate::{Fit, FitError};

/// Fits of one problem from several starts.
#[derive(Clone, Debug)]
pub struct MultiStart {
    /// The fit of each start, in their order, or why there is none.
    pub fits: Vec<Result<Fit, FitError>>,
}

impl MultiStart {
    /// The index of the best start: the lowest cost among starts that reached a minimum; if none did, among all. The
    /// first of equals.
    pub fn best_index(&self) -> Option<usize> {
        let fits = || self.fits.iter().enumerate().filter_map(|(i, fit)| fit.as_ref().ok().map(|fit| (i, fit)));
        let is_at_minimum = |fit: &Fit| !matches!(fit.status, crate::FitStatus::EvaluationLimit { .. });
        let best = |(i, _): (usize, &Fit)| i;
        let lowest = |a: &(usize, &Fit), b: &(usize, &Fit)| a.1.cost.total_cmp(&b.1.cost);
        fits().filter(|(_, fit)| is_at_minimum(fit)).min_by(lowest).or_else(|| fits().min_by(lowest)).map(best)
    }

    /// The best fit.
    ///
    /// # Errors
    /// If no start has led to a fit, the error of the first.
    pub fn best(&self) -> Result<&Fit, FitError> {
        match (self.best_index(), self.fits.first()) {
            (Some(index), _) => self.fits[index].as_ref().map_err(Clone::clone),
            (None, Some(Err(error))) => Err(error.clone()),
            _ => Err(FitError::NoStart),
        }
    }
}
