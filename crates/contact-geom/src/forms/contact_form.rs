//! Contact forms, and the operations that eta and d eta determine at a point.

use crate::forms::smooth::apply_transposed;
use crate::{ChartVector, GeometryError, Smooth};
use nalgebra::{DMatrix, DVector};

/// A contact form on a manifold of dimension `2N + 1`, in a chart; paper, section 2.1.
///
/// Only `eta` and `d_eta` are required; volume, Reeb field, flat and sharp of any form are computed by the functions of
/// [`generic`], and a form with closed expressions for them overrides these methods.
pub trait ContactForm<const N: usize> {
    /// The covector `eta(x)`.
    ///
    /// # Errors
    /// A [`GeometryError`] where the form is not defined.
    fn eta(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError>;

    /// The two-form `d eta (x)` as the skew matrix `M_ij = d_i eta_j - d_j eta_i`, so that `d eta (u, w) = u . M w`.
    ///
    /// # Errors
    /// A [`GeometryError`] where the form is not defined.
    fn d_eta(&self, x: &ChartVector<N>) -> Result<DMatrix<f64>, GeometryError>;

    /// The volume `eta ^ (d eta)^n` on the coordinate vectors; the form is contact exactly where it does not vanish.
    ///
    /// # Errors
    /// Those of [`eta`](Self::eta).
    fn volume(&self, x: &ChartVector<N>) -> Result<f64, GeometryError> {
        generic::volume(self, x)
    }

    /// The Reeb field: `i_R d eta = 0` and `eta(R) = 1`.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where the form is not contact.
    fn reeb(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        generic::reeb(self, x)
    }

    /// The covector `flat(v) = i_v d eta + eta(v) eta`.
    ///
    /// # Errors
    /// Those of [`eta`](Self::eta).
    fn flat(&self, x: &ChartVector<N>, v: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        generic::flat(self, x, v)
    }

    /// The vector `sharp(alpha)`, the inverse of [`flat`](Self::flat).
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where the form is not contact.
    fn sharp(&self, x: &ChartVector<N>, alpha: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        generic::sharp(self, x, alpha)
    }
}

impl<const N: usize, F: ContactForm<N>> ContactForm<N> for &F {
    fn eta(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        (**self).eta(x)
    }
    fn d_eta(&self, x: &ChartVector<N>) -> Result<DMatrix<f64>, GeometryError> {
        (**self).d_eta(x)
    }
    fn volume(&self, x: &ChartVector<N>) -> Result<f64, GeometryError> {
        (**self).volume(x)
    }
    fn reeb(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        (**self).reeb(x)
    }
    fn flat(&self, x: &ChartVector<N>, v: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        (**self).flat(x, v)
    }
    fn sharp(&self, x: &ChartVector<N>, alpha: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        (**self).sharp(x, alpha)
    }
}

/// A contact form given by its components as a generic function; `d eta` is found by automatic differentiation.
#[derive(Clone, Copy, Debug)]
pub struct Form<S>(pub S);

impl<const N: usize, S: Smooth<N>> ContactForm<N> for Form<S> {
    fn eta(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        self.0.at(x)
    }

    fn d_eta(&self, x: &ChartVector<N>) -> Result<DMatrix<f64>, GeometryError> {
        let (_, jacobian) = self.0.with_jacobian(x)?;
        Ok(jacobian.transpose() - jacobian)
    }
}

/// The operations that eta and d eta at a point determine, for any contact form. Closed expressions are tested against
/// them.
pub mod generic {
    use super::*;

    /// The volume `eta ^ (d eta)^n` on the coordinate vectors, as `n!` times the Pfaffian of `d eta` bordered by `eta`.
    ///
    /// # Errors
    /// Those of the form.
    pub fn volume<const N: usize>(
        form: &(impl ContactForm<N> + ?Sized),
        x: &ChartVector<N>,
    ) -> Result<f64, GeometryError> {
        let (eta, d_eta) = (form.eta(x)?, form.d_eta(x)?);
        let bordered = DMatrix::from_fn(2 * N + 2, 2 * N + 2, |i, j| match (i, j) {
            (0, 0) => 0.0,
            (0, j) => eta.component(j - 1),
            (i, 0) => -eta.component(i - 1),
            (i, j) => d_eta[(i - 1, j - 1)],
        });
        let factorial: f64 = (1..=N).map(|k| k as f64).product();
        Ok(factorial * pfaffian(bordered))
    }

    /// The matrix of [`flat`]: `flat(v) = (M + eta eta^T)^T v`.
    fn flat_matrix<const N: usize>(
        form: &(impl ContactForm<N> + ?Sized),
        x: &ChartVector<N>,
    ) -> Result<DMatrix<f64>, GeometryError> {
        let eta: DVector<f64> = form.eta(x)?.to_vector();
        Ok(form.d_eta(x)? + &eta * eta.transpose())
    }

    /// The covector `i_v d eta + eta(v) eta`.
    ///
    /// # Errors
    /// Those of the form.
    pub fn flat<const N: usize>(
        form: &(impl ContactForm<N> + ?Sized),
        x: &ChartVector<N>,
        v: &ChartVector<N>,
    ) -> Result<ChartVector<N>, GeometryError> {
        Ok(apply_transposed(&flat_matrix(form, x)?, v))
    }

    /// The vector whose [`flat`] is `alpha`, by a linear solve.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where the form is not contact.
    pub fn sharp<const N: usize>(
        form: &(impl ContactForm<N> + ?Sized),
        x: &ChartVector<N>,
        alpha: &ChartVector<N>,
    ) -> Result<ChartVector<N>, GeometryError> {
        let solution = flat_matrix(form, x)?.transpose().lu().solve(&alpha.to_vector());
        match solution {
            Some(v) if v.iter().all(|c| c.is_finite()) => Ok(ChartVector::from_fn(|i| v[i])),
            _ => Err(GeometryError::Singular {
                what: "flat",
                pivot: 0.0,
                remedy: "the form is not contact at this point; choose a point where eta ^ (d eta)^n does not vanish",
            }),
        }
    }

    /// The Reeb field as `sharp(eta)`.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where the form is not contact.
    pub fn reeb<const N: usize>(
        form: &(impl ContactForm<N> + ?Sized),
        x: &ChartVector<N>,
    ) -> Result<ChartVector<N>, GeometryError> {
        sharp(form, x, &form.eta(x)?)
    }

    /// The Pfaffian of a skew matrix of even dimension, by skew elimination with pivoting (Parlett and Reid).
    fn pfaffian(mut a: DMatrix<f64>) -> f64 {
        let n = a.nrows();
        let mut pfaffian = 1.0;
        for k in (0..n).step_by(2) {
            let Some(pivot) = (k + 1..n).max_by(|&i, &j| a[(k, i)].abs().total_cmp(&a[(k, j)].abs())) else {
                return pfaffian;
            };
            if pivot != k + 1 {
                a.swap_rows(k + 1, pivot);
                a.swap_columns(k + 1, pivot);
                pfaffian = -pfaffian;
            }
            let head = a[(k, k + 1)];
            pfaffian *= head;
            if head == 0.0 {
                return 0.0;
            }
            for i in k + 2..n {
                for j in k + 2..n {
                    a[(i, j)] += (a[(k + 1, i)] * a[(k, j)] - a[(k, i)] * a[(k + 1, j)]) / head;
                }
            }
        }
        pfaffian
    }
}
