//! The exact discrete right Hamiltonian: the generating function of type II of a flow.

use super::shooting::{Given, Search, Unknown, real};
use super::{ContactFlowError, ContactMotion};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, ContactHamiltonian, PhasePoint, Scalar};

/// The exact discrete right Hamiltonian of a contact Hamiltonian over a time h, `H+(q0, p1, z0) = p1 . q1 - (z1 - z0)`
/// along the motion from `(q0, z0)` whose momentum at the end is `p1`: the generating function of type II of the flow.
///
/// With `eta1 = sigma eta0`, `dH+ = q1 dp1 + p1 dq1 - dz1 + dz0 = q1 dp1 + sigma p0 dq0 + (1 - sigma) dz0`, that is
///
/// `H+_p1 = q1`, `H+_q0 = sigma p0`, `H+_z0 = 1 - sigma`.
///
/// Where the exact discrete Lagrangian exists, `z1 = z0 + L_d` with `D1 L_d = -sigma p0`, `D2 L_d = p1` and
/// `sigma = 1 + Dz L_d`, it is its Legendre transform `p1 . q1 - L_d`. It exists where `dp1/dp0` is regular, also at
/// conjugate points, where `dq1/dp0` is singular. The name is that of Leok and Zhang, IMA J. Numer. Anal. 31 (2011)
/// 1497-1532, for symplectic flows.
///
/// ```
/// use contact_geom::{nalgebra::SVector, ContactHamiltonian, PhasePoint, Scalar};
/// use exact_lagrangian::ExactRightHamiltonian;
/// struct Oscillator;
/// impl ContactHamiltonian<1> for Oscillator {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
///         (q[0] * q[0] + p[0] * p[0]) * 0.5
///     }
/// }
/// let exact = ExactRightHamiltonian::new(&Oscillator, std::f64::consts::PI); // conjugate points: no L_d
/// let value: f64 = exact.value(0.0, &PhasePoint::new([1.0], [0.5], 0.0))?;
/// assert!((value + 0.5).abs() < 1e-14); // -p1 q0
/// # Ok::<(), exact_lagrangian::ContactFlowError<1>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ExactRightHamiltonian<H> {
    hamiltonian: H,
    h: f64,
}

/// The step that a generating function generates.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct GeneratedStep<const N: usize, T = f64> {
    /// The state before the step.
    pub start: PhasePoint<N, T>,
    /// The motion over the step.
    pub motion: ContactMotion<N, T>,
}

impl<H> ExactRightHamiltonian<H> {
    /// The function of the flow over h, which is negative for a step backward in time.
    pub fn new(hamiltonian: H, h: f64) -> Self {
        ExactRightHamiltonian { hamiltonian, h }
    }

    /// The step from time t with the positions and the action of `x = (q0, p1, z0)` at its start, and the momenta at
    /// its end; from the guess `p0 = p1`.
    ///
    /// # Errors
    /// [`ContactFlowError::Conjugate`] where `dp1/dp0` is singular, [`ContactFlowError::NotConverged`], and those of
    /// the motion.
    pub fn step<T: Scalar, const N: usize>(
        &self,
        t: f64,
        x: &PhasePoint<N, T>,
    ) -> Result<GeneratedStep<N, T>, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
    {
        self.step_near(t, x, &real(x).p)
    }

    /// The same from a guess of the momentum `p0` at the start.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn step_near<T: Scalar, const N: usize>(
        &self,
        t: f64,
        x: &PhasePoint<N, T>,
        guess: &SVector<f64, N>,
    ) -> Result<GeneratedStep<N, T>, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
    {
        let from = real(x);
        let search = Search {
            hamiltonian: &self.hamiltonian,
            t: T::from(t),
            duration: T::from(self.h),
            given: Given::Momentum,
            real: |p: &SVector<Unknown<N>, N>| PhasePoint { q: from.q.map(Unknown::from), p: *p, z: from.z.into() },
            lifted: |p: &SVector<T, N>| PhasePoint { q: x.q, p: *p, z: x.z },
        };
        let found = search.solve(&x.p, guess)?;
        Ok(GeneratedStep { start: found.start, motion: found.motion })
    }

    /// The value `H+(q0, p1, z0)` at `x = (q0, p1, z0)`; on duals with its derivatives.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn value<T: Scalar, const N: usize>(&self, t: f64, x: &PhasePoint<N, T>) -> Result<T, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
    {
        let step = self.step(t, x)?;
        Ok(x.p.dot(&step.motion.end.q) - step.motion.displacement.z)
    }

    /// The value with the derivatives `(H+_q0, H+_p1, H+_z0) = (sigma p0, q1, 1 - sigma)`, from the motion.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    pub fn with_gradient<const N: usize>(
        &self,
        t: f64,
        x: &PhasePoint<N>,
    ) -> Result<(f64, ChartVector<N>), ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
    {
        let GeneratedStep { start, motion } = self.step(t, x)?;
        let value = x.p.dot(&motion.end.q) - motion.displacement.z;
        Ok((value, ChartVector { x: start.p * motion.sigma(), y: motion.end.q, z: -motion.ln_sigma.exp_m1() }))
    }
}
