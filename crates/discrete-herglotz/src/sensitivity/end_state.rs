//! The state at the end of a run, losses of it, and their derivatives.

use crate::sensitivity::parameter_derivatives::{ParameterDerivatives, Quantity};
use crate::{Problem, State, StepError, Vector};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, Derivatives, Dual, Hessian, Parametric, PhasePoint, Scalar, VelocityPoint};

/// The state at the end of a run over a [`Scalar`]: the argument of a [`Loss`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndState<const N: usize, T = f64> {
    /// The time.
    pub t: T,
    /// The position.
    pub q: SVector<T, N>,
    /// The velocity.
    pub v: SVector<T, N>,
    /// The momentum.
    pub p: SVector<T, N>,
    /// The action.
    pub z: T,
}

/// A function of the end of a run, written once as a generic function, as a [`Lagrangian`](contact_geom::Lagrangian) is:
/// its derivatives are found by automatic differentiation.
///
/// ```
/// use contact_geom::Scalar;
/// use discrete_herglotz::sensitivity::{EndState, Loss};
/// struct Miss { target: f64 }
/// impl Loss<1> for Miss {
///     fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
///         (end.q[0] - self.target).powi(2) + end.v[0] * end.v[0] * 0.1
///     }
/// }
/// ```
pub trait Loss<const N: usize> {
    /// The value.
    fn value<T: Scalar>(&self, end: &EndState<N, T>) -> T;
}

/// The partial derivatives of a number in the end state, each component for fixed others; those of v and p are added, as
/// p depends on v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndCovector<const N: usize> {
    /// In the time.
    pub t: f64,
    /// In the position.
    pub q: SVector<f64, N>,
    /// In the velocity.
    pub v: SVector<f64, N>,
    /// In the momentum.
    pub p: SVector<f64, N>,
    /// In the action.
    pub z: f64,
}

impl<const N: usize> EndCovector<N> {
    /// No dependence.
    pub fn zero() -> Self {
        let zero = SVector::zeros();
        EndCovector { t: 0.0, q: zero, v: zero, p: zero, z: 0.0 }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.q.iter().chain(&self.v).chain(&self.p).chain([&self.t, &self.z]).all(|x| x.is_finite())
    }
}

impl<const N: usize> EndState<N> {
    /// The state at a time, with its velocity.
    pub(crate) fn at(t: f64, state: &State, v: &Vector) -> Self {
        EndState { t, q: state.q.fixed(), v: v.fixed(), p: state.p.fixed(), z: state.z }
    }

    /// A loss of this state, with its partial derivatives.
    pub fn differentiate(&self, loss: &impl Loss<N>) -> (f64, EndCovector<N>) {
        let mut seeded = self.constant();
        for i in 0..N {
            seeded.q[i].d.x[i] = 1.0;
            seeded.p[i].d.y[i] = 1.0;
        }
        seeded.z.d.z = 1.0;
        let value = loss.value(&seeded);
        let mut seeded = self.constant();
        for i in 0..N {
            seeded.v[i].d.x[i] = 1.0;
        }
        seeded.t.d.z = 1.0;
        let rest = loss.value(&seeded);
        (value.re, EndCovector { t: rest.d.z, q: value.d.x, v: rest.d.x, p: value.d.y, z: value.d.z })
    }

    /// The state as constants, for which derivatives are seeded afterwards.
    fn constant(&self) -> EndState<N, Dual<f64, ChartVector<N>>> {
        let EndState { t, q, v, p, z } = self;
        let [q, v, p] = [q, v, p].map(|x| x.map(Dual::from));
        EndState { t: Dual::from(*t), q, v, p, z: Dual::from(*z) }
    }
}

/// The dependence of the velocity on the state `(q, p, z)` at a point:
/// `W dv = dp - L_vq dq - L_vz dz - L_vtheta dtheta - L_vt dt`; for a Lagrangian that is given by a contact Hamiltonian
/// `dv = H_pp dp + H_pq dq + H_pz dz + H_ptheta dtheta + H_pt dt`, whatever the rank of `H_pp`.
pub(crate) struct VelocityDependence<const N: usize> {
    /// `W^-1`; 1 for a Hamiltonian, whose derivatives have the opposite sign of those of L below.
    inverse: SMatrix<f64, N, N>,
    /// The factor of dp: 1, or `H_pp`.
    of_p: SMatrix<f64, N, N>,
    qv: SMatrix<f64, N, N>,
    vz: SVector<f64, N>,
    /// `L_vtheta` for each parameter, and `L_vt`.
    parameters: Vec<SVector<f64, N>>,
    time: SVector<f64, N>,
}

impl<const N: usize> VelocityDependence<N> {
    /// At a point and its momentum.
    ///
    /// # Errors
    /// [`StepError::Singular`] where `L_vv` is singular; [`StepError::NonFinite`] for a Hamiltonian that is not defined there.
    pub fn at<L: Parametric<N>>(
        problem: &Problem<'_, L, N>,
        t: f64,
        x: &VelocityPoint<N>,
        p: &SVector<f64, N>,
    ) -> Result<Self, StepError> {
        let lagrangian = problem.lagrangian;
        if const { L::HINTS.hamiltonian } {
            let state = PhasePoint { q: x.q, p: *p, z: x.z };
            let Hessian { qv, vv, vz, .. } = lagrangian.hamiltonian_hessian(t, &state).ok_or(StepError::NonFinite)?;
            let mut of = ParameterDerivatives::new(lagrangian);
            let mut explicit = |quantity| -of.of_hamiltonian(lagrangian, quantity, t, &state).gradient.y;
            let parameters = (0..lagrangian.parameter_count()).map(|k| explicit(Quantity::Parameter(k))).collect();
            let time = explicit(Quantity::Time);
            return Ok(VelocityDependence {
                inverse: SMatrix::identity(),
                of_p: vv,
                qv: -qv,
                vz: -vz,
                parameters,
                time,
            });
        }
        let Hessian { qv, vv, vz, .. } = lagrangian.hessian(t, x);
        let inverse = vv.try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?;
        let mut of = ParameterDerivatives::new(lagrangian);
        let parameters = (0..of.count()).map(|k| of.at(lagrangian, Quantity::Parameter(k), t, x).gradient.y).collect();
        let time = of.at(lagrangian, Quantity::Time, t, x).gradient.y;
        Ok(VelocityDependence { inverse, of_p: SMatrix::identity(), qv, vz, parameters, time })
    }

    /// The derivative of the velocity along a tangent of the state.
    pub fn along(
        &self,
        q: &SVector<f64, N>,
        p: &SVector<f64, N>,
        z: f64,
        parameter: Option<usize>,
        dt: f64,
    ) -> SVector<f64, N> {
        let explicit = parameter.and_then(|k| self.parameters.get(k).copied()).unwrap_or_else(SVector::zeros);
        self.inverse * (self.of_p * p - self.qv.transpose() * q - self.vz * z - explicit - self.time * dt)
    }

    /// The derivatives in `(q, p, z)`, in the parameters and in the time, of a number with these partial derivatives.
    pub fn pull(&self, of: &EndCovector<N>) -> (ChartVector<N>, Vec<f64>, f64) {
        let of_v = self.inverse.transpose() * of.v;
        let state = ChartVector {
            x: of.q - self.qv * of_v,
            y: of.p + self.of_p.transpose() * of_v,
            z: of.z - self.vz.dot(&of_v),
        };
        (state, self.parameters.iter().map(|l| -l.dot(&of_v)).collect(), of.t - self.time.dot(&of_v))
    }
}
