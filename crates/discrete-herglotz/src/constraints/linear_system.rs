//! Linear systems that are factorised once and solved for any numbers.

use crate::StepError;
use contact_geom::Scalar;
use contact_geom::nalgebra::SMatrix;

/// A square matrix of a size that is known at run time, with its LU factorisation by partial pivoting, rows scaled to
/// their largest entry, since momenta and constraints have different units. The memory is allocated once.
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
        factorise(&mut self.entries, &mut self.scales, &mut self.rows)
    }

    /// Replaces the right-hand side by the solution.
    pub fn solve<T: Scalar>(&self, b: &mut [T]) {
        solve(&self.entries, &self.scales, &self.rows, b);
    }
}

/// The same for a size of at most N, without memory of its own.
pub(super) struct SmallSystem<const N: usize> {
    n: usize,
    entries: [[f64; N]; N],
    scales: [f64; N],
    rows: [usize; N],
}

impl<const N: usize> SmallSystem<N> {
    /// Factorises the first n rows and columns of a matrix.
    pub fn new(matrix: &SMatrix<f64, N, N>, n: usize) -> Result<Self, StepError> {
        let mut system = SmallSystem { n, entries: [[0.0; N]; N], scales: [1.0; N], rows: [0; N] };
        let entries = &mut system.entries.as_flattened_mut()[..n * n];
        entries.iter_mut().enumerate().for_each(|(k, entry)| *entry = matrix[(k / n, k % n)]);
        factorise(entries, &mut system.scales[..n], &mut system.rows[..n])?;
        Ok(system)
    }

    /// Replaces the first n entries of a right-hand side by the solution.
    pub fn solve<T: Scalar>(&self, b: &mut [T]) {
        let n = self.n;
        solve(&self.entries.as_flattened()[..n * n], &self.scales[..n], &self.rows[..n], &mut b[..n]);
    }
}

/// Factorises a matrix that is given by rows.
fn factorise(entries: &mut [f64], scales: &mut [f64], rows: &mut [usize]) -> Result<(), StepError> {
    let n = rows.len();
    for i in 0..n {
        let row = &mut entries[i * n..(i + 1) * n];
        let largest = contact_geom::numbers::max_abs_or_nan(row.iter().copied());
        if !largest.is_finite() {
            return Err(StepError::NonFinite);
        }
        if largest == 0.0 {
            return Err(StepError::Singular { pivot: 0.0 });
        }
        scales[i] = largest.recip();
        row.iter_mut().for_each(|e| *e /= largest);
    }
    for k in 0..n {
        let mut row = k;
        for i in k + 1..n {
            if entries[i * n + k].abs() > entries[row * n + k].abs() {
                row = i;
            }
        }
        rows[k] = row;
        let pivot = entries[row * n + k];
        // Below the round-off of the scaled rows a pivot is noise.
        if pivot.is_nan() || pivot.abs() <= n as f64 * f64::EPSILON * f64::EPSILON {
            return Err(StepError::Singular { pivot: pivot.abs() });
        }
        if row != k {
            for j in 0..n {
                entries.swap(k * n + j, row * n + j);
            }
        }
        for i in k + 1..n {
            let factor = entries[i * n + k] / pivot;
            entries[i * n + k] = factor;
            // Entries that vanish, as those of constraints that are not there, change nothing.
            if factor != 0.0 {
                for j in k + 1..n {
                    entries[i * n + j] -= factor * entries[k * n + j];
                }
            }
        }
    }
    Ok(())
}

/// Replaces the right-hand side of a system in factors by the solution.
fn solve<T: Scalar>(entries: &[f64], scales: &[f64], rows: &[usize], b: &mut [T]) {
    let n = rows.len();
    for (b, scale) in b.iter_mut().zip(scales) {
        *b = *b * *scale;
    }
    for (k, row) in rows.iter().enumerate() {
        b.swap(k, *row);
    }
    for i in 0..n {
        let (row, (before, rest)) = (&entries[i * n..], b.split_at_mut(i));
        before.iter().zip(row).for_each(|(b, entry)| rest[0] -= *b * *entry);
    }
    for i in (0..n).rev() {
        let (row, (before, rest)) = (&entries[i * n..(i + 1) * n], b.split_at_mut(i + 1));
        rest.iter().zip(&row[i + 1..]).for_each(|(b, entry)| before[i] -= *b * *entry);
        before[i] = before[i] / row[i];
    }
}
