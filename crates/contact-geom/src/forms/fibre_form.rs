//! Forms `dz - P(x, y, z) dx`, the pullbacks of Darboux' form along fibre maps: eta_L and eta-.

use crate::forms::darboux::canonical_volume;
use crate::support::linear::solve;
use crate::{ChartVector, GeometryError};
use nalgebra::{DMatrix, SMatrix, SVector};

/// The one-form `eta = dz - P dx` at a point, with the derivatives of `P(x, y, z)` there.
///
/// It is the pullback of Darboux' form along `(x, y, z) -> (x, P, z)`, and contact exactly where `dP/dy` is regular.
/// With `P = L_v` it is eta_L on TQ x R; with `P = -D1 L_d / (1 + Dz L_d)` it is eta- on Q x Q x R.
pub(crate) struct FibreForm<const N: usize> {
    /// The momentum `P`.
    pub p: SVector<f64, N>,
    /// `dP_i / dx_j`.
    pub p_x: SMatrix<f64, N, N>,
    /// `dP_i / dy_j`.
    pub p_y: SMatrix<f64, N, N>,
    /// `dP_i / dz`.
    pub p_z: SVector<f64, N>,
    /// The usual name of `dP/dy`, for errors.
    pub what: &'static str,
}

/// The suggestion for the caller where the fibre derivative is singular.
const REMEDY: &str = "the form is not contact here; choose a regular Lagrangian, or a point where it is regular";

impl<const N: usize> FibreForm<N> {
    pub fn eta(&self) -> ChartVector<N> {
        ChartVector { x: -self.p, y: SVector::zeros(), z: 1.0 }
    }

    /// `-dP ^ dx = dx ^ dP`.
    pub fn d_eta(&self) -> DMatrix<f64> {
        DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match (i, j) {
            (i, j) if i < N && j < N => self.p_x[(i, j)] - self.p_x[(j, i)],
            (i, j) if i < N && j < 2 * N => self.p_y[(i, j - N)],
            (i, j) if j < N && i < 2 * N => -self.p_y[(j, i - N)],
            (i, _) if i < N => self.p_z[i],
            (_, j) if j < N => -self.p_z[j],
            _ => 0.0,
        })
    }

    pub fn volume(&self) -> f64 {
        let fibre = DMatrix::from_fn(N, N, |i, j| self.p_y[(i, j)]);
        canonical_volume(N) * fibre.determinant()
    }

    /// `R = d/dz - (P_y)^-1 P_z d/dy`.
    pub fn reeb(&self) -> Result<ChartVector<N>, GeometryError> {
        let mut y = -self.p_z;
        solve(&mut self.p_y.clone_owned(), &mut y).map_err(|e| e.of(self.what, REMEDY))?;
        Ok(ChartVector { x: SVector::zeros(), y, z: 1.0 })
    }

    pub fn flat(&self, v: &ChartVector<N>) -> ChartVector<N> {
        let eta_v = v.z - self.p.dot(&v.x);
        let dp_v = self.p_x * v.x + self.p_y * v.y + self.p_z * v.z;
        ChartVector {
            x: self.p_x.tr_mul(&v.x) - dp_v - self.p * eta_v,
            y: self.p_y.tr_mul(&v.x),
            z: self.p_z.dot(&v.x) + eta_v,
        }
    }

    /// Solves `flat(v) = alpha` block by block: `v_x` from the second block, `eta(v)` from the third, `v_y` from the
    /// first.
    pub fn sharp(&self, alpha: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        let mut x = alpha.y;
        solve(&mut self.p_y.transpose(), &mut x).map_err(|e| e.of(self.what, REMEDY))?;
        let eta_v = alpha.z - self.p_z.dot(&x);
        let z = eta_v + self.p.dot(&x);
        let mut y = self.p_x.tr_mul(&x) - alpha.x - self.p * eta_v - self.p_x * x - self.p_z * z;
        solve(&mut self.p_y.clone_owned(), &mut y).map_err(|e| e.of(self.what, REMEDY))?;
        Ok(ChartVector { x, y, z })
    }
}

/// Implements the methods of [`ContactForm`](crate::ContactForm) by those of the [`FibreForm`] at a point.
macro_rules! contact_form_by_fibre {
    () => {
        fn eta(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
            Ok(self.fibre_form(x)?.eta())
        }
        fn d_eta(&self, x: &ChartVector<N>) -> Result<DMatrix<f64>, GeometryError> {
            Ok(self.fibre_form(x)?.d_eta())
        }
        fn volume(&self, x: &ChartVector<N>) -> Result<f64, GeometryError> {
            Ok(self.fibre_form(x)?.volume())
        }
        fn reeb(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
            self.fibre_form(x)?.reeb()
        }
        fn flat(&self, x: &ChartVector<N>, v: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
            Ok(self.fibre_form(x)?.flat(v))
        }
        fn sharp(&self, x: &ChartVector<N>, alpha: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
            self.fibre_form(x)?.sharp(alpha)
        }
    };
}
pub(crate) use contact_form_by_fibre;
