//! Quadratic forms in (q, p) with linear drag.

use super::ContactPiece;
use crate::hamiltonian::ContactIncrement;
use crate::hamiltonian::matrix_exponential::exponential_minus_one;
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::numbers::dot;
use contact_geom::{ContactHamiltonian, PhasePoint, Scalar};

/// The piece `H = q . A q/2 + q . B p + p . C p/2 - gamma z` with constant matrices: small oscillations with drag, with
/// or without gyroscopic terms.
///
/// The flow is linear in `x = (q, p)`, `x1 = E x0` with a conformally symplectic matrix, `E^T J E = sigma J`,
/// `sigma = e^(gamma tau)`. The action follows from `dz1 - p1 dq1 = sigma (dz0 - p0 dq0)` without an integral:
///
/// `z1 = sigma z0 + x0 . M x0/2`, `M = E_p^T E_q - sigma e_p^T e_q`,
///
/// where `E_q`, `E_p` are the rows of E for q and for p, and `e_q`, `e_p` those of the identity. M is symmetric because
/// E is conformally symplectic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadratic<const N: usize> {
    qq: SMatrix<f64, N, N>,
    qp: SMatrix<f64, N, N>,
    pp: SMatrix<f64, N, N>,
    gamma: f64,
}

/// The map of [`Quadratic`] over a time: `E - 1`, `sigma - 1` and M by blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticMap<const N: usize> {
    /// The rows of `E - 1` for q.
    pub(crate) to_q: [SMatrix<f64, N, N>; 2],
    /// The rows of `E - 1` for p.
    pub(crate) to_p: [SMatrix<f64, N, N>; 2],
    /// The blocks qq, qp and pp of M.
    action: [SMatrix<f64, N, N>; 3],
    /// `sigma - 1`.
    pub(crate) growth: f64,
}

impl<const N: usize> Quadratic<N> {
    /// The piece with the matrices A, B and C of the formula; only the symmetric parts of A and C enter.
    pub fn new(qq: SMatrix<f64, N, N>, qp: SMatrix<f64, N, N>, pp: SMatrix<f64, N, N>, gamma: f64) -> Self {
        Quadratic { qq: (qq + qq.transpose()) * 0.5, qp, pp: (pp + pp.transpose()) * 0.5, gamma }
    }
}

/// `m x` for a matrix of numbers.
fn times<T: Scalar, const N: usize>(m: &SMatrix<f64, N, N>, x: &SVector<T, N>) -> SVector<T, N> {
    SVector::from_fn(|i, _| (0..N).fold(T::zero(), |sum, j| sum + x[j] * m[(i, j)]))
}

impl<const N: usize> ContactHamiltonian<N> for Quadratic<N> {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let (of_q, of_p) = (times(&self.qq, q), times(&self.pp, p));
        (dot(q, of_q) + dot(p, of_p)) * 0.5 + q.dot(&times(&self.qp, p)) - z * self.gamma
    }
}

impl<const N: usize> ContactPiece<N> for Quadratic<N> {
    type Map = QuadraticMap<N>;

    fn over(&self, tau: f64) -> QuadraticMap<N> {
        let mut m = DMatrix::zeros(2 * N, 2 * N);
        for i in 0..N {
            for j in 0..N {
                m[(i, j)] = self.qp[(j, i)] * tau;
                m[(i, N + j)] = self.pp[(i, j)] * tau;
                m[(N + i, j)] = -self.qq[(i, j)] * tau;
                m[(N + i, N + j)] = (if i == j { self.gamma } else { 0.0 } - self.qp[(i, j)]) * tau;
            }
        }
        let e = exponential_minus_one(&m);
        let block = |i0: usize, j0: usize| SMatrix::<f64, N, N>::from_fn(|i, j| e[(i0 + i, j0 + j)]);
        let (to_q, to_p) = ([block(0, 0), block(0, N)], [block(N, 0), block(N, N)]);
        // Written with `E - 1`, so that nothing cancels where tau is small.
        let action = [
            to_p[0].transpose() * (SMatrix::identity() + to_q[0]),
            to_p[0].transpose() * to_q[1],
            to_q[1] + to_p[1].transpose() * to_q[1],
        ];
        QuadraticMap { to_q, to_p, action, growth: (self.gamma * tau).exp_m1() }
    }

    fn change<T: Scalar>(&self, map: &QuadraticMap<N>, _t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T> {
        let [qq, qp, pp] = &map.action;
        let square = (x.q.dot(&times(qq, &x.q)) + x.p.dot(&times(pp, &x.p))) * 0.5 + x.q.dot(&times(qp, &x.p));
        ContactIncrement {
            q: times(&map.to_q[0], &x.q) + times(&map.to_q[1], &x.p),
            p: times(&map.to_p[0], &x.q) + times(&map.to_p[1], &x.p),
            z: x.z * map.growth + square,
            sigma_minus_one: T::from(map.growth),
        }
    }
}
