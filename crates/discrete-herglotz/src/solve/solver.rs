//! The linear solver of Newton's method: elimination on the stack for small N, faer beyond the measured crossover.

use super::DenseLu;
use crate::StepError;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::linear;

/// The dimension from which faer's blocked LU is faster than elimination on the stack: the measured times on the stack
/// and by faer are 1.83 and 2.11 us at 24, 4.55 and 3.43 us at 32.
pub const CROSSOVER: usize = 28;

/// The linear solver of Newton's method, with the workspace of faer, so that steps do not allocate.
pub struct Solver<const N: usize> {
    large: Option<Box<DenseLu>>,
}

/// The faster of the two methods for this `N`; without the feature `faer`, elimination on the stack.
impl<const N: usize> Default for Solver<N> {
    fn default() -> Self {
        #[cfg(feature = "faer")]
        if N >= CROSSOVER {
            return Self::by_faer();
        }
        Self::on_the_stack()
    }
}

impl<const N: usize> Solver<N> {
    /// Elimination with row pivoting on the stack, without a workspace.
    pub fn on_the_stack() -> Self {
        Solver { large: None }
    }

    /// faer's blocked LU, with a workspace that is allocated here. Requires the feature `faer`.
    #[cfg(feature = "faer")]
    pub fn by_faer() -> Self {
        Solver { large: Some(Box::new(DenseLu::new(N))) }
    }

    /// Solves `a x = b`; `a` and `b` are overwritten, with the solution in `b`.
    ///
    /// # Errors
    /// [`StepError::Singular`] if `a` is singular or the solution is not finite.
    #[inline]
    pub fn solve(&mut self, a: &mut SMatrix<f64, N, N>, b: &mut SVector<f64, N>) -> Result<(), StepError> {
        match &mut self.large {
            None => match linear::solve(a, b) {
                Ok(_) if b.iter().all(|x| x.is_finite()) => Ok(()),
                // A pivot so small that the solution overflows.
                Ok(determinant) => Err(StepError::Singular { pivot: determinant.abs() }),
                Err(e) => Err(StepError::Singular { pivot: e.pivot }),
            },
            Some(lu) => lu.factorise(|i, j| a[(i, j)]).and_then(|()| lu.solve(b.as_mut_slice())),
        }
    }
}
