//! The exact discrete left Hamiltonian: the generating function of type III of a flow.

use super::{ContactFlowError, ExactRightHamiltonian, GeneratedStep};
use contact_geom::{ChartVector, ContactHamiltonian, PhasePoint, Scalar};

/// The exact discrete left Hamiltonian of a contact Hamiltonian over a time h, `H-(q1, p0, z1) = -p0 . q0 - (z1 - z0)`
/// along the motion to `(q1, z1)` whose momentum at the start is `p0`: the generating function of type III of the flow.
///
/// With `eta0 = eta1 / sigma`, `dH- = -q0 dp0 - (p1/sigma) dq1 + (1/sigma - 1) dz1`, that is
///
/// `H-_p0 = -q0`, `H-_q1 = -p1/sigma`, `H-_z1 = 1/sigma - 1`.
///
/// It is `-H+` of the flow over `-h`. It exists where `dp0/dp1` is regular.
///
/// ```
/// use contact_geom::{nalgebra::SVector, ContactHamiltonian, PhasePoint, Scalar};
/// use exact_lagrangian::ExactLeftHamiltonian;
/// struct Free;
/// impl ContactHamiltonian<1> for Free {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T { p[0] * p[0] * 0.5 }
/// }
/// let value: f64 = ExactLeftHamiltonian::new(&Free, 0.5).value(0.0, &PhasePoint::new([1.0], [2.0], 0.0))?;
/// assert!((value + 1.0).abs() < 1e-14); // -p0 q1 + h p0^2/2
/// # Ok::<(), exact_lagrangian::ContactFlowError<1>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ExactLeftHamiltonian<H> {
    backward: ExactRightHamiltonian<H>,
    h: f64,
}

impl<H> ExactLeftHamiltonian<H> {
    /// The function of the flow over h.
    pub fn new(hamiltonian: H, h: f64) -> Self {
        ExactLeftHamiltonian { backward: ExactRightHamiltonian::new(hamiltonian, -h), h }
    }

    /// The step backward from time `t + h` to t, with the positions and the action of `x = (q1, p0, z1)` at its start
    /// and the momenta at its end. Its factor is `1/sigma`.
    ///
    /// # Errors
    /// [`ContactFlowError::Conjugate`] where `dp0/dp1` is singular, [`ContactFlowError::NotConverged`], and those of
    /// the motion.
    pub fn backward_step<T: Scalar, const N: usize>(
        &self,
        t: f64,
        x: &PhasePoint<N, T>,
    ) -> Result<GeneratedStep<N, T>, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
    {
        self.backward.step(t + self.h, x)
    }

    /// The value `H-(q1, p0, z1)` at `x = (q1, p0, z1)`, for a step from time t; on duals with its derivatives.
    ///
    /// # Errors
    /// Those of [`backward_step`](Self::backward_step).
    pub fn value<T: Scalar, const N: usize>(&self, t: f64, x: &PhasePoint<N, T>) -> Result<T, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
    {
        Ok(-self.backward.value(t + self.h, x)?)
    }

    /// The value with the derivatives `(H-_q1, H-_p0, H-_z1) = (-p1/sigma, -q0, 1/sigma - 1)`, from the motion.
    ///
    /// # Errors
    /// Those of [`backward_step`](Self::backward_step).
    pub fn with_gradient<const N: usize>(
        &self,
        t: f64,
        x: &PhasePoint<N>,
    ) -> Result<(f64, ChartVector<N>), ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
    {
        let (value, gradient) = self.backward.with_gradient(t + self.h, x)?;
        Ok((-value, gradient.scale(-1.0)))
    }
}
