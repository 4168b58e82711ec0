//! The rank of a Jacobian, and the combinations of parameters that data do not determine.

use nalgebra::{DMatrix, DVector};
use std::fmt::{Display, Formatter};

/// Combinations of parameters along which the model does not change, to first order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NullSpace {
    /// The rank of the Jacobian.
    pub rank: usize,
    /// The number of its columns: the parameters that are not held at a bound.
    pub parameters: usize,
    /// A basis of the null space, with as few parameters in each direction as elimination gives.
    pub directions: Vec<NullDirection>,
}

/// A direction in the space of parameters along which the model does not change, to first order.
#[derive(Clone, Debug, PartialEq)]
pub struct NullDirection {
    /// The parameters that change, with their changes relative to one another.
    pub changes: Vec<(String, f64)>,
}

impl Display for NullSpace {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "the Jacobian has rank {} of {}", self.rank, self.parameters)?;
        for (k, direction) in self.directions.iter().enumerate() {
            write!(f, "{} {direction}", if k == 0 { "; the model does not change with" } else { ", with" })?;
        }
        Ok(())
    }
}

/// `a`, or `a : b = 1 : -0.5`.
impl Display for NullDirection {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let names: Vec<_> = self.changes.iter().map(|(name, _)| format!("`{name}`")).collect();
        write!(f, "{}", names.join(" : "))?;
        if self.changes.len() > 1 {
            let numbers: Vec<_> = self.changes.iter().map(|(_, change)| format!("{change:.4}")).collect();
            write!(f, " = {}", numbers.join(" : "))?;
        }
        Ok(())
    }
}

/// A Jacobian with columns scaled to norm 1: its singular values and right singular vectors.
#[derive(Clone, Debug)]
pub(crate) struct ScaledSvd {
    /// The norms of the columns; 1 for a column of zeros.
    norms: DVector<f64>,
    singular_values: DVector<f64>,
    /// The singular vectors, as rows.
    v_t: DMatrix<f64>,
    rank: usize,
}

/// Components of null vectors below this, in scaled parameters, are the round-off of the elimination.
const LEAST_COMPONENT: f64 = 1e-6;

impl ScaledSvd {
    /// `None` where the singular values do not converge, which finite matrices should not do.
    pub fn new(mut jacobian: DMatrix<f64>, rank_tolerance: f64) -> Option<Self> {
        const MAX_ITERATIONS_PER_COLUMN: usize = 1000;
        let n = jacobian.ncols();
        if n == 0 {
            let (singular_values, v_t) = (DVector::zeros(0), DMatrix::zeros(0, 0));
            return Some(ScaledSvd { norms: singular_values.clone(), singular_values, v_t, rank: 0 });
        }
        let norms = DVector::from_iterator(n, jacobian.column_iter().map(|c| c.norm()));
        let norms = norms.map(|norm| if norm == 0.0 { 1.0 } else { norm });
        for (mut column, norm) in jacobian.column_iter_mut().zip(&norms) {
            column /= *norm;
        }
        let r = jacobian.qr().r().resize_vertically(n, 0.0);
        let svd = r.try_svd(false, true, f64::EPSILON, MAX_ITERATIONS_PER_COLUMN * n)?;
        let singular_values = svd.singular_values;
        let largest = singular_values.iter().copied().fold(0.0, f64::max);
        if !singular_values.iter().all(|s| s.is_finite()) {
            return None;
        }
        let rank = singular_values.iter().filter(|s| **s > rank_tolerance * largest).count();
        Some(ScaledSvd { norms, singular_values, v_t: svd.v_t?, rank })
    }

    pub fn rank(&self) -> usize {
        self.rank
    }

    /// `(J^T J)^-1`, where J has full rank.
    pub fn normal_inverse(&self) -> Option<DMatrix<f64>> {
        let n = self.norms.len();
        (self.rank == n).then(|| {
            let scaled = DMatrix::from_fn(n, n, |k, j| self.v_t[(k, j)] / (self.singular_values[k] * self.norms[j]));
            scaled.tr_mul(&scaled)
        })
    }

    /// The null space in terms of the parameters with these names.
    pub fn null_space(&self, names: &[String]) -> NullSpace {
        let n = self.norms.len();
        // nalgebra sorts the singular values.
        let mut rows = self.v_t.rows(self.rank, n - self.rank).into_owned();
        eliminate(&mut rows);
        let directions = rows.row_iter().map(|row| {
            let changes: Vec<_> = (0..n).filter(|j| row[*j].abs() > LEAST_COMPONENT).map(|j| (j, row[j])).collect();
            // The first parameter changes by 1.
            let unit = changes.first().map_or(1.0, |(j, c)| c / self.norms[*j]);
            let change = |(j, c): &(usize, f64)| (names[*j].clone(), c / self.norms[*j] / unit);
            NullDirection { changes: changes.iter().map(change).collect() }
        });
        NullSpace { rank: self.rank, parameters: n, directions: directions.collect() }
    }
}

/// Reduced row echelon form with complete pivoting: a basis whose vectors have few components.
fn eliminate(rows: &mut DMatrix<f64>) {
    for i in 0..rows.nrows() {
        let (mut pivot, mut largest) = ((i, 0), 0.0);
        for r in i..rows.nrows() {
            for c in 0..rows.ncols() {
                if rows[(r, c)].abs() > largest {
                    (pivot, largest) = ((r, c), rows[(r, c)].abs());
                }
            }
        }
        if largest == 0.0 {
            return;
        }
        rows.swap_rows(i, pivot.0);
        let unit = rows.row(i) / rows[(i, pivot.1)];
        rows.row_mut(i).copy_from(&unit);
        for r in (0..rows.nrows()).filter(|r| *r != i) {
            let factor = rows[(r, pivot.1)];
            let mut row = rows.row_mut(r);
            row -= &unit * factor;
            // Exactly, so that the next pivot is elsewhere.
            row[pivot.1] = 0.0;
        }
    }
}
