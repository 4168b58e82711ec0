//! Motions that have come to rest.

use crate::integration::SystemProblem;
use crate::resolution::monitor::size;
use crate::resolution::thresholds::{MAX_SIZE_AT_REST, REST_ROUNDINGS};
use crate::run::observers::output_request::OutputRequest;
use crate::{Point, State, Vector};
use contact_geom::numbers::max_or_nan;

/// The number of later times at which the switching functions of a motion at rest are evaluated.
const CHECKED_TIMES: usize = 16;

/// Whether `q = v = 0` is a stable equilibrium, for the action z, at which a decaying motion stays: L does not depend
/// on time, its gradient in q and v vanishes there, the mass matrix is positive definite, the potential has a minimum,
/// and the drag is dissipative in the direction of `span`. From a maximum of the potential, round-off would drive the
/// motion away.
pub(crate) fn rests_at_the_origin(problem: &SystemProblem<'_>, z: f64, span: f64) -> bool {
    let system = &*problem.system;
    if system.hints().hamiltonian || !problem.structure.autonomous {
        return false;
    }
    let origin = origin(problem, z);
    let (slope, h) = (system.gradient(problem.t0, &origin), system.hessian(problem.t0, &origin));
    let still = slope.x.iter().chain(&slope.y).all(|e| *e == 0.0);
    // At rest the action may still change: neither force nor momentum may depend on it.
    let free = h.qz.iter().chain(&h.vz).all(|e| *e == 0.0);
    still && free && slope.z * span < 0.0 && h.vv.cholesky().is_some() && (-h.qq).cholesky().is_some()
}

/// The point `q = v = 0` with the action z.
pub(crate) fn origin(problem: &SystemProblem<'_>, z: f64) -> Point {
    let zero = Vector::zeros(problem.system.dimension());
    Point { q: zero.clone(), v: zero, z }
}

/// Whether a motion of the problem is at rest in a state, until the time `t_end`: its position and momentum are below
/// [`MAX_SIZE_AT_REST`], its action, if it is requested, is constant, and no switching function changes with time, as that
/// of a reset at a given time.
pub(crate) fn is_at_rest(
    problem: &SystemProblem<'_>,
    needs: OutputRequest,
    (t, t_end): (f64, f64),
    state: &State,
) -> bool {
    // A motion that starts with smaller numbers is that of these numbers.
    !starts_at_rest(problem) && is_state_of_rest(problem, needs, (t, t_end), state)
}

/// Whether a motion that starts at rest, with numbers below [`MAX_SIZE_AT_REST`] as from the end of another one, decays to
/// zero in double precision: errors relative to it are undefined.
pub(crate) fn remains_at_rest(problem: &SystemProblem<'_>, needs: OutputRequest, t_end: f64) -> bool {
    let State { q, p, z } = &problem.state;
    let (start, span) = (max_or_nan(size(q), size(p)), t_end - problem.t0);
    let rate = || problem.system.gradient(problem.t0, &origin(problem, *z)).z;
    // Written so that a NaN is no rest.
    start > 0.0
        && start < MAX_SIZE_AT_REST
        && start * (0.5 * rate() * span).exp() == 0.0
        && is_state_of_rest(problem, needs, (problem.t0, t_end), &problem.state)
}

fn is_state_of_rest(problem: &SystemProblem<'_>, needs: OutputRequest, (t, t_end): (f64, f64), state: &State) -> bool {
    // Written so that a NaN is not at rest.
    let is_small = max_or_nan(size(&state.q), size(&state.p)) < MAX_SIZE_AT_REST;
    let steady = || {
        let (system, origin) = (&*problem.system, origin(problem, state.z));
        let rate = system.value(t, &origin).abs();
        rate <= REST_ROUNDINGS * system.rounding(t, &origin).0
    };
    is_small
        && rests_at_the_origin(problem, state.z, t_end - t)
        && (!needs.action || steady())
        && no_switch(problem, (t, t_end), state.z)
}

/// Whether the switching functions at the origin have the same values at all times that are checked. Those of an
/// autonomous L do not depend on time, but those of resets may.
fn no_switch(problem: &SystemProblem<'_>, (t, t_end): (f64, f64), z: f64) -> bool {
    let origin = origin(problem, z);
    let (mut first, mut later) = (Vec::new(), Vec::new());
    problem.system.switching_functions(t, &origin, &mut first);
    first.is_empty()
        || (1..=CHECKED_TIMES).all(|k| {
            later.clear();
            let part = k as f64 / CHECKED_TIMES as f64;
            problem.system.switching_functions(t + part * (t_end - t), &origin, &mut later);
            later == first
        })
}

/// Whether the start itself is below [`MAX_SIZE_AT_REST`].
pub(crate) fn starts_at_rest(problem: &SystemProblem<'_>) -> bool {
    max_or_nan(size(&problem.state.q), size(&problem.state.p)) < MAX_SIZE_AT_REST
}
