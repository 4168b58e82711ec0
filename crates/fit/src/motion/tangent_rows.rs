//! States of a motion at times, with their derivatives.

use crate::ModelFailure;
use contact_geom::nalgebra::SVector;
use contact_geom::{Parametric, VelocityPoint};
use discrete_herglotz::sensitivity::{EndState, StateDerivative, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Status, Steps, Until};

/// The steps of a motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepChoice {
    pub stages: usize,
    /// The largest size of a step.
    pub h: f64,
}

/// A state and its derivatives, one for each variable.
#[derive(Clone, Debug)]
pub(crate) struct TangentRow<const N: usize> {
    pub state: EndState<N>,
    pub columns: Vec<StateDerivative<N>>,
}

/// The rows of the motion from a state at `t0` at times, which ascend from `t0`, with the derivatives with respect to
/// variables of the start `(q, v, z)` and to parameters.
pub(crate) fn tangent_rows<L: Parametric<N>, const N: usize>(
    lagrangian: &L,
    (t0, start): (f64, VelocityPoint<N>),
    times: &[f64],
    steps: StepChoice,
    variables: &[Variable],
) -> Result<Vec<TangentRow<N>>, ModelFailure> {
    let parameters = variables.iter().filter(|v| matches!(v, Variable::Parameter(_))).cloned();
    let all: Vec<Variable> = state_variables::<N>().chain(parameters).collect();
    let mut at = Position { t: t0, x: start, columns: variables.iter().map(unit).collect() };
    let mut rows: Vec<TangentRow<N>> = Vec::with_capacity(times.len());
    for time in times {
        let row = at.advance(lagrangian, *time, steps, variables, &all)?;
        rows.push(row);
    }
    Ok(rows)
}

/// The variables of a start `(q, v, z)`.
pub(crate) fn state_variables<const N: usize>() -> impl Iterator<Item = Variable> {
    (0..N).map(Variable::Position).chain((0..N).map(Variable::Velocity)).chain([Variable::Action])
}

/// A state on the way, with the derivatives of q, v and z.
struct Position<const N: usize> {
    t: f64,
    x: VelocityPoint<N>,
    columns: Vec<VelocityPoint<N>>,
}

impl<const N: usize> Position<N> {
    fn advance<L: Parametric<N>>(
        &mut self,
        lagrangian: &L,
        time: f64,
        StepChoice { stages, h }: StepChoice,
        variables: &[Variable],
        all: &[Variable],
    ) -> Result<TangentRow<N>, ModelFailure> {
        let undefined = |e: &dyn std::fmt::Display| ModelFailure::Undefined(format!("at t = {}: {e}", self.t));
        let problem = Problem::new(lagrangian, self.t, self.x).map_err(|e| undefined(&e))?;
        let count = ((time - self.t) / h * (1.0 - 1e-9)).ceil().max(1.0) as usize;
        let run = problem.by(GaussCollocation { stages }).steps(Steps::Count(count));
        let tangent = run.tangent(all, Until::Time(time)).map_err(|e| undefined(&e))?;
        let outcome = &tangent.outcome;
        if outcome.status != Status::Completed {
            return Err(undefined(&outcome.status));
        }
        if let Some(unresolved) = &outcome.unresolved {
            return Err(undefined(&format!("{unresolved}; take smaller steps")));
        }
        let (Some(v), Some(z)) = (outcome.v, outcome.z) else {
            return Err(undefined(&"the state has no velocity"));
        };
        // The chain rule: the tangent of the piece times the derivatives at its start.
        let along = |(variable, start): (&Variable, &VelocityPoint<N>)| {
            let factors = start.q.iter().chain(start.v.iter()).chain([&start.z]);
            let (q, zero) = (SVector::zeros(), SVector::zeros());
            let mut sum = StateDerivative { q, v: zero, p: zero, z: 0.0 };
            for (column, factor) in tangent.columns.iter().zip(factors) {
                add(&mut sum, column, *factor);
            }
            let own = all.iter().position(|v| v == variable).filter(|i| *i > 2 * N);
            if let Some(column) = own.and_then(|i| tangent.columns.get(i)) {
                add(&mut sum, column, 1.0);
            }
            sum
        };
        let columns: Vec<StateDerivative<N>> = variables.iter().zip(&self.columns).map(along).collect();
        let state = EndState { t: time, q: outcome.q, v, p: outcome.p, z };
        self.t = time;
        self.x = VelocityPoint { q: outcome.q, v, z };
        self.columns = columns.iter().map(|c| VelocityPoint { q: c.q, v: c.v, z: c.z }).collect();
        Ok(TangentRow { state, columns })
    }
}

fn add<const N: usize>(sum: &mut StateDerivative<N>, column: &StateDerivative<N>, factor: f64) {
    sum.q += column.q * factor;
    sum.v += column.v * factor;
    sum.p += column.p * factor;
    sum.z += column.z * factor;
}

/// The derivative of a start `(q, v, z)` with respect to a variable.
fn unit<const N: usize>(variable: &Variable) -> VelocityPoint<N> {
    let mut x = VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z: 0.0 };
    match variable {
        Variable::Position(i) => x.q[*i] = 1.0,
        Variable::Velocity(i) => x.v[*i] = 1.0,
        Variable::Action => x.z = 1.0,
        _ => {}
    }
    x
}
