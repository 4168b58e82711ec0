//! Forward derivatives of a run.

use crate::run::{Observer, Outcome, OutputRequest, Run, StepView, Stop, Until};
use crate::sensitivity::SensitivityError;
use crate::sensitivity::end_state::VelocityDependence;
use crate::sensitivity::engine::{Column, Engine};
use crate::sensitivity::step_maps::Direction;
use crate::sensitivity::variable::Variable;
use crate::{Problem, Status, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{Parametric, VelocityPoint};
use std::ops::ControlFlow;

/// The derivatives of the final state of a run with respect to variables, one column for each.
#[derive(Clone, Debug, PartialEq)]
pub struct Tangent<const N: usize> {
    /// The outcome of the run. Where it ended early, the columns are those of the state that was reached after its last
    /// whole step.
    pub outcome: Outcome<N>,
    /// The derivatives, in the order of the variables.
    pub columns: Vec<StateDerivative<N>>,
    /// The largest derivative along the run divided by the largest one at its end, at least one: round-off of the
    /// derivatives is amplified by it.
    pub growth: f64,
}

/// The derivative of a state with respect to one variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateDerivative<const N: usize> {
    /// Of the position.
    pub q: SVector<f64, N>,
    /// Of the velocity; NaN where no velocity has the momentum of the state.
    pub v: SVector<f64, N>,
    /// Of the momentum.
    pub p: SVector<f64, N>,
    /// Of the action.
    pub z: f64,
}

/// Carries columns along a run.
struct Columns<'a, L, const N: usize> {
    engine: Engine<'a, L, N>,
    columns: Vec<Column<N>>,
    largest: f64,
    taken: usize,
    failure: Option<Failure>,
}

/// The reason why columns are not carried on.
enum Failure {
    /// The stepper does not give its stages.
    NoStages,
    Step(usize, StepError),
}

impl<L: Parametric<N>, const N: usize> Columns<'_, L, N> {
    fn push(&mut self, at: &StepView<'_, N>) -> Result<(), Failure> {
        let k = at.k.saturating_sub(1);
        let step = at.stepper.solved_stages().ok_or(Failure::NoStages)?;
        let failed = |cause| Failure::Step(k, cause);
        self.engine.prepare(&step).map_err(failed)?;
        for column in &mut self.columns {
            self.engine.push(&step, k, column).map_err(failed)?;
            self.largest = contact_geom::numbers::max_or_nan(self.largest, column.size());
        }
        self.taken = at.k;
        Ok(())
    }
}

impl<L: Parametric<N>, const N: usize> Observer<N> for Columns<'_, L, N> {
    fn needs(&self) -> OutputRequest {
        OutputRequest::ACTION
    }

    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        // A part of a step, where a run ends within it, is not carried over.
        if at.in_failed_step || at.k <= self.taken {
            return ControlFlow::Continue(());
        }
        match self.push(at) {
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(Stop::here("a derivative that cannot be computed"))
            }
        }
    }
}

impl<'p, L: Parametric<N>, const N: usize> Run<'p, '_, L, N> {
    /// Performs the run, and differentiates its final state with respect to variables. The derivatives are those of the
    /// discrete run, to round-off: of the steps that were given, or that were chosen for an accuracy, which are not
    /// differentiated themselves.
    ///
    /// ```
    /// use contact_geom::{VelocityPoint, systems::Pendulum};
    /// use discrete_herglotz::{Problem, Steps, Until, sensitivity::Variable};
    /// let pendulum = Pendulum { gamma: -0.01 };
    /// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0))?;
    /// let variables = [Variable::Velocity(0), Variable::Parameter("gamma".into())];
    /// let tangent = problem.steps(Steps::Size(0.5)).tangent(&variables, Until::Time(10.0))?;
    /// println!("dq/dv0 = {}, dq/dgamma = {}", tangent.columns[0].q[0], tangent.columns[1].q[0]);
    /// # Ok::<(), discrete_herglotz::sensitivity::SensitivityError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`run`](Self::run), and [`SensitivityError`] for a variable that the problem does not have, for an
    /// integrator whose tangent is not implemented, and where the equations of a tangent cannot be solved. A run that
    /// ends early is reported as the status of the outcome.
    pub fn tangent(self, variables: &[Variable], until: Until) -> Result<Tangent<N>, SensitivityError> {
        let run = self.differentiable()?;
        let plan = run.plan(until)?;
        let problem = plan.steps.problem;
        check_tangent(&plan)?;
        let columns = variables.iter().map(|v| v.column(problem, plan.count())).collect::<Result<Vec<_>, _>>()?;
        let stages = plan.steps.info.collocation.unwrap_or(1);
        let engine = Engine::new(problem, stages, plan.step_size(), Direction::Forward);
        let mut carried = Columns { engine, columns, largest: 0.0, taken: 0, failure: None };
        let outcome = run.observed(&plan, &mut carried)?;
        match carried.failure {
            None => {}
            Some(Failure::NoStages) => return Err(no_tangent(&plan, "")),
            Some(Failure::Step(step, cause)) => return Err(SensitivityError::Step { step, cause }),
        }
        Ok(tangent(problem, outcome, &carried, plan.count()))
    }
}

fn tangent<L: Parametric<N>, const N: usize>(
    problem: &Problem<'_, L, N>,
    outcome: Outcome<N>,
    carried: &Columns<'_, L, N>,
    steps: usize,
) -> Tangent<N> {
    let nan = SVector::from_element(f64::NAN);
    let of_velocity = outcome.v.and_then(|v| {
        let x = VelocityPoint { q: outcome.q, v, z: outcome.z_or_start };
        VelocityDependence::at(problem, outcome.t, &x).ok()
    });
    let whole = outcome.status == Status::Completed;
    let columns: Vec<_> = carried.columns.iter().map(|column| {
        let dt = column.dt0 + steps as f64 * column.dh;
        let v = of_velocity.as_ref().filter(|_| whole).map_or(nan, |of| of.along(&column.q, &column.p, column.z, column.parameter, dt));
        StateDerivative { q: column.q, v, p: column.p, z: column.z }
    }).collect();
    let last = carried.columns.iter().fold(0.0, |m, column| contact_geom::numbers::max_or_nan(m, column.size()));
    let growth = if carried.largest > last { carried.largest / last } else { 1.0 };
    Tangent { outcome, columns, growth }
}

/// Checks that the integrator of a plan has a tangent.
pub(crate) fn check_tangent<L: Parametric<N>, const N: usize>(plan: &crate::Plan<'_, L, N>) -> Result<(), SensitivityError> {
    let info = &plan.steps.info;
    if info.collocation.is_none() || info.in_transformed_time || info.divides {
        return Err(no_tangent(plan, ""));
    }
    if plan.steps.switches {
        return Err(no_tangent(plan, " for Lagrangians with switching functions"));
    }
    Ok(())
}

pub(crate) fn no_tangent<L: Parametric<N>, const N: usize>(plan: &crate::Plan<'_, L, N>, case: &'static str) -> SensitivityError {
    SensitivityError::NoTangent { method: plan.steps.info.name.clone(), case }
}
