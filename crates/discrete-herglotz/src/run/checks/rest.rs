//! Motions that have come to rest.

use crate::integration::SystemProblem;
use crate::resolution::monitor::size;
use crate::resolution::thresholds::{MAX_SIZE_AT_REST, REST_ROUNDINGS};
use crate::run::observers::output_request::OutputRequest;
use crate::{Point, State, Vector};
use contact_geom::numbers::max_or_nan;

/// The cause in the [`Status`](crate::Status) of a run that ends because the motion has come to rest.
pub(crate) const REST: &str = "rest";

/// Whether `q = v = 0` is a stable equilibrium, for the action z, at which a decaying motion stays: L does not depend
/// on time, its gradient in q and v vanishes there, the mass matrix is positive definite, the potential has a minimum,
/// and the drag is dissipative. From a maximum of the potential, round-off would drive the motion away.
pub(crate) fn rests_at_the_origin(problem: &SystemProblem<'_>, z: f64) -> bool {
    let system = &*problem.system;
    if system.hints().hamiltonian || !problem.structure.autonomous {
        return false;
    }
    let origin = origin(problem, z);
    let (slope, h) = (system.gradient(problem.t0, &origin), system.hessian(problem.t0, &origin));
    let still = slope.x.iter().chain(&slope.y).all(|e| *e == 0.0);
    // At rest the action may still change: neither force nor momentum may depend on it.
    let free = h.qz.iter().chain(&h.vz).all(|e| *e == 0.0);
    still && free && slope.z < 0.0 && h.vv.cholesky().is_some() && (-h.qq).cholesky().is_some()
}

/// The point `q = v = 0` with the action z.
fn origin(problem: &SystemProblem<'_>, z: f64) -> Point {
    let zero = Vector::zeros(problem.system.dimension());
    Point { q: zero.clone(), v: zero, z }
}

/// Whether a motion of the problem is at rest in a state: its position and momentum are below [`MAX_SIZE_AT_REST`], and
/// its action, if it is requested, is constant.
pub(crate) fn is_at_rest(problem: &SystemProblem<'_>, needs: OutputRequest, t: f64, state: &State) -> bool {
    if max_or_nan(size(&state.q), size(&state.p)) >= MAX_SIZE_AT_REST || starts_at_rest(problem) {
        return false;
    }
    let steady = || {
        let (system, origin) = (&*problem.system, origin(problem, state.z));
        let rate = system.value(t, &origin).abs();
        rate <= REST_ROUNDINGS * system.rounding(t, &origin).0
    };
    rests_at_the_origin(problem, state.z) && (!needs.action || steady())
}

/// Whether the start itself is below [`MAX_SIZE_AT_REST`].
pub(crate) fn starts_at_rest(problem: &SystemProblem<'_>) -> bool {
    max_or_nan(size(&problem.state.q), size(&problem.state.p)) < MAX_SIZE_AT_REST
}
