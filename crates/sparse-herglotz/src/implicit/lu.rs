//! Sparse LU factors of an unsymmetric matrix, by faer.

use super::max_norm::max_norm;
use crate::SparseError;
use discrete_herglotz::StepError;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::lu::{LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::linalg::qr::{
    col_etree, col_etree_scratch, column_counts_aat_scratch, column_counts_ata, postorder, postorder_scratch,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

/// The factors `P A Q = L U` of a sequence of matrices with the same pattern. The symbolic analysis is made once.
pub(crate) struct LuFactors {
    column_starts: Vec<u32>,
    rows: Vec<u32>,
    /// The entries of the matrix, by columns.
    pub entries: Vec<f64>,
    symbolic: SymbolicLu<u32>,
    numeric: NumericLu<u32, f64>,
    scratch: MemBuffer,
    residual: Vec<f64>,
    /// Whether there are factors that have not been discarded.
    is_current: bool,
}

impl LuFactors {
    /// Analyses a pattern, given by the start of each column and the row of each entry.
    ///
    /// # Errors
    /// [`SparseError::Memory`] if the matrix, its factors and the workspace may need more than `limit` bytes. The
    /// estimate for the factors is a bound for any choice of pivots: that of the Cholesky factor of `A^T A` (George and
    /// Ng 1985), once for L and once for U.
    pub fn new(column_starts: Vec<u32>, rows: Vec<u32>, limit: usize) -> Result<Self, SparseError> {
        let n = column_starts.len() - 1;
        // The matrix has a value and a row index for each entry, 12 bytes; the residual has 8 for each unknown.
        let matrix_bytes = 12 * rows.len() + 8 * n;
        let too_much = |needed: usize| SparseError::Memory { needed, limit };
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &column_starts, None, &rows);
        // faer fails here only for lack of memory.
        let symbolic =
            factorize_symbolic_lu(pattern, LuSymbolicParams::default()).map_err(|_| too_much(2 * matrix_bytes))?;
        let request = StackReq::any_of(&[
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]);
        let count = factor_entries(pattern, &symbolic).ok_or(too_much(2 * matrix_bytes))?;
        // Each entry of L and of U has a value and an index, 12 bytes. faer grows their vectors by doubling them.
        let needed = matrix_bytes.saturating_add(count.saturating_mul(2 * 2 * 12)).saturating_add(request.size_bytes());
        if needed > limit {
            return Err(too_much(needed));
        }
        let scratch = MemBuffer::try_new(request).map_err(|_| too_much(needed))?;
        let entries = vec![0.0; rows.len()];
        let numeric = NumericLu::new();
        Ok(LuFactors {
            column_starts,
            rows,
            entries,
            symbolic,
            numeric,
            scratch,
            residual: vec![0.0; n],
            is_current: false,
        })
    }

    /// Whether there are factors that have not been discarded.
    pub fn is_current(&self) -> bool {
        self.is_current
    }

    /// Discards the factors, so that new ones are computed before the next solve.
    pub fn discard(&mut self) {
        self.is_current = false;
    }

    /// Factorises the matrix with the present entries.
    ///
    /// # Errors
    /// [`StepError::NonFinite`] if an entry is not finite, [`StepError::Singular`] if no pivot is found.
    pub fn factorise(&mut self) -> Result<(), StepError> {
        self.is_current = false;
        // faer does not report entries that are not finite.
        if !self.entries.iter().sum::<f64>().is_finite() {
            return Err(StepError::NonFinite);
        }
        let LuFactors { column_starts, rows, entries, symbolic, numeric, scratch, .. } = self;
        let n = column_starts.len() - 1;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, column_starts, None, rows);
        let matrix = SparseColMatRef::new(pattern, entries.as_slice());
        let stack = MemStack::new(scratch);
        match symbolic.factorize_numeric_lu(numeric, matrix, Par::Seq, stack, Default::default()) {
            Ok(_) => {
                self.is_current = true;
                Ok(())
            }
            Err(LuError::SymbolicSingular { .. } | LuError::Generic(_)) => Err(StepError::Singular { pivot: 0.0 }),
        }
    }

    /// Solves with the last factors; `b` is overwritten with the solution.
    ///
    /// # Errors
    /// [`StepError::Singular`] if there are no factors, or if the solution is not finite.
    pub fn solve(&mut self, b: &mut [f64]) -> Result<(), StepError> {
        if !self.is_current {
            return Err(StepError::Singular { pivot: 0.0 });
        }
        let n = b.len();
        let factors = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        let rhs = MatMut::from_column_major_slice_mut(b, n, 1);
        factors.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut self.scratch));
        if b.iter().sum::<f64>().is_finite() {
            return Ok(());
        }
        self.is_current = false;
        Err(StepError::Singular { pivot: 0.0 })
    }

    /// Checks that x solves `A x = b` to half of the digits: faer does not report singular factors. Newton's method
    /// corrects the remaining error.
    ///
    /// # Errors
    /// [`StepError::Singular`] if it does not.
    pub fn check(&mut self, x: &[f64], b: &[f64]) -> Result<(), StepError> {
        self.residual.copy_from_slice(b);
        let mut size = max_norm(b);
        for (column, ends) in self.column_starts.windows(2).enumerate() {
            let range = ends[0] as usize..ends[1] as usize;
            for (row, a) in self.rows[range.clone()].iter().zip(&self.entries[range]) {
                let term = a * x[column];
                self.residual[*row as usize] -= term;
                size = size.max(term.abs());
            }
        }
        if max_norm(&self.residual) <= f64::EPSILON.sqrt() * size {
            return Ok(());
        }
        self.is_current = false;
        Err(StepError::Singular { pivot: 0.0 })
    }
}

/// The number of entries of the Cholesky factor of `A^T A` in faer's column ordering; `None` if there is not enough
/// memory to count them.
fn factor_entries(pattern: SymbolicSparseColMatRef<u32>, symbolic: &SymbolicLu<u32>) -> Option<usize> {
    let n = pattern.ncols();
    let mut memory = MemBuffer::try_new(StackReq::any_of(&[
        col_etree_scratch::<u32>(n, n),
        postorder_scratch::<u32>(n),
        column_counts_aat_scratch::<u32>(n, n),
    ]))
    .ok()?;
    let (mut tree, mut post) = (vec![0u32; n], vec![0u32; n]);
    let (mut counts, mut least) = (vec![0u32; n], vec![0u32; n]);
    let order = Some(symbolic.col_perm());
    let tree = col_etree(pattern, order, &mut tree, MemStack::new(&mut memory));
    postorder(&mut post, tree, MemStack::new(&mut memory));
    // The pattern is symmetric: it is its own transpose.
    column_counts_ata(&mut counts, &mut least, pattern, order, tree, &post, MemStack::new(&mut memory));
    Some(counts.iter().map(|c| *c as usize).sum())
}
