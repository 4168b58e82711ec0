//! The linear solve inside a Newton step: on the stack for small N, faer beyond the measured crossover.

use crate::StepError;
use contact_geom::linear;
use contact_geom::nalgebra::{SMatrix, SVector};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Mat, Par};

/// The dimension from which faer's blocked LU is faster than elimination on the stack: measured 1.83 against 2.11 us at 24,
/// 4.55 against 3.43 us at 32 (`cargo bench -p discrete-herglotz --bench solve`).
pub const CROSSOVER: usize = 28;

/// Solves the linear systems of Newton's method; holds the workspace that faer needs, so that no step allocates.
pub struct Solver<const N: usize> {
    large: Option<Box<DenseLu>>,
}

/// faer's LU factors of one matrix after another of one size, and the workspace for them.
pub(crate) struct DenseLu {
    factors: Mat<f64>,
    rhs: Mat<f64>,
    forward: Vec<usize>,
    backward: Vec<usize>,
    /// The smallest pivot.
    least: f64,
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
        Solver { large: Some(Box::new(DenseLu::new(N))) }
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
            Some(lu) => lu.factorise(|i, j| a[(i, j)]).and_then(|()| lu.solve(b.as_mut_slice())),
        }
    }
}

impl DenseLu {
    /// For matrices of `n` rows.
    pub fn new(n: usize) -> Self {
        let scratch = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default())
            .or(solve::solve_in_place_scratch::<usize, f64>(n, 1, Par::Seq));
        DenseLu {
            factors: Mat::zeros(n, n),
            rhs: Mat::zeros(n, 1),
            forward: (0..n).collect(),
            backward: (0..n).collect(),
            least: 0.0,
            scratch: MemBuffer::new(scratch),
        }
    }

    /// Factorises the matrix with these entries.
    ///
    /// # Errors
    /// [`StepError::Singular`] where a pivot vanishes or is not finite: faer is silent on it.
    pub fn factorise(&mut self, entry: impl Fn(usize, usize) -> f64) -> Result<(), StepError> {
        let n = self.factors.nrows();
        for j in 0..n {
            for i in 0..n {
                self.factors[(i, j)] = entry(i, j);
            }
        }
        factor::lu_in_place(
            self.factors.as_mut(),
            &mut self.forward,
            &mut self.backward,
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        );
        self.least = (0..n).fold(f64::INFINITY, |least, i| {
            let pivot = self.factors[(i, i)].abs();
            if pivot < least || !pivot.is_finite() { pivot } else { least }
        });
        if self.least > 0.0 && self.least.is_finite() { Ok(()) } else { Err(StepError::Singular { pivot: self.least }) }
    }

    /// Solves with the last matrix; `b` is used up, the solution is left in it.
    ///
    /// # Errors
    /// [`StepError::Singular`] where the solution is not finite.
    pub fn solve(&mut self, b: &mut [f64]) -> Result<(), StepError> {
        for (i, e) in b.iter().enumerate() {
            self.rhs[(i, 0)] = *e;
        }
        solve::solve_in_place(
            self.factors.as_ref(),
            self.factors.as_ref(),
            PermRef::new_checked(&self.forward, &self.backward, b.len()),
            self.rhs.as_mut(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        for (i, e) in b.iter_mut().enumerate() {
            *e = self.rhs[(i, 0)];
        }
        if b.iter().all(|e| e.is_finite()) { Ok(()) } else { Err(StepError::Singular { pivot: self.least }) }
    }
}
