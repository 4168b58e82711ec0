//! The sparse matrix of a midpoint step, and its factors.

use super::cholesky::CholeskyFactors;
use super::max_norm::max_norm;
use super::pattern::LowerPattern;
use crate::SparseError;
use crate::memory::memory_limit;
use crate::system::{Masses, SparseSystem};
use discrete_herglotz::StepError;

/// `M + (h^2/4) V_qq` as a sparse matrix, whose pattern is determined once.
pub(super) struct MidpointMatrix {
    pub factors: CholeskyFactors,
    /// For each list, the indices of the matrix entries of its elements.
    entry_indices: Vec<Vec<u32>>,
    /// The indices of the diagonal entries.
    diagonal: Vec<u32>,
    pub entries: Vec<f64>,
}

impl MidpointMatrix {
    /// Determines the pattern of a system. For `memory` see [`SparseMidpoint::new`](super::SparseMidpoint::new).
    pub fn new(system: &SparseSystem, memory: Option<usize>) -> Result<Self, SparseError> {
        let n = system.unknowns();
        let pattern = LowerPattern::new(n, |f| system.potentials.iter().for_each(|list| list.visit(f)))?;
        let entry_indices = system.potentials.iter().map(|list| list.entry_indices(&pattern)).collect();
        let diagonal = (1..=n).map(|i| pattern.entry(i, i)).collect();
        let entries = vec![0.0; pattern.rows.len()];
        Ok(MidpointMatrix {
            factors: CholeskyFactors::new(pattern, memory_limit(memory))?,
            entry_indices,
            diagonal,
            entries,
        })
    }

    /// Assembles and factorises the matrix at padded positions, with `factor = h^2/4`.
    pub fn factorise(&mut self, system: &SparseSystem, (t, q): (f64, &[f64]), factor: f64) -> Result<(), StepError> {
        self.entries.fill(0.0);
        for (i, entry) in self.diagonal.iter().enumerate() {
            self.entries[*entry as usize] = match &system.masses {
                Masses::Same(m) => *m,
                Masses::Each(masses) => masses[i],
            };
        }
        for (list, indices) in system.potentials.iter().zip(&self.entry_indices) {
            list.add_hessian(t, q, factor, indices, &mut self.entries);
        }
        self.factors.factorise(&self.entries)
    }

    /// Whether x solves the system with right-hand side b to half of the digits. This is checked because faer does not
    /// report singular factors. Half of the digits suffice, since Newton's method corrects the remaining error.
    pub fn is_solution(&self, x: &[f64], b: &[f64], work: &mut [f64]) -> bool {
        let (residual, size) = self.factors.residual(&self.entries, x, b, work);
        residual <= f64::EPSILON.sqrt() * (size + max_norm(b))
    }
}
