//! Motions that have come to rest.

use crate::integration::SystemProblem;
use crate::resolution::monitor::size;
use crate::resolution::thresholds::{MAX_SIZE_AT_REST, REST_ROUNDINGS};
use crate::run::observers::output_request::OutputRequest;
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, VelocityPoint, numbers::max_or_nan};

/// The cause in the [`Status`](crate::Status) of a run that ends because the motion has come to rest.
pub(crate) const REST: &str = "rest";

/// Whether `q = v = 0` is a stable equilibrium, for the action z, at which a decaying motion stays: L does not depend
/// on time, its gradient in q and v vanishes there, the mass matrix is positive definite, the potential has a minimum,
/// and the drag is dissipative. From a maximum of the potential, round-off would drive the motion away.
pub(crate) fn rests_at_the_origin<const N: usize>(problem: &SystemProblem<'_, N>, z: f64) -> bool {
    if problem.lagrangian.hints().hamiltonian || !problem.structure.autonomous {
        return false;
    }
    let origin = VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z };
    let (slope, h) =
        (problem.lagrangian.gradient(problem.t0, &origin), problem.lagrangian.hessian(problem.t0, &origin));
    let still = slope.x.iter().chain(&slope.y).all(|e| *e == 0.0);
    // At rest the action may still change: neither force nor momentum may depend on it.
    let free = h.qz.iter().chain(&h.vz).all(|e| *e == 0.0);
    still && free && slope.z < 0.0 && h.vv.cholesky().is_some() && (-h.qq).cholesky().is_some()
}

/// Whether a motion of the problem is at rest in a state: its position and momentum are below [`MAX_SIZE_AT_REST`], and
/// its action, if it is requested, is constant.
pub(crate) fn is_at_rest<const N: usize>(
    problem: &SystemProblem<'_, N>,
    needs: OutputRequest,
    t: f64,
    state: &PhasePoint<N>,
) -> bool {
    if max_or_nan(size(state.q.as_slice()), size(state.p.as_slice())) >= MAX_SIZE_AT_REST || starts_at_rest(problem) {
        return false;
    }
    let origin = VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z: state.z };
    let steady = || {
        let lagrangian = problem.lagrangian;
        let rate = lagrangian.value(t, &origin).abs();
        rate <= REST_ROUNDINGS * lagrangian.rounding(t, &origin).0
    };
    rests_at_the_origin(problem, state.z) && (!needs.action || steady())
}

/// Whether the start itself is below [`MAX_SIZE_AT_REST`].
pub(crate) fn starts_at_rest<const N: usize>(problem: &SystemProblem<'_, N>) -> bool {
    max_or_nan(size(problem.state.q.as_slice()), size(problem.state.p.as_slice())) < MAX_SIZE_AT_REST
}
