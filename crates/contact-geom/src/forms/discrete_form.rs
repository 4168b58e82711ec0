//! The contact forms eta+ and eta- of a discrete Lagrangian on Q x Q x R.

use crate::forms::fibre_form::{FibreForm, contact_form_by_fibre};
use crate::support::linear::solve;
use crate::{ChartVector, ContactForm, DiscretePoint, GeometryError, Regularity};
use nalgebra::{DMatrix, SMatrix, SVector};

/// A discrete Lagrangian's value and first derivatives at a point `(q0, q1, z0)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteJet<const N: usize> {
    /// `L_d`.
    pub value: f64,
    /// `D1 L_d`, the derivative in `q0`.
    pub d1: SVector<f64, N>,
    /// `D2 L_d`, the derivative in `q1`.
    pub d2: SVector<f64, N>,
    /// `Dz L_d`, the derivative in `z0`.
    pub dz: f64,
    /// `sigma_d = 1 + Dz L_d`, the conformal factor of the step. It is stored separately, since `1 + dz` has lost its
    /// digits where the drag is strong.
    sigma: f64,
}

impl<const N: usize> DiscreteJet<N> {
    /// The jet with these derivatives, and `sigma_d = 1 + dz`.
    #[inline(always)]
    pub fn new(value: f64, d1: SVector<f64, N>, d2: SVector<f64, N>, dz: f64) -> Self {
        DiscreteJet { value, d1, d2, dz, sigma: 1.0 + dz }
    }

    /// The jet with a `sigma_d` that is more accurate than `1 + dz`.
    #[inline(always)]
    pub fn with_sigma(self, sigma: f64) -> Self {
        DiscreteJet { sigma, ..self }
    }

    /// `sigma_d = 1 + Dz L_d`, the conformal factor of the step.
    #[inline(always)]
    pub fn sigma(&self) -> f64 {
        self.sigma
    }
}

/// A discrete Lagrangian's value, first and second derivatives at a point `(q0, q1, z0)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondDiscreteJet<const N: usize> {
    /// Value and first derivatives.
    pub first: DiscreteJet<N>,
    /// `d2 / dq0_i dq0_j`.
    pub d11: SMatrix<f64, N, N>,
    /// `d2 / dq0_i dq1_j`.
    pub d12: SMatrix<f64, N, N>,
    /// `d2 / dq1_i dq1_j`.
    pub d22: SMatrix<f64, N, N>,
    /// `d2 / dq0_i dz0`.
    pub d1z: SVector<f64, N>,
    /// `d2 / dq1_i dz0`.
    pub d2z: SVector<f64, N>,
    /// `d2 / dz0^2`.
    pub dzz: f64,
}

impl<const N: usize> SecondDiscreteJet<N> {
    /// The momentum `p0 = -D1 L_d / sigma_d` of F-L_d with its derivatives, from `sigma_d p0 = -D1 L_d`.
    fn start_momentum(&self) -> FibreForm<N> {
        let sigma = self.first.sigma();
        let p = -self.first.d1 / sigma;
        FibreForm {
            p,
            p_x: -(self.d11 + p * self.d1z.transpose()) / sigma,
            p_y: -(self.d12 + p * self.d2z.transpose()) / sigma,
            p_z: -(self.d1z + p * self.dzz) / sigma,
            what: "the derivative of F-L_d in q1",
        }
    }

    /// The linearisation of `F-L_d : (q0, q1, z0) -> (q0, -D1 L_d / sigma_d, z0)`; paper, section 3.1.
    pub fn legendre_minus_jacobian(&self) -> DMatrix<f64> {
        let p0 = self.start_momentum();
        DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match (i, j) {
            (i, j) if i >= N && i < 2 * N => match j {
                _ if j < N => p0.p_x[(i - N, j)],
                _ if j < 2 * N => p0.p_y[(i - N, j - N)],
                _ => p0.p_z[i - N],
            },
            (i, j) if i == j => 1.0,
            _ => 0.0,
        })
    }

    /// The linearisation of `F+L_d : (q0, q1, z0) -> (q1, D2 L_d, z0 + L_d)`; paper, section 3.1.
    pub fn legendre_plus_jacobian(&self) -> DMatrix<f64> {
        DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match (i, j) {
            (i, j) if i < N => f64::from(u8::from(j == i + N)),
            (i, j) if i < 2 * N => match j {
                _ if j < N => self.d12[(j, i - N)],
                _ if j < 2 * N => self.d22[(i - N, j - N)],
                _ => self.d2z[i - N],
            },
            (_, j) if j < N => self.first.d1[j],
            (_, j) if j < 2 * N => self.first.d2[j - N],
            _ => self.first.sigma(),
        })
    }

    /// The regularity of F-L_d at this point: the singular values of its derivative in `q1`. F-L_d is a local
    /// diffeomorphism where the smallest does not vanish.
    pub fn regularity(&self) -> Regularity {
        let fibre = self.start_momentum().p_y;
        Regularity::of(DMatrix::from_fn(N, N, |i, j| fibre[(i, j)]))
    }
}

/// The form `eta- = (F-L_d)^* eta = dz0 + D1 L_d / (1 + Dz L_d) dq0`; paper, section 3.1.
///
/// The tuple field is a function that returns the second jet of `L_d` at a point.
#[derive(Clone, Copy, Debug)]
pub struct EtaMinus<F>(pub F);

impl<F> EtaMinus<F> {
    fn fibre_form<const N: usize>(&self, x: &ChartVector<N>) -> Result<FibreForm<N>, GeometryError>
    where
        F: Fn(&DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, GeometryError>,
    {
        Ok((self.0)(&(*x).into())?.start_momentum())
    }
}

impl<const N: usize, F> ContactForm<N> for EtaMinus<F>
where
    F: Fn(&DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, GeometryError>,
{
    contact_form_by_fibre!();
}

/// The form `eta+ = (F+L_d)^* eta = (1 + Dz L_d) dz0 + D1 L_d dq0 = sigma_d eta-`; paper, section 3.1.
///
/// The tuple field is a function that returns the second jet of `L_d` at a point.
#[derive(Clone, Copy, Debug)]
pub struct EtaPlus<F>(pub F);

impl<const N: usize, F> ContactForm<N> for EtaPlus<F>
where
    F: Fn(&DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, GeometryError>,
{
    fn eta(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        let jet = (self.0)(&(*x).into())?.first;
        Ok(ChartVector { x: jet.d1, y: SVector::zeros(), z: jet.sigma() })
    }

    fn d_eta(&self, x: &ChartVector<N>) -> Result<DMatrix<f64>, GeometryError> {
        // The differential of d(z0 + L_d) - D2 dq1 is dq1 ^ d(D2).
        let jet = (self.0)(&(*x).into())?;
        Ok(DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match (i, j) {
            (i, j) if i < N && j >= N && j < 2 * N => -jet.d12[(i, j - N)],
            (i, j) if j < N && i >= N && i < 2 * N => jet.d12[(j, i - N)],
            (i, j) if i >= N && i < 2 * N && j == 2 * N => jet.d2z[i - N],
            (i, j) if j >= N && j < 2 * N && i == 2 * N => -jet.d2z[j - N],
            _ => 0.0,
        }))
    }

    fn volume(&self, x: &ChartVector<N>) -> Result<f64, GeometryError> {
        // eta+ = sigma eta-, and a volume of degree n + 1 in eta scales by sigma^(n+1).
        let sigma = (self.0)(&(*x).into())?.first.sigma();
        Ok(EtaMinus(&self.0).volume(x)? * sigma.powi(N as i32 + 1))
    }

    /// `R+` leaves `q1` and `D2 L_d` unchanged: `R+ = (a, 0, c)` with `D21 a + D2z c = 0` and `D1 a + sigma_d c = 1`.
    fn reeb(&self, x: &ChartVector<N>) -> Result<ChartVector<N>, GeometryError> {
        let jet = (self.0)(&(*x).into())?;
        let mut a = -jet.d2z;
        solve(&mut jet.d12.transpose(), &mut a).map_err(|e| {
            e.of("D1 D2 L_d", "the discrete Lagrangian is not regular here; take a smaller step or another point")
        })?;
        let c = 1.0 / (jet.first.sigma() + jet.first.d1.dot(&a));
        Ok(ChartVector { x: a * c, y: SVector::zeros(), z: c })
    }
}
