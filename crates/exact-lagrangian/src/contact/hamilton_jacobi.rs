//! The Hamilton-Jacobi equation of a contact Hamiltonian.

use super::ContactFlowError;
use super::shooting::{Given, Search, Unknown};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{AugmentedVector, max_or_nan};
use contact_geom::{ContactHamiltonian, Dual, PhasePoint, Scalar};

/// An initial datum of the Hamilton-Jacobi equation: a Legendrian submanifold of T\*Q x R with N parameters, on which
/// `dz - p dq` vanishes.
pub trait InitialDatum<const N: usize> {
    /// The point with these parameters.
    fn at<T: Scalar>(&self, parameters: &SVector<T, N>) -> PhasePoint<N, T>;
}

/// All momenta at one position, with one action: the solution is the action along the motion from this point,
/// `S(t, q) = z0 + L_d(q0, q, z0)`. The parameters are the momenta.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FromPoint<const N: usize> {
    /// The position.
    pub q: SVector<f64, N>,
    /// The action.
    pub z: f64,
}

impl<const N: usize> InitialDatum<N> for FromPoint<N> {
    fn at<T: Scalar>(&self, p: &SVector<T, N>) -> PhasePoint<N, T> {
        PhasePoint { q: self.q.map(T::from), p: *p, z: T::from(self.z) }
    }
}

/// A function of the positions: the initial value of S.
pub trait InitialAction<const N: usize> {
    /// The value `S_0(q)`.
    fn value<T: Scalar>(&self, q: &SVector<T, N>) -> T;
}

/// The graph `p = S_0'(q)`, `z = S_0(q)` of a function: Cauchy's problem. The parameters are the positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FromFunction<S>(pub S);

impl<const N: usize, S: InitialAction<N>> InitialDatum<N> for FromFunction<S> {
    fn at<T: Scalar>(&self, q: &SVector<T, N>) -> PhasePoint<N, T> {
        let mut seeded = q.map(Dual::<T, SVector<T, N>>::constant);
        for i in 0..N {
            seeded[i].d[i] = T::one();
        }
        let s = self.0.value(&seeded);
        PhasePoint { q: *q, p: s.d, z: s.re }
    }
}

/// The Hamilton-Jacobi equation `S_t + H(t, q, S_q, S) = 0` with an initial datum at time `t0`.
///
/// The flow of `X_H` takes the Legendrian submanifold of the datum to one at each later time, since it multiplies `dz -
/// p dq` by sigma. Where that projects regularly to Q, it is the graph `p = S_q`, `z = S(t, q)`, and along a motion `z'
/// = S_t + S_q . q' = p . H_p - H` gives the equation. For [`FromPoint`] one step of length `t - t0` is the exact
/// discrete Lagrangian, and the discrete Hamilton-Jacobi equation `S_(k+1)(q1) = S_k(q0) + L_d(q0, q1, S_k(q0))`, `D1
/// L_d + sigma S_k'(q0) = 0`, is the solution at consecutive times.
///
/// ```
/// use contact_geom::{nalgebra::SVector, ContactHamiltonian, Scalar};
/// use exact_lagrangian::{FromPoint, HamiltonJacobi};
/// struct Pendulum;
/// impl ContactHamiltonian<1> for Pendulum {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
///         p[0] * p[0] * 0.5 - q[0].cos() + z * 0.3
///     }
/// }
/// let equation = HamiltonJacobi { hamiltonian: Pendulum, datum: FromPoint { q: [0.2].into(), z: 0.1 }, t0: 0.0 };
/// assert!(equation.residual(0.8, &[0.9].into(), &[1.0].into())?.abs() < 1e-13);
/// # Ok::<(), exact_lagrangian::ContactFlowError<1>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct HamiltonJacobi<H, D> {
    /// The contact Hamiltonian.
    pub hamiltonian: H,
    /// The initial datum.
    pub datum: D,
    /// Its time.
    pub t0: f64,
}

/// The solution of the Hamilton-Jacobi equation at a time and a position.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PrincipalFunction<const N: usize, T = f64> {
    /// The value `S(t, q)`, the action at the end of the motion.
    pub action: T,
    /// The momentum at the end of the motion, which is `S_q`.
    pub momentum: SVector<T, N>,
    /// The parameters of the start of the motion, a guess for a position nearby.
    pub parameters: SVector<T, N>,
}

impl<H, D> HamiltonJacobi<H, D> {
    /// The solution at a time and a position, on the branch of the motion found from a guess of the parameters. On
    /// duals with its derivatives in t and q.
    ///
    /// # Errors
    /// [`ContactFlowError::Conjugate`] at a caustic, where the motions of the datum do not determine S;
    /// [`ContactFlowError::NotConverged`]; those of the motion.
    pub fn solution<T: Scalar, const N: usize>(
        &self,
        t: T,
        q: &SVector<T, N>,
        guess: &SVector<f64, N>,
    ) -> Result<PrincipalFunction<N, T>, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
        D: InitialDatum<N>,
    {
        let search = Search {
            hamiltonian: &self.hamiltonian,
            t: T::from(self.t0),
            duration: t - self.t0,
            given: Given::Position,
            real: |x: &SVector<Unknown<N>, N>| self.datum.at(x),
            lifted: |x: &SVector<T, N>| self.datum.at(x),
        };
        let found = search.solve(q, guess)?;
        let end = found.motion.end;
        Ok(PrincipalFunction { action: end.z, momentum: end.p, parameters: found.unknown })
    }

    /// The residual `S_t + H(t, q, S_q, S)` relative to the size of its terms, where the derivatives of S are computed
    /// by dual numbers through flow and shooting, not by the momentum of the motion.
    ///
    /// # Errors
    /// Those of [`solution`](Self::solution).
    pub fn residual<const N: usize>(
        &self,
        t: f64,
        q: &SVector<f64, N>,
        guess: &SVector<f64, N>,
    ) -> Result<f64, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
        D: InitialDatum<N>,
    {
        type Seeded<const N: usize> = Dual<f64, AugmentedVector<N>>;
        let mut time = Seeded::<N>::from(t);
        time.d.z = 1.0;
        let mut position = q.map(Seeded::<N>::from);
        for i in 0..N {
            position[i].d.x[i] = 1.0;
        }
        let s = self.solution(time, &position, guess)?.action;
        let h = self.hamiltonian.value(t, q, &s.d.x, s.re);
        Ok((s.d.z + h) / max_or_nan(1.0, max_or_nan(s.d.z.abs(), h.abs())))
    }
}
