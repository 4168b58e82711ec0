//! The coupling of all unknowns through the global action: a border of the sparse matrix, which is eliminated.

use super::gauss_table::{GaussTable, MAX_STAGES};
use super::lu::LuFactors;
use crate::derivatives::{FirstDerivatives, SecondDerivatives};
use contact_geom::nalgebra::{SMatrix, SVector};
use discrete_herglotz::StepError;

/// The number of unknowns of the border: the actions and the integrating factors of the stages.
const BORDER_SIZE: usize = 2 * MAX_STAGES;

/// The unknowns of the border: first the actions of the stages, then, from index [`MAX_STAGES`] on, their integrating
/// factors.
pub(crate) type BorderVector = SVector<f64, BORDER_SIZE>;

/// The bordered system `J x + B w = R`, `C x + D w = r` with a sparse, separately factorised J. It is solved with the
/// Schur complement `D - C J^-1 B`, so that J stays sparse.
pub(crate) struct Border {
    /// B; `J^-1 B` after `reduce`.
    columns: Vec<Vec<f64>>,
    /// C.
    rows: Vec<Vec<f64>>,
    corner: SMatrix<f64, BORDER_SIZE, BORDER_SIZE>,
    /// The inverse of the Schur complement.
    inverse: SMatrix<f64, BORDER_SIZE, BORDER_SIZE>,
    work: Vec<f64>,
}

impl Border {
    /// A border for the given number of stage velocities.
    pub fn new(len: usize) -> Self {
        let all = vec![vec![0.0; len]; BORDER_SIZE];
        let identity = SMatrix::identity();
        Border { columns: all.clone(), rows: all, corner: identity, inverse: identity, work: vec![0.0; len] }
    }

    /// Resets the border to zero, with the identity as its corner. The rows and columns of unused stages keep this
    /// form.
    pub fn clear(&mut self) {
        self.columns.iter_mut().chain(&mut self.rows).for_each(|x| x.fill(0.0));
        self.corner = SMatrix::identity();
    }

    /// Adds the contribution of the stage j to the linearised equations of the actions, `Z_i = z0 + h sum a_ij L_j`,
    /// and of the integrating factors, `rho_i = 1 - h sum a_ij rho_j (L_z)_j`.
    pub fn add_stage(
        &mut self,
        table: &GaussTable,
        j: usize,
        rho: f64,
        first: &FirstDerivatives,
        second: &SecondDerivatives,
    ) {
        let (s, a) = (table.s, &table.a);
        let of_factor = MAX_STAGES + j;
        for (u, (((qz, vz), q), v)) in second.qz.iter().zip(&second.vz).zip(&first.q).zip(&first.v).enumerate() {
            for i in 0..s {
                let delta = if i == j { 1.0 } else { 0.0 };
                self.columns[j][u * s + i] = rho * (delta * vz - a[i][j] * qz);
                self.columns[of_factor][u * s + i] = delta * v - a[i][j] * q;
                self.rows[i][u * s + j] -= a[i][j] * v;
                self.rows[MAX_STAGES + i][u * s + j] += a[i][j] * rho * vz;
                for k in 0..s {
                    self.rows[i][u * s + k] -= a[i][j] * a[j][k] * q;
                    self.rows[MAX_STAGES + i][u * s + k] += a[i][j] * a[j][k] * rho * qz;
                }
            }
        }
        for (i, row) in a.iter().enumerate().take(s) {
            self.corner[(i, j)] -= row[j] * first.z;
            self.corner[(MAX_STAGES + i, j)] += row[j] * rho * second.zz;
            self.corner[(MAX_STAGES + i, of_factor)] += row[j] * first.z;
        }
    }

    /// Eliminates the border with new factors of J.
    ///
    /// # Errors
    /// [`StepError::Singular`] if J or the Schur complement is singular.
    pub fn reduce(&mut self, s: usize, factors: &mut LuFactors) -> Result<(), StepError> {
        let Border { columns, rows, corner, inverse, work } = self;
        let used = |i: usize| i % MAX_STAGES < s;
        for (_, column) in columns.iter_mut().enumerate().filter(|(i, _)| used(*i)) {
            work.copy_from_slice(column);
            factors.solve(column)?;
            factors.check(column, work)?;
        }
        let complement =
            SMatrix::<f64, BORDER_SIZE, BORDER_SIZE>::from_fn(|i, j| corner[(i, j)] - dot(&rows[i], &columns[j]));
        let failed = StepError::Singular { pivot: 0.0 };
        *inverse = complement.try_inverse().ok_or(failed)?;
        if inverse.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(failed) }
    }

    /// Computes the solution from `J^-1 R`, given in `x`, and from `r`. Replaces `x` by its solution, and returns w.
    pub fn solve(&self, x: &mut [f64], r: &BorderVector) -> BorderVector {
        let w = self.inverse * BorderVector::from_fn(|i, _| r[i] - dot(&self.rows[i], x));
        for (column, w) in self.columns.iter().zip(w.iter()) {
            if *w != 0.0 {
                x.iter_mut().zip(column).for_each(|(x, c)| *x -= c * w);
            }
        }
        w
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
