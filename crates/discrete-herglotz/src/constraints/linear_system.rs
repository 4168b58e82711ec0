//! Linear systems of a size that is known at run time, factorised once and solved for any numbers.

use crate::StepError;
use contact_geom::Scalar;

/// A square matrix with its LU factorisation by partial pivoting, rows scaled to their largest entry, since momenta and
/// constraints have different units. The memory is allocated once.
#[derive(Clone, Debug)]
pub(super) struct LinearSystem {
    n: usize,
    entries: Vec<f64>,
    scales: Vec<f64>,
    rows: Vec<usize>,
}

impl LinearSystem {
    pub fn new(n: usize) -> Self {
        LinearSystem { n, entries: vec![0.0; n * n], scales: vec![1.0; n], rows: vec![0; n] }
    }

    /// Sets all entries to 0.
    pub fn clear(&mut self) {
        self.entries.fill(0.0);
    }

    /// Adds to an entry.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.entries[row * self.n + column] += value;
    }

    /// Factorises the matrix in place.
    pub fn factorise(&mut self) -> Result<(), StepError> {
        let n = self.n;
        for i in 0..n {
            let row = &self.entries[i * n..(i + 1) * n];
            let largest = contact_geom::numbers::max_abs_or_nan(row.iter().copied());
            if !largest.is_finite() {
                return Err(StepError::NonFinite);
            }
            if largest == 0.0 {
                return Err(StepError::Singular { pivot: 0.0 });
            }
            self.scales[i] = largest.recip();
            self.entries[i * n..(i + 1) * n].iter_mut().for_each(|e| *e /= largest);
        }
        for k in 0..n {
            let mut row = k;
            for i in k + 1..n {
                if self.entries[i * n + k].abs() > self.entries[row * n + k].abs() {
                    row = i;
                }
            }
            self.rows[k] = row;
            let pivot = self.entries[row * n + k];
            // Below the round-off of the scaled rows a pivot is noise.
            if pivot.is_nan() || pivot.abs() <= n as f64 * f64::EPSILON * f64::EPSILON {
                return Err(StepError::Singular { pivot: pivot.abs() });
            }
            if row != k {
                for j in 0..n {
                    self.entries.swap(k * n + j, row * n + j);
                }
            }
            for i in k + 1..n {
                let factor = self.entries[i * n + k] / pivot;
                self.entries[i * n + k] = factor;
                for j in k + 1..n {
                    self.entries[i * n + j] -= factor * self.entries[k * n + j];
                }
            }
        }
        Ok(())
    }

    /// Replaces the right-hand side by the solution.
    pub fn solve<T: Scalar>(&self, b: &mut [T]) {
        let n = self.n;
        for (b, scale) in b.iter_mut().zip(&self.scales) {
            *b = *b * *scale;
        }
        for k in 0..n {
            b.swap(k, self.rows[k]);
        }
        for i in 0..n {
            let (row, (before, rest)) = (&self.entries[i * n..], b.split_at_mut(i));
            before.iter().zip(row).for_each(|(b, entry)| rest[0] -= *b * *entry);
        }
        for i in (0..n).rev() {
            let (row, (before, rest)) = (&self.entries[i * n..(i + 1) * n], b.split_at_mut(i + 1));
            rest.iter().zip(&row[i + 1..]).for_each(|(b, entry)| before[i] -= *b * *entry);
            before[i] = before[i] / row[i];
        }
    }
}
