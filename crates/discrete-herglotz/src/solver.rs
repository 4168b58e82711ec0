//! The linear solve inside a Newton step: on the stack for small N, faer beyond the measured crossover.

use crate::StepError;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{larger, linear};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::{Mat, Par};

/// The dimension from which faer's blocked LU is faster than elimination on the stack: measured 1.83 against 2.11 us at 24,
/// 4.55 against 3.43 us at 32 (`cargo bench -p discrete-herglotz --bench solve`).
pub const CROSSOVER: usize = 28;

/// Solves the linear systems of Newton's method; holds the workspace that faer needs, so that no step allocates.
pub struct Solver<const N: usize> {
    large: Option<Box<Large>>,
}

/// faer's matrix, permutation and scratch for one size.
struct Large {
    matrix: Mat<f64>,
    rhs: Mat<f64>,
    forward: Vec<usize>,
    backward: Vec<usize>,
    scratch: MemBuffer,
}

/// The faster of the two routes for this `N`.
impl<const N: usize> Default for Solver<N> {
    fn default() -> Self {
        if N < CROSSOVER { Self::on_the_stack() } else { Self::by_faer() }
    }
}

impl<const N: usize> Solver<N> {
    /// Elimination with row pivoting on the stack, without any workspace.
    pub fn on_the_stack() -> Self {
        Solver { large: None }
    }

    /// faer's blocked LU, its workspace allocated here once.
    pub fn by_faer() -> Self {
        Solver { large: Some(Box::new(Large::new(N))) }
    }

    /// Solves `a x = b`; `a` and `b` are used up, the solution is left in `b`.
    ///
    /// # Errors
    /// [`StepError::Singular`] where `a` is singular or the solution is not finite.
    #[inline]
    pub fn solve(&mut self, a: &mut SMatrix<f64, N, N>, b: &mut SVector<f64, N>) -> Result<(), StepError> {
        match &mut self.large {
            None => match linear::solve(a, b) {
                Ok(_) if b.iter().all(|x| x.is_finite()) => Ok(()),
                // A pivot so small that the solution is beyond all numbers.
                Ok(determinant) => Err(StepError::Singular { pivot: determinant.abs() }),
                Err(e) => Err(StepError::Singular { pivot: e.pivot }),
            },
            Some(large) => large.solve(a, b),
        }
    }
}

impl Large {
    fn new(n: usize) -> Self {
        let scratch = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default())
            .or(solve::solve_in_place_scratch::<usize, f64>(n, 1, Par::Seq));
        Large {
            matrix: Mat::zeros(n, n),
            rhs: Mat::zeros(n, 1),
            forward: vec![0; n],
            backward: vec![0; n],
            scratch: MemBuffer::new(scratch),
        }
    }

    fn solve<const N: usize>(&mut self, a: &SMatrix<f64, N, N>, b: &mut SVector<f64, N>) -> Result<(), StepError> {
        for j in 0..N {
            for i in 0..N {
                self.matrix[(i, j)] = a[(i, j)];
            }
            self.rhs[(j, 0)] = b[j];
        }
        let stack = MemStack::new(&mut self.scratch);
        let (_, permutation) = factor::lu_in_place(
            self.matrix.as_mut(),
            &mut self.forward,
            &mut self.backward,
            Par::Seq,
            stack,
            Default::default(),
        );
        solve::solve_in_place(
            self.matrix.as_ref(),
            self.matrix.as_ref(),
            permutation,
            self.rhs.as_mut(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        // faer is silent on a singular or non-finite matrix: the factor's diagonal and the solution tell.
        let (mut least, mut finite) = (f64::INFINITY, true);
        for i in 0..N {
            let pivot = self.matrix[(i, i)].abs();
            // By an infinite pivot the solution would be 0.
            finite &= pivot.is_finite() && self.rhs[(i, 0)].is_finite();
            least = -larger(-least, -pivot);
            b[i] = self.rhs[(i, 0)];
        }
        if least > 0.0 && finite { Ok(()) } else { Err(StepError::Singular { pivot: least }) }
    }
}
