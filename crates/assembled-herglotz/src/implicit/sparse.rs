//! The sparse matrix of a midpoint step, and its factors.

use super::factors::Factors;
use super::max_abs_or_nan;
use super::pattern::Pattern;
use crate::AssemblyError;
use crate::memory::limit;
use crate::system::{AssembledSystem, Masses};
use discrete_herglotz::StepError;

/// `M + (h^2/4) V_qq` as a sparse matrix, whose pattern is determined once.
pub(super) struct Sparse {
    pub factors: Factors,
    /// For each list, the indices of the matrix entries of its elements.
    places: Vec<Vec<u32>>,
    diagonal: Vec<u32>,
    pub entries: Vec<f64>,
}

impl Sparse {
    /// Determines the pattern of a system. For `memory` see [`AssembledMidpoint::new`](super::AssembledMidpoint::new).
    pub fn new(system: &AssembledSystem, memory: Option<usize>) -> Result<Self, AssemblyError> {
        let n = system.unknowns();
        let pattern = Pattern::new(n, |f| system.potentials.iter().for_each(|list| list.visit(f)))?;
        let places = system.potentials.iter().map(|list| list.entries(&pattern)).collect();
        let diagonal = (1..=n).map(|i| pattern.entry(i, i)).collect();
        let entries = vec![0.0; pattern.rows.len()];
        Ok(Sparse { factors: Factors::new(pattern, limit(memory))?, places, diagonal, entries })
    }

    /// Assembles and factorises the matrix at padded positions, with `factor = h^2/4`.
    pub fn factorise(&mut self, system: &AssembledSystem, (t, q): (f64, &[f64]), factor: f64) -> Result<(), StepError> {
        self.entries.fill(0.0);
        for (i, at) in self.diagonal.iter().enumerate() {
            self.entries[*at as usize] = match &system.masses {
                Masses::Same(m) => *m,
                Masses::Each(masses) => masses[i],
            };
        }
        for (list, places) in system.potentials.iter().zip(&self.places) {
            list.hessian(t, q, factor, places, &mut self.entries);
        }
        self.factors.factorise(&self.entries)
    }

    /// Whether x solves the system with right-hand side b to half of the digits. This is checked because faer does not
    /// report singular factors. Half of the digits suffice, since Newton's method corrects the remaining error.
    pub fn solves(&self, x: &[f64], b: &[f64], work: &mut [f64]) -> bool {
        let (left, size) = self.factors.residual(&self.entries, x, b, work);
        left <= f64::EPSILON.sqrt() * (size + max_abs_or_nan(b))
    }
}
