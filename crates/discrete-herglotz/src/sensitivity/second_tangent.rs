//! Second derivatives of the end of a run, forward.

use crate::Status;
use crate::run::{Observer, Outcome, OutputRequest, Plan, Run, StepView, Stop, Until};
use crate::sensitivity::columns::Column;
use crate::sensitivity::engine::Engine;
use crate::sensitivity::engine::second_order::{CarriedTangent, SecondColumn, SecondPush};
use crate::sensitivity::second_derivatives::SecondDerivatives;
use crate::sensitivity::second_ends::{CarriedDerivatives, EndAlong, Pair, StartTangent};
use crate::sensitivity::step_maps::Direction;
use crate::sensitivity::step_tangent::StepTangent;
use crate::sensitivity::{EndState, SensitivityError, StateDerivative, Variable};
use contact_geom::Parametric;
use contact_geom::numbers::max_or_nan;
use std::ops::ControlFlow;

/// A run with the second derivatives of its end.
#[derive(Clone, Debug, PartialEq)]
pub struct SecondTangent<const N: usize> {
    /// The outcome of the run.
    pub outcome: Outcome<N>,
    /// The derivatives of its end; `None` if the run was not completed, for the reason that the status of the outcome
    /// gives.
    pub end: Option<EndDerivatives<N>>,
}

/// The end of a run with its first and second derivatives with respect to variables.
#[derive(Clone, Debug, PartialEq)]
pub struct EndDerivatives<const N: usize> {
    /// The state.
    pub state: EndState<N>,
    /// The first derivatives, in the order of the variables.
    pub columns: Vec<StateDerivative<N>>,
    /// The derivatives of the columns: `second[d][i]` is that of the i-th column along the d-th direction. Without given
    /// directions they are the variables, and `second[i][j]` is the derivative with respect to the variables i and j.
    pub second: Vec<Vec<StateDerivative<N>>>,
    /// The largest second derivative along the run divided by the largest one at its end, at least one: round-off of the
    /// second derivatives is amplified by it.
    pub growth: f64,
}

/// Which second derivatives are computed.
pub(crate) enum Directions<'d> {
    /// Those with respect to each pair of variables.
    Variables,
    /// Those of each column along these directions, whose components are the changes of the variables.
    Given(&'d [Vec<f64>]),
}

/// The derivatives of a completed run along its directions.
pub(crate) struct SecondOrderRun<const N: usize> {
    pub outcome: Outcome<N>,
    pub end: Option<EndAlong<N>>,
}

/// Carries columns and second derivatives along a run.
struct SecondColumns<'r, 'p, L, const N: usize> {
    plan: &'r Plan<'p, L, N>,
    engine: Box<Engine<'p, N>>,
    of_two: SecondDerivatives<N>,
    columns: Vec<Column<N>>,
    /// The factors of the columns in each variable and in each direction.
    variables: Vec<Vec<f64>>,
    directions: Vec<Vec<f64>>,
    second: Vec<(Pair, SecondColumn<N>)>,
    largest: f64,
    taken: usize,
    failure: Option<SensitivityError>,
}

impl<L: Parametric<N>, const N: usize> SecondColumns<'_, '_, L, N> {
    fn push(&mut self, at: &StepView<'_, N>) -> Result<(), SensitivityError> {
        let k = at.k.saturating_sub(1);
        let failed = |cause| SensitivityError::Step { step: k, cause };
        let step = at.stepper.solved_stages().filter(|_| at.stepper.pieces().is_empty());
        let step = step.ok_or_else(|| no_second_tangent(self.plan))?;
        self.engine.push(&step, k, &mut self.columns).map_err(failed)?;
        let parameters = self.plan.steps.problem.lagrangian.parameter_count();
        let columns = &self.columns;
        let carried = |factors: &Vec<f64>| CarriedTangent::combination(columns, factors, parameters);
        let variables: Vec<_> = self.variables.iter().map(carried).collect();
        let directions: Vec<_> = self.directions.iter().map(carried).collect();
        for ((d, i), second) in &mut self.second {
            let tangents = [&directions[*d], &variables[*i]];
            let push =
                SecondPush { engine: &mut self.engine, of_two: &mut self.of_two, step: &step, k, tangents, second };
            self.largest = max_or_nan(self.largest, push.push().map_err(failed)?);
        }
        self.taken = at.k;
        Ok(())
    }
}

impl<L: Parametric<N>, const N: usize> Observer<N> for SecondColumns<'_, '_, L, N> {
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

/// The error of a run whose integrator has no second derivatives.
fn no_second_tangent<L: Parametric<N>, const N: usize>(plan: &Plan<'_, L, N>) -> SensitivityError {
    let case = if const { L::HINTS.hamiltonian } { " for contact Hamiltonians" } else { "" };
    SensitivityError::NoSecondTangent { method: plan.steps.info.name.clone(), case }
}

impl<L: Parametric<N>, const N: usize> Run<'_, '_, L, N> {
    /// Performs the run, and computes the first and second derivatives of its end with respect to variables, for each
    /// pair of them. The derivatives are those of the discrete run, to round-off. The second derivatives of a step solve
    /// the linear stage equations of its tangent, with other known terms.
    ///
    /// ```
    /// use contact_geom::{VelocityPoint, systems::Pendulum};
    /// use discrete_herglotz::{Problem, Steps, Until, sensitivity::Variable};
    /// let pendulum = Pendulum { gamma: -0.01 };
    /// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0))?;
    /// let variables = [Variable::Velocity(0), Variable::Parameter("gamma".into())];
    /// let run = problem.steps(Steps::Size(0.5)).second_tangent(&variables, Until::Time(10.0))?;
    /// if let Some(end) = run.end {
    ///     println!("d2q/dv0 dgamma = {}", end.second[0][1].q[0]);
    /// }
    /// # Ok::<(), discrete_herglotz::sensitivity::SensitivityError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`tangent`](Self::tangent), and [`SensitivityError::NoSecondTangent`] for all integrators but contact Gauss
    /// collocation, and for contact Hamiltonians.
    pub fn second_tangent(self, variables: &[Variable], until: Until) -> Result<SecondTangent<N>, SensitivityError> {
        Ok(self.second_order(variables, Directions::Variables, until)?.into())
    }

    /// The same along directions: for each of them the derivatives of the columns, which are products of the second
    /// derivatives with the direction. A direction has a component for each variable.
    ///
    /// # Errors
    /// Those of [`second_tangent`](Self::second_tangent); [`SensitivityError::Direction`].
    pub fn second_tangent_along(
        self,
        variables: &[Variable],
        directions: &[Vec<f64>],
        until: Until,
    ) -> Result<SecondTangent<N>, SensitivityError> {
        Ok(self.second_order(variables, Directions::Given(directions), until)?.into())
    }

    /// Performs the run with its first and second derivatives.
    pub(crate) fn second_order(
        self,
        variables: &[Variable],
        directions: Directions<'_>,
        until: Until,
    ) -> Result<SecondOrderRun<N>, SensitivityError> {
        let count = variables.len();
        if let Directions::Given(given) = &directions {
            for (index, direction) in given.iter().enumerate() {
                if direction.len() != count || !direction.iter().all(|x| x.is_finite()) {
                    return Err(SensitivityError::Direction { index, components: direction.len(), variables: count });
                }
            }
        }
        let run = self.differentiable()?;
        let plan = run.plan(until)?;
        let StepTangent::Collocation(engine) = StepTangent::new(&plan.steps, Direction::Forward)? else {
            return Err(no_second_tangent(&plan));
        };
        let problem = plan.steps.problem;
        let columns = variables.iter().map(|v| v.column(problem, plan.count())).collect::<Result<Vec<_>, _>>()?;
        let units: Vec<Vec<f64>> =
            (0..count).map(|i| (0..count).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        let (given, symmetric) = match directions {
            Directions::Variables => (units.clone(), true),
            Directions::Given(given) => (given.to_vec(), false),
        };
        let pairs = (0..given.len()).flat_map(|d| (if symmetric { d } else { 0 }..count).map(move |i| (d, i)));
        let mut of_two = SecondDerivatives::new(problem.lagrangian);
        let start = |factors: &Vec<f64>| StartTangent::along(problem, variables, factors);
        let [along, tangents] = [&given, &units].map(|all| all.iter().map(start).collect::<Vec<_>>());
        let second = pairs.map(|(d, i)| {
            let p = StartTangent::second_momentum(problem, &mut of_two, [&along[d], &tangents[i]]);
            ((d, i), SecondColumn::new(p))
        });
        let second = second.collect();
        let mut carried = SecondColumns {
            plan: &plan,
            engine,
            of_two,
            columns,
            variables: units,
            directions: given,
            second,
            largest: 0.0,
            taken: 0,
            failure: None,
        };
        let outcome = run.observed(&plan, &mut carried)?;
        if let Some(failure) = carried.failure {
            return Err(failure);
        }
        let Outcome { status, t, q, p, v, z_or_start: z, steps, .. } = outcome;
        let end = match v.filter(|_| status == Status::Completed) {
            Some(v) => {
                let failed = |cause| SensitivityError::Step { step: steps, cause };
                let SecondColumns { of_two, columns, directions, second, largest, .. } = carried;
                let carried = CarriedDerivatives { of_two, columns, directions, second, largest, steps };
                let state = EndState { t, q, v, p, z };
                Some(EndAlong::new(problem, state, carried, symmetric).map_err(failed)?)
            }
            None => None,
        };
        Ok(SecondOrderRun { outcome, end })
    }
}

impl<const N: usize> From<SecondOrderRun<N>> for SecondTangent<N> {
    fn from(run: SecondOrderRun<N>) -> Self {
        let end = run.end.map(|EndAlong { state, columns, second, growth, .. }| EndDerivatives {
            state,
            columns: columns.iter().map(|column| column.state).collect(),
            second,
            growth,
        });
        SecondTangent { outcome: run.outcome, end }
    }
}
