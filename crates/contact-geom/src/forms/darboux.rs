//! The canonical contact form of T\*Q x R, in Darboux coordinates.

use crate::{ChartVector, ContactForm, GeometryError, Scalar, Smooth};
use nalgebra::{DMatrix, SVector};

/// `eta = dz - p dq` on T\*Q x R, with Reeb field `d/dz`; paper, section 2.1.
#[derive(Clone, Copy, Debug)]
pub struct Darboux;

impl<const N: usize> Smooth<N> for Darboux {
    #[inline]
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        Ok(ChartVector { x: -x.y, y: SVector::from_fn(|_, _| T::zero()), z: T::one() })
    }
}

impl<const N: usize> ContactForm<N> for Darboux {
    fn eta(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        self.at(x)
    }

    fn d_eta(&self, _x: &ChartVector<N>) -> Result<DMatrix<f64>, GeometryError> {
        // dq ^ dp.
        Ok(DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match (i, j) {
            (i, j) if i < N && j == i + N => 1.0,
            (i, j) if j < N && i == j + N => -1.0,
            _ => 0.0,
        }))
    }

    fn volume(&self, _x: &ChartVector<N>) -> Result<f64, GeometryError> {
        Ok(canonical_volume(N))
    }

    fn reeb(&self, _x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        Ok(ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 1.0 })
    }

    fn flat(&self, x: &ChartVector<N>, v: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        // i_v (dq ^ dp) + eta(v) eta.
        let eta_v = v.z - x.y.dot(&v.x);
        Ok(ChartVector { x: -v.y - x.y * eta_v, y: v.x, z: eta_v })
    }

    fn sharp(&self, x: &ChartVector<N>, alpha: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        Ok(ChartVector { x: alpha.y, y: -alpha.x - x.y * alpha.z, z: alpha.z + x.y.dot(&alpha.y) })
    }
}

/// `eta ^ (d eta)^n` of the Darboux form on the coordinate vectors in the order `q, p, z`: `(-1)^(n(n-1)/2) n!`.
pub(crate) fn canonical_volume(n: usize) -> f64 {
    let factorial: f64 = (1..=n).map(|k| k as f64).product();
    if n % 4 < 2 { factorial } else { -factorial }
}
