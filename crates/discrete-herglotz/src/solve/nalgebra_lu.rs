//! LU factorisation of large matrices by nalgebra, for builds without faer; it is slower, and each factorisation
//! allocates.

use crate::StepError;
use contact_geom::nalgebra::{DMatrix, DVectorViewMut, Dyn, LU};

/// LU factorisation for matrices of one size.
pub(crate) struct DenseLu {
    n: usize,
    factors: Option<LU<f64, Dyn, Dyn>>,
    /// The smallest pivot.
    least: f64,
}

impl DenseLu {
    /// A factorisation for matrices of `n` rows.
    pub fn new(n: usize) -> Self {
        DenseLu { n, factors: None, least: 0.0 }
    }

    /// Factorises the matrix with the given entries.
    ///
    /// # Errors
    /// [`StepError::Singular`] if a pivot vanishes or is not finite.
    pub fn factorise(&mut self, entry: impl Fn(usize, usize) -> f64) -> Result<(), StepError> {
        let factors = DMatrix::from_fn(self.n, self.n, entry).lu();
        let pivots = factors.lu_internal().diagonal();
        self.least = pivots.iter().fold(f64::INFINITY, |least, pivot| {
            if pivot.abs() < least || !pivot.is_finite() { pivot.abs() } else { least }
        });
        self.factors = Some(factors);
        if self.least > 0.0 && self.least.is_finite() { Ok(()) } else { Err(StepError::Singular { pivot: self.least }) }
    }

    /// Solves with the last factorised matrix; `b` is overwritten by the solution.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the solution is not finite.
    pub fn solve(&mut self, b: &mut [f64]) -> Result<(), StepError> {
        let n = b.len();
        let solved = self.factors.as_ref().is_some_and(|lu| lu.solve_mut(&mut DVectorViewMut::from_slice(b, n)));
        if solved && b.iter().all(|e| e.is_finite()) { Ok(()) } else { Err(StepError::Singular { pivot: self.least }) }
    }
}
