//! The sparse matrix of a midpoint step, and its factors.

use super::factors::Factors;
use super::max_abs_or_nan;
use super::pattern::Pattern;
use crate::AssemblyError;
use crate::memory::limit;
use crate::system::{AssembledSystem, Masses};
use discrete_herglotz::StepError;

/// `M + (h^2/4) V_qq` by its entries that are not always zero: the pattern is found once.
pub(super) struct Sparse {
    pub factors: Factors,
    /// The entries of each list's elements.
    places: Vec<Vec<u32>>,
    diagonal: Vec<u32>,
    pub entries: Vec<f64>,
}

impl Sparse {
    /// Finds the pattern of a system; see [`AssembledMidpoint::new`](super::AssembledMidpoint::new) for `memory`.
    pub fn new(system: &AssembledSystem, memory: Option<usize>) -> Result<Self, AssemblyError> {
        let n = system.unknowns();
        let pattern = Pattern::new(n, |f| system.potentials.iter().for_each(|list| list.visit(f)))?;
        let places = system.potentials.iter().map(|list| list.entries(&pattern)).collect();
        let diagonal = (1..=n).map(|i| pattern.entry(i, i)).collect();
        let entries = vec![0.0; pattern.rows.len()];
        Ok(Sparse { factors: Factors::new(pattern, limit(memory))?, places, diagonal, entries })
    }

    /// Factorises it for positions between fixed places, with `factor = h^2/4`.
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

    /// Whether x solves for the right side b with the last factors: faer does not say where they are singular. Half of the digits are asked
    /// for: Newton's method makes up for the rest.
    pub fn solves(&self, x: &[f64], b: &[f64], work: &mut [f64]) -> bool {
        let (left, size) = self.factors.residual(&self.entries, x, b, work);
        left <= f64::EPSILON.sqrt() * (size + max_abs_or_nan(b))
    }
}
