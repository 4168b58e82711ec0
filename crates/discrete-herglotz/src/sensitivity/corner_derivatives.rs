//! The derivatives of a refraction or a reflection at a jump of L across a surface `g(t, q) = 0`.
//!
//! The corner conditions are `p+ = p- + lambda g_q`, `E+ = E- - lambda g_t`, with the energies of L on both sides. As
//! `dE = v . dp - L_q . dq - L_z dz - L_t dt - L_theta dtheta`, the derivative of lambda is
//! `((v- - v+) . dp- + [L_q] . dq + [L_z] dz + [L_t] dt + [L_theta] dtheta - lambda (v+ . dg_q + dg_t)) / (v+ . g_q + g_t)`
//! with the jumps [] from before to after, each at its own velocity.

use crate::integration::PartPoint;
use crate::sensitivity::SensitivityError;
use crate::sensitivity::columns::Column;
use crate::sensitivity::parametric_system::Quantity;
use crate::sensitivity::switch::{Argument, Switch, difference};
use crate::system::products::times;
use crate::{Components, Point, State, StepError, System, Vector};
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};

/// The distance from the surface of the first of three points from which one-sided limits are extrapolated, relative to
/// the position and to its change in a step.
const SURFACE_DISTANCE: f64 = 1e-9;

/// The weights of the extrapolation from the distances 1, 2, 3 to 0.
const WEIGHTS: [f64; 3] = [3.0, -3.0, 1.0];

/// The derivatives of the factor lambda and of the normal.
pub(crate) struct CornerDerivatives {
    lambda: f64,
    normal: Vector,
    /// Of lambda in `(q, p-, z)`, in the time and in the parameters.
    of_state: Components,
    of_time: f64,
    of_parameters: Vec<f64>,
    /// Of the normal in q, in the time and in the parameters.
    normal_q: DMatrix<f64>,
    normal_t: Vector,
    normal_parameters: Vec<Vector>,
}

/// The velocity of a momentum and the first derivatives of L on one side.
struct OneSided {
    v: Vector,
    gradient: Components,
    time: f64,
    parameters: Vec<f64>,
}

impl Switch<'_, '_> {
    /// The velocity of a momentum and the derivatives of L there, as limits from the side to which `toward` points. On the
    /// surface itself the mass may be that of either side.
    ///
    /// # Errors
    /// Those of [`legendre_inverse`](System::legendre_inverse).
    fn one_sided(&self, p: &Vector, guess: &Vector, toward: &Vector) -> Result<OneSided, StepError> {
        let system = self.problem.system();
        let mut of = self.problem.stages.quantities();
        let State { q, z, .. } = &self.at.state;
        let zero = Components::zeros(q.len());
        let mut sum = OneSided { v: zero.x.clone(), gradient: zero, time: 0.0, parameters: vec![0.0; of.count()] };
        for (weight, k) in WEIGHTS.into_iter().zip([1.0, 2.0, 3.0]) {
            let (t, state) = (self.at.t, State { q: q + toward * k, p: p.clone(), z: *z });
            if self.problem.is_hamiltonian() {
                // The derivatives of L are those of -H.
                let (_, d) = system.hamiltonian_with_gradient(t, &state).ok_or(StepError::NonFinite)?;
                sum.v += &d.y * weight;
                sum.gradient = sum.gradient.plus(&Components { y: Vector::zeros(q.len()), ..d }.scale(-weight));
                sum.time -= weight * of.of_hamiltonian(Quantity::Time, t, &state).l;
                for (index, parameter) in sum.parameters.iter_mut().enumerate() {
                    *parameter -= weight * of.of_hamiltonian(Quantity::Parameter(index), t, &state).l;
                }
                continue;
            }
            let x = system.legendre_inverse(t, &state, guess)?;
            sum.v += &x.v * weight;
            sum.gradient = sum.gradient.plus(&system.gradient(t, &x).scale(weight));
            sum.time += weight * of.at(Quantity::Time, t, &x).l;
            for (index, parameter) in sum.parameters.iter_mut().enumerate() {
                *parameter += weight * of.at(Quantity::Parameter(index), t, &x).l;
            }
        }
        Ok(sum)
    }

    /// The normal `g_q` and the rate `g_t` of the surface, at a point that is moved, by differences.
    fn normal(&self, system: &dyn System, t: f64, x: &Point) -> Option<Vec<f64>> {
        let arguments = (0..x.q.len()).map(Argument::Position).chain([Argument::Time]);
        let normal = arguments.map(|along| difference(along, (t, x), self.h, 1.0, &|t, x| self.function(system, t, x)));
        normal.map(|of| of?.first().copied()).collect()
    }

    /// The derivatives of the corner at the switch, after which the motion is at `next`, on the other side if it is
    /// refracted. The second derivatives of the surface are found by differences.
    pub(super) fn corner(&self, next: &PartPoint, is_refracted: bool) -> Result<CornerDerivatives, SensitivityError> {
        let undefined = || self.failed(StepError::NonFinite);
        let (problem, n) = (self.problem, self.problem.dimension());
        let gradient = self.normal(problem.system(), self.at.t, &self.point()).ok_or_else(undefined)?;
        let (normal, rate) = (Vector::from(&gradient[..n]), gradient[n]);
        let second = |along: Argument| self.difference(along, |system, t, x| self.normal(system, t, x));
        let mut normal_q = DMatrix::zeros(n, n);
        for j in 0..n {
            let of = second(Argument::Position(j))?;
            (0..n).for_each(|i| normal_q[(i, j)] = of[i]);
        }
        let of_normal = |of: &[f64]| Vector::from(&of[..n]);
        let in_time = second(Argument::Time)?;
        let count = problem.of.parameters().len();
        let in_parameters = (0..count).map(|k| second(Argument::Parameter(k))).collect::<Result<Vec<_>, _>>()?;

        let size = max_abs_or_nan(self.at.state.q.iter().copied());
        let moved = max_abs_or_nan(self.at.v.iter().map(|v| v * self.h));
        let length = SURFACE_DISTANCE * if max_or_nan(size, moved) > 0.0 { max_or_nan(size, moved) } else { 1.0 };
        let side = if self.rising { -1.0 } else { 1.0 };
        let toward = &normal * (side * length / normal.norm());
        let from = if is_refracted { -toward.clone() } else { toward.clone() };
        let [p_before, p_after] = [&self.at.state.p, &next.state.p];
        let before = self.one_sided(p_before, &self.at.v, &toward).map_err(|cause| self.failed(cause))?;
        let after = self.one_sided(p_after, &next.v, &from).map_err(|cause| self.failed(cause))?;
        let (v_before, v_after) = (before.v, after.v);

        let lambda = (p_after - p_before).dot(&normal) / normal.dot(&normal);
        let divisor = v_after.dot(&normal) + rate;
        if !(divisor.abs() > 0.0 && lambda.is_finite()) {
            return Err(undefined());
        }
        let jump = after.gradient.minus(&before.gradient);
        let normal_t = of_normal(&in_time);
        let explicit = |of: &[f64]| lambda * (v_after.dot(&of_normal(of)) + of[n]);
        let parameters = in_parameters.iter().enumerate();
        let of_parameters =
            parameters.map(|(k, of)| (after.parameters[k] - before.parameters[k] - explicit(of)) / divisor).collect();
        Ok(CornerDerivatives {
            lambda,
            of_state: Components {
                x: (jump.x - (times(&normal_q.transpose(), &v_after) + &normal_t) * lambda) / divisor,
                y: (v_before - &v_after) / divisor,
                z: jump.z / divisor,
            },
            of_time: (after.time - before.time - explicit(&in_time)) / divisor,
            of_parameters,
            normal,
            normal_q,
            normal_t,
            normal_parameters: in_parameters.iter().map(|of| of_normal(of)).collect(),
        })
    }
}

impl CornerDerivatives {
    /// The tangent `(q, p, z)` after the corner.
    pub(super) fn along(&self, column: &Column, dt: f64) -> Components {
        let state = column.state();
        let of_parameter = column.parameter.and_then(|k| self.of_parameters.get(k)).copied().unwrap_or(0.0);
        let lambda = self.of_state.dot(&state) + self.of_time * dt + of_parameter;
        let mut normal = times(&self.normal_q, &state.x) + &self.normal_t * dt;
        if let Some(explicit) = column.parameter.and_then(|k| self.normal_parameters.get(k)) {
            normal += explicit;
        }
        let Components { x, y, z } = state;
        Components { x, y: y + &self.normal * lambda + normal * self.lambda, z }
    }

    /// The derivatives in the state before the corner, in the parameters and in the time.
    pub(super) fn pull(&self, of: &Components) -> (Components, Vec<f64>, f64) {
        let of_lambda = of.y.dot(&self.normal);
        let of_normal = &of.y * self.lambda;
        let mut state = of.clone().plus(&self.of_state.scale(of_lambda));
        state.x += times(&self.normal_q.transpose(), &of_normal);
        let parameters = self.of_parameters.iter().zip(&self.normal_parameters);
        let parameters = parameters.map(|(a, normal)| a * of_lambda + normal.dot(&of_normal)).collect();
        (state, parameters, self.of_time * of_lambda + self.normal_t.dot(&of_normal))
    }
}
