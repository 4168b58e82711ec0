//! Sparse Cholesky factors of a symmetric matrix, by faer.

use super::max_norm::max_norm;
use super::pattern::LowerPattern;
use crate::SparseError;
use discrete_herglotz::StepError;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// The factors of a sequence of matrices with the same pattern: `L L^T` if the matrix is positive definite, else
/// `L D L^T`. The symbolic analysis is made once.
pub(crate) struct CholeskyFactors {
    pattern: LowerPattern,
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    scratch: MemBuffer,
    is_definite: bool,
}

impl CholeskyFactors {
    /// Analyses a pattern.
    ///
    /// # Errors
    /// [`SparseError::Memory`] if factors and workspace need more than `limit` bytes. The check is made before
    /// anything of that size is allocated.
    pub fn new(pattern: LowerPattern, limit: usize) -> Result<Self, SparseError> {
        let n = pattern.unknowns();
        // faer fails here only for lack of memory; then the size of the pattern is reported, of 4 bytes for each row
        // index.
        let pattern_bytes = 4 * pattern.rows.len();
        let too_much = |needed: usize| SparseError::Memory { needed, limit };
        let lower = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
        let symbolic =
            factorize_symbolic_cholesky(lower, Side::Lower, SymmetricOrdering::Amd, CholeskySymbolicParams::default())
                .map_err(|_| too_much(pattern_bytes))?;
        let request = StackReq::any_of(&[
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]);
        let needed = symbolic.len_val().saturating_mul(8).saturating_add(request.size_bytes());
        if needed > limit {
            return Err(too_much(needed));
        }
        let scratch = MemBuffer::try_new(request).map_err(|_| too_much(needed))?;
        let mut values = Vec::new();
        values.try_reserve_exact(symbolic.len_val()).map_err(|_| too_much(needed))?;
        values.resize(symbolic.len_val(), 0.0);
        Ok(CholeskyFactors { pattern, symbolic, values, scratch, is_definite: true })
    }

    #[cfg(test)]
    pub fn pattern(&self) -> &LowerPattern {
        &self.pattern
    }

    /// Factorises the matrix with these entries of its lower triangle.
    ///
    /// # Errors
    /// [`StepError::NonFinite`] if an entry is not finite, [`StepError::Singular`] if a pivot vanishes.
    pub fn factorise(&mut self, entries: &[f64]) -> Result<(), StepError> {
        // faer does not report entries that are not finite.
        if !entries.iter().sum::<f64>().is_finite() {
            return Err(StepError::NonFinite);
        }
        let CholeskyFactors { pattern, symbolic, values, scratch, is_definite } = self;
        let n = pattern.unknowns();
        let lower = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
        let matrix = SparseColMatRef::new(lower, entries);
        let stack = MemStack::new(scratch);
        let (regular, par) = (Default::default(), Par::Seq);
        let llt = symbolic.factorize_numeric_llt(values, matrix, Side::Lower, regular, par, stack, Default::default());
        *is_definite = llt.is_ok();
        if *is_definite {
            return Ok(());
        }
        let ldlt = symbolic.factorize_numeric_ldlt(
            values,
            matrix,
            Side::Lower,
            Default::default(),
            par,
            stack,
            Default::default(),
        );
        ldlt.map(|_| ()).map_err(|_| StepError::Singular { pivot: 0.0 })
    }

    /// Whether the last matrix was positive definite.
    pub fn is_definite(&self) -> bool {
        self.is_definite
    }

    /// Solves with the last factors; `b` is overwritten with the solution.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the solution is not finite.
    pub fn solve(&mut self, b: &mut [f64]) -> Result<(), StepError> {
        let n = b.len();
        let rhs = MatMut::from_column_major_slice_mut(b, n, 1);
        let stack = MemStack::new(&mut self.scratch);
        if self.is_definite {
            let factors = LltRef::new(&self.symbolic, &self.values);
            factors.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack);
        } else {
            let factors = LdltRef::new(&self.symbolic, &self.values);
            factors.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack);
        }
        if b.iter().sum::<f64>().is_finite() { Ok(()) } else { Err(StepError::Singular { pivot: 0.0 }) }
    }

    /// The largest component of `|A x - b|`, and the largest term of the lower triangle in `|A| |x|`.
    pub fn residual(&self, entries: &[f64], x: &[f64], b: &[f64], work: &mut [f64]) -> (f64, f64) {
        work.copy_from_slice(b);
        let mut size = 0.0f64;
        for (column, ends) in self.pattern.column_starts.windows(2).enumerate() {
            let (from, to) = (ends[0] as usize, ends[1] as usize);
            for (row, a) in self.pattern.rows[from..to].iter().zip(&entries[from..to]) {
                let row = *row as usize;
                work[row] -= a * x[column];
                if row != column {
                    work[column] -= a * x[row];
                }
                size = size.max((a * x[column]).abs());
            }
        }
        (max_norm(work), size)
    }
}
