//! Forward derivatives of a run.

use crate::integration::Motion;
use crate::run::{Observer, Outcome, OutputRequest, Plan, Run, RunInfo, StepView, Stop, Until};
use crate::sensitivity::carried_columns::CarriedColumns;
use crate::sensitivity::columns::Column;
use crate::sensitivity::parametric_system::{Differentiable, DifferentiableProblem};
use crate::sensitivity::projected_start::ProjectedStart;
use crate::sensitivity::row_times::RowTimes;
use crate::sensitivity::step_maps::Direction;
use crate::sensitivity::step_tangent::{StepTangent, TakenStep};
use crate::sensitivity::variable::Variable;
use crate::sensitivity::velocity_dependence::VelocityDependence;
use crate::sensitivity::{EndCovector, MotionState, SensitivityError};
use crate::{InputError, Point, State, Status, StepError, Vector};
use contact_geom::numbers::max_or_nan;
use std::ops::ControlFlow;

/// The derivatives of the final state of a run with respect to variables, one column for each.
#[derive(Clone, Debug, PartialEq)]
pub struct Tangent {
    /// The outcome of the run. Where it ended early, the columns are those of the state that was reached after its last
    /// whole step.
    pub outcome: Outcome,
    /// The derivatives, in the order of the variables.
    pub columns: Vec<StateDerivative>,
    /// The states at the requested times, each with its derivatives.
    pub rows: Vec<TangentRow>,
    /// The zeros of switching functions that the motion has met, in the order of the run.
    pub switches: Vec<SwitchTime>,
    /// The largest derivative along the run divided by the largest one at its end, at least one: round-off of the
    /// derivatives is amplified by it.
    pub growth: f64,
}

/// A zero of a switching function along a run, with the derivatives of its time.
#[derive(Clone, Debug, PartialEq)]
pub struct SwitchTime {
    /// The time.
    pub t: f64,
    /// The index of the function.
    pub index: usize,
    /// The derivatives of the time, in the order of the variables.
    pub derivatives: Vec<f64>,
}

/// The state at a time with its derivatives, one column for each variable. The time is fixed, unless it is the end of the
/// run, which may itself be a variable.
#[derive(Clone, Debug, PartialEq)]
pub struct TangentRow {
    /// The state.
    pub state: MotionState,
    /// The derivatives, in the order of the variables.
    pub columns: Vec<StateDerivative>,
}

/// The derivative of a state with respect to one variable.
#[derive(Clone, Debug, PartialEq)]
pub struct StateDerivative {
    /// Of the position.
    pub q: Vector,
    /// Of the velocity; NaN where no velocity has the momentum of the state.
    pub v: Vector,
    /// Of the momentum.
    pub p: Vector,
    /// Of the action.
    pub z: f64,
}

/// Carries columns along a run.
struct Columns<'r, 'p> {
    plan: &'r Plan<'p>,
    carried: CarriedColumns<'r, 'p>,
    /// The time and the state at the start of the next step.
    before: (f64, State),
    largest: f64,
    taken: usize,
    failure: Option<SensitivityError>,
}

impl StateDerivative {
    /// The derivative of a number with these partial derivatives in the state, for a fixed time.
    pub fn dot(&self, of: &EndCovector) -> f64 {
        self.q.dot(&of.q) + self.v.dot(&of.v) + self.p.dot(&of.p) + self.z * of.z
    }
}

impl Columns<'_, '_> {
    fn push(&mut self, at: &StepView<'_>) -> Result<(), SensitivityError> {
        let k = at.k.saturating_sub(1);
        let before = std::mem::replace(&mut self.before, (at.t, at.state.clone()));
        let taken = TakenStep::last_of(at.stepper, self.carried.engine.has_stages(), self.plan.step_size(), before);
        let step = taken.ok_or_else(|| no_tangent(self.plan, ""))?;
        let largest = self.carried.push(&step, at.t, k)?;
        self.largest = max_or_nan(self.largest, largest);
        self.taken = at.k;
        self.row_at_end(at)
    }

    /// The rows in an interval in which the motion is at rest: the state does not change there, and since the tangent has
    /// come to rest with it, neither do its columns.
    fn rows_at_rest(&mut self, at: &StepView<'_>) -> Result<(), SensitivityError> {
        let failed = |cause| SensitivityError::Step { step: at.k, cause };
        while let Some(t) = self.carried.times.next_within((self.before.0, at.t)) {
            let state = MotionState::at(t, &at.state, &at.velocity().map_err(failed)?);
            let row = row(self.carried.problem, state, &self.carried.columns, |_| 0.0);
            self.carried.rows.push(row.map_err(failed)?);
        }
        self.before.0 = at.t;
        self.row_at_end(at)
    }

    /// The row at the end of the last step, if its time is requested.
    fn row_at_end(&mut self, at: &StepView<'_>) -> Result<(), SensitivityError> {
        if self.carried.times.next_at(at.t, at.last).is_none() {
            return Ok(());
        }
        let failed = |cause| SensitivityError::Step { step: at.k, cause };
        let v = at.velocity().map_err(failed)?;
        let state = MotionState::at(at.t, &at.state, &v);
        let problem = self.carried.problem;
        self.carried.rows.push(
            if at.last && at.k > 0 {
                row(problem, state, &self.carried.columns, |column| column.time_after(at.k))
            } else {
                // The end of the step moves with the times of the run, but not the row.
                let t = self.carried.jumps.before(at.t);
                let rates = self.plan.steps.rates(t, &at.state, Some(&v)).map_err(failed)?;
                let columns: Vec<_> =
                    self.carried.columns.iter().map(|column| column.at_fixed_time(at.k, &rates)).collect();
                row(problem, state, &columns, |_| 0.0)
            }
            .map_err(failed)?,
        );
        Ok(())
    }
}

impl Observer for Columns<'_, '_> {
    fn needs(&self) -> OutputRequest {
        OutputRequest::ACTION
    }

    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.carried.times.check(info)
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.before = (at.t, at.state.clone());
        let row = self.row_at_end(at);
        self.end_on_failure(row)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.is_at_rest() {
            let rows = self.rows_at_rest(at);
            return self.end_on_failure(rows);
        }
        // A part of a step, where a run ends within it, is not carried over.
        if at.in_failed_step || at.k <= self.taken {
            return ControlFlow::Continue(());
        }
        let pushed = self.push(at);
        self.end_on_failure(pushed)
    }
}

impl Columns<'_, '_> {
    fn end_on_failure(&mut self, result: Result<(), SensitivityError>) -> ControlFlow<Stop> {
        match result {
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(Stop::here("a derivative that cannot be computed"))
            }
        }
    }
}

/// A row with the derivatives of its velocity; `dt` are the derivatives of its time.
pub(super) fn row(
    problem: &Differentiable<'_>,
    state: MotionState,
    columns: &[Column],
    dt: impl Fn(&Column) -> f64,
) -> Result<TangentRow, StepError> {
    let x = Point { q: state.q.clone(), v: state.v.clone(), z: state.z };
    let of_velocity = VelocityDependence::at(problem, state.t, &x, &state.p)?;
    let derivative = |column: &Column| {
        let Column { q, p, z, parameter, .. } = column;
        let v = of_velocity.along(q, p, *z, *parameter, dt(column));
        StateDerivative { q: q.clone(), v, p: p.clone(), z: *z }
    };
    Ok(TangentRow { state, columns: columns.iter().map(derivative).collect() })
}

impl<'p, P: DifferentiableProblem<'p>> Run<'p, '_, P> {
    /// Performs the run, and differentiates its final state with respect to variables. The derivatives are those of the
    /// discrete run, to round-off: of the steps that were given, or that were chosen for an accuracy, which are not
    /// differentiated themselves.
    ///
    /// ```
    /// use contact_examples::systems::Pendulum;
    /// use contact_geom::VelocityPoint;
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
    pub fn tangent(self, variables: &[Variable], until: Until) -> Result<Tangent, SensitivityError> {
        self.tangent_at(variables, &[], until)
    }

    /// The same with the states and derivatives at these times, which ascend, or descend for a run backward in time.
    /// States between the ends of steps are those of [`Rows`](crate::Rows): of steps that end there.
    ///
    /// # Errors
    /// Those of [`tangent`](Self::tangent), and [`InputError::Times`](crate::InputError::Times) for times that are not
    /// in order or outside of the span of the run.
    pub fn tangent_at(self, variables: &[Variable], times: &[f64], until: Until) -> Result<Tangent, SensitivityError> {
        let run = self.differentiable()?;
        let problem = run.problem.differentiable();
        let plan = run.plan(until)?;
        let engine = StepTangent::new(&problem, &plan.steps, Direction::Forward)?;
        let columns = variables.iter().map(|v| v.column(&problem, plan.count()));
        let mut columns = columns.collect::<Result<Vec<_>, _>>()?;
        if let Some(start) = projected_start(&problem, &plan)? {
            columns.iter_mut().for_each(|column| start.push(column));
        }
        if engine.only_in_start()
            && let Some(variable) = variables.iter().find(|variable| !variable.is_of_start())
        {
            let method = plan.steps.info.name.clone();
            return Err(SensitivityError::OnlyInStart { method, variable: variable.clone() });
        }
        if let Some(case) = columns.iter().find_map(|column| engine.obstacle(column.parameter?)) {
            return Err(no_tangent(&plan, case));
        }
        let mut observer = Columns {
            plan: &plan,
            carried: CarriedColumns::new(
                &problem,
                &plan.steps,
                engine,
                columns,
                RowTimes::new(times, (problem.problem.t0, plan.steps.t_end)),
            ),
            before: (problem.problem.t0, problem.problem.state.clone()),
            largest: 0.0,
            taken: 0,
            failure: None,
        };
        let outcome = run.observed(&plan, &mut observer)?;
        let Columns { carried: CarriedColumns { columns, rows, switches, .. }, largest, failure, .. } = observer;
        match failure {
            None => Ok(Tangent { switches, ..tangent(&problem, outcome, &columns, rows, largest) }),
            Some(failure) => Err(failure),
        }
    }
}

fn tangent(
    problem: &Differentiable<'_>,
    outcome: Outcome,
    columns: &[Column],
    rows: Vec<TangentRow>,
    largest: f64,
) -> Tangent {
    let nan = || Vector::repeat(problem.dimension(), f64::NAN);
    let of_state =
        |column: &Column| StateDerivative { q: column.q.clone(), v: nan(), p: column.p.clone(), z: column.z };
    let last = outcome.v.as_ref().filter(|_| outcome.status == Status::Completed).and_then(|v| {
        let state = MotionState::at(outcome.t, &outcome.state(), v);
        row(problem, state, columns, |column| column.time_after(outcome.steps)).ok()
    });
    let size = columns.iter().fold(0.0, |m, column| max_or_nan(m, column.size()));
    Tangent {
        outcome,
        columns: last.map_or_else(|| columns.iter().map(of_state).collect(), |row| row.columns),
        rows,
        switches: Vec::new(),
        growth: if largest > size { largest / size } else { 1.0 },
    }
}

/// The projection of the start of a run with constraints.
pub(super) fn projected_start<'p>(
    problem: &Differentiable<'p>,
    plan: &Plan<'p>,
) -> Result<Option<ProjectedStart>, SensitivityError> {
    ProjectedStart::of(problem, &plan.steps).map_err(|cause| SensitivityError::Step { step: 0, cause })
}

/// The error of a run whose integrator has no tangent.
pub(crate) fn no_tangent(plan: &Plan<'_>, case: &'static str) -> SensitivityError {
    SensitivityError::NoTangent { method: plan.steps.info.name.clone(), case }
}
