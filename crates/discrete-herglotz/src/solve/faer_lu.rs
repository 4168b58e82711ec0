//! LU factorisation of large matrices by faer.

use crate::StepError;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Mat, Par};

/// faer's LU factorisation for matrices of one size, with its workspace.
pub(crate) struct DenseLu {
    factors: Mat<f64>,
    rhs: Mat<f64>,
    forward: Vec<usize>,
    backward: Vec<usize>,
    /// The smallest pivot.
    least: f64,
    scratch: MemBuffer,
}

impl DenseLu {
    /// The workspace for matrices of `n` rows.
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

    /// Factorises the matrix with the given entries.
    ///
    /// # Errors
    /// [`StepError::Singular`] if a pivot vanishes or is not finite, which faer does not report.
    pub fn factorise(&mut self, entry: impl Fn(usize, usize) -> f64) -> Result<(), StepError> {
        let n = self.factors.nrows();
        for j in 0..n {
            for i in 0..n {
                self.factors[(i, j)] = entry(i, j);
            }
        }
        self.factorise_entries()
    }

    /// Separate from the generic function, so that faer's code is compiled with this crate and not with each program.
    fn factorise_entries(&mut self) -> Result<(), StepError> {
        factor::lu_in_place(
            self.factors.as_mut(),
            &mut self.forward,
            &mut self.backward,
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        );
        self.least = (0..self.factors.nrows()).fold(f64::INFINITY, |least, i| {
            let pivot = self.factors[(i, i)].abs();
            if pivot < least || !pivot.is_finite() { pivot } else { least }
        });
        if self.least > 0.0 && self.least.is_finite() { Ok(()) } else { Err(StepError::Singular { pivot: self.least }) }
    }

    /// Solves with the last factorised matrix; `b` is overwritten by the solution.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the solution is not finite.
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
