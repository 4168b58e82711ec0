//! States of a motion at times, with their derivatives.

use crate::ModelFailure;
use contact_geom::{Parametric, VelocityPoint};
use discrete_herglotz::sensitivity::{TangentRow, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Status, Steps, Until};
use std::fmt::Display;

/// The steps of a motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepChoice {
    pub stages: usize,
    /// The largest size of a step.
    pub h: f64,
}

/// The variables of a start `(q, v, z)`.
pub(crate) fn state_variables<const N: usize>() -> impl Iterator<Item = Variable> {
    (0..N).map(Variable::Position).chain((0..N).map(Variable::Velocity)).chain([Variable::Action])
}

/// The rows of the motion from a state at `t0` at times, which ascend from `t0`, with the derivatives with respect to
/// variables of the start `(q, v, z)` and to parameters.
pub(crate) fn tangent_rows<L: Parametric<N>, const N: usize>(
    lagrangian: &L,
    (t0, start): (f64, VelocityPoint<N>),
    times: &[f64],
    StepChoice { stages, h }: StepChoice,
    variables: &[Variable],
) -> Result<Vec<TangentRow>, ModelFailure> {
    let Some(end) = times.last().copied() else { return Ok(Vec::new()) };
    let problem = Problem::new(lagrangian, t0, start).map_err(undefined)?;
    let run = problem.by(GaussCollocation { stages }).steps(Steps::Size(h));
    let tangent = run.tangent_at(variables, times, Until::Time(end)).map_err(undefined)?;
    if tangent.outcome.status != Status::Completed {
        return Err(undefined(tangent.outcome.status));
    }
    match tangent.outcome.unresolved {
        Some(unresolved) => Err(undefined(unresolved)),
        None => Ok(tangent.rows),
    }
}

fn undefined(cause: impl Display) -> ModelFailure {
    ModelFailure::Undefined(cause.to_string())
}
