//! The dependence of the velocity on the state.

use crate::sensitivity::EndCovector;
use crate::sensitivity::parametric_system::{Differentiable, Quantity};
use crate::system::products::{times, transposed_times};
use crate::{Components, Point, SecondDerivatives, State, StepError, Vector};
use contact_geom::nalgebra::DMatrix;

/// The dependence of the velocity on the state `(q, p, z)` at a point:
/// `W dv = dp - L_vq dq - L_vz dz - L_vtheta dtheta - L_vt dt`; for a Lagrangian that is given by a contact Hamiltonian
/// `dv = H_pp dp + H_pq dq + H_pz dz + H_ptheta dtheta + H_pt dt`, whatever the rank of `H_pp`.
pub(crate) struct VelocityDependence {
    /// `W^-1`; 1 for a Hamiltonian, whose derivatives have the opposite sign of those of L below.
    inverse: DMatrix<f64>,
    /// The factor of dp: 1, or `H_pp`.
    of_p: DMatrix<f64>,
    qv: DMatrix<f64>,
    vz: Vector,
    /// `L_vtheta` for each parameter, and `L_vt`.
    parameters: Vec<Vector>,
    time: Vector,
}

impl VelocityDependence {
    /// At a point and its momentum.
    ///
    /// # Errors
    /// [`StepError::Singular`] where `L_vv` is singular; [`StepError::NonFinite`] for a Hamiltonian that is not defined there.
    pub fn at(problem: &Differentiable<'_>, t: f64, x: &Point, p: &Vector) -> Result<Self, StepError> {
        let (system, n) = (problem.system(), problem.dimension());
        let mut of = problem.stages.quantities();
        let quantities = (0..of.count()).map(Quantity::Parameter);
        if problem.is_hamiltonian() {
            let state = State { q: x.q.clone(), p: p.clone(), z: x.z };
            let SecondDerivatives { qv, vv, vz, .. } =
                system.hamiltonian_hessian(t, &state).ok_or(StepError::NonFinite)?;
            let mut explicit = |quantity| -of.of_hamiltonian(quantity, t, &state).gradient.y;
            let parameters = quantities.map(&mut explicit).collect();
            let time = explicit(Quantity::Time);
            let inverse = DMatrix::identity(n, n);
            return Ok(VelocityDependence { inverse, of_p: vv, qv: -qv, vz: -vz, parameters, time });
        }
        let SecondDerivatives { qv, vv, vz, .. } = system.hessian(t, x);
        let inverse = vv.try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?;
        let parameters = quantities.map(|quantity| of.at(quantity, t, x).gradient.y).collect();
        let time = of.at(Quantity::Time, t, x).gradient.y;
        Ok(VelocityDependence { inverse, of_p: DMatrix::identity(n, n), qv, vz, parameters, time })
    }

    /// The derivative of the velocity along a tangent of the state.
    pub fn along(&self, q: &Vector, p: &Vector, z: f64, parameter: Option<usize>, dt: f64) -> Vector {
        let mut sum = times(&self.of_p, p) - transposed_times(&self.qv, q) - &self.vz * z;
        if let Some(explicit) = parameter.and_then(|k| self.parameters.get(k)) {
            sum -= explicit;
        }
        times(&self.inverse, &(sum - &self.time * dt))
    }

    /// The derivatives in `(q, p, z)`, in the parameters and in the time, of a number with these partial derivatives.
    pub fn pull(&self, of: &EndCovector) -> (Components, Vec<f64>, f64) {
        let of_v = transposed_times(&self.inverse, &of.v);
        let state = Components {
            x: &of.q - times(&self.qv, &of_v),
            y: &of.p + transposed_times(&self.of_p, &of_v),
            z: of.z - self.vz.dot(&of_v),
        };
        (state, self.parameters.iter().map(|l| -l.dot(&of_v)).collect(), of.t - self.time.dot(&of_v))
    }
}
