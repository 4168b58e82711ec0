//! The run of a single member.

use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Ending, Member};
use crate::ensemble::members::{MemberSteps, Members};
use crate::integration::StartProjection;
use crate::run::Interruption;
use crate::{
    InputError, Integrator, Interrupt, MethodInfo, Observer, Outcome, Plan, Problem, Rows, StepError, Stepper,
    StepperOptions, Until,
    integration::{BatchKernel, StepFormula},
};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, Lagrangian, PhasePoint, VelocityPoint};

/// The integrator of an ensemble, for the lifetime of the run of one member.
pub(crate) struct OfMember<'i, 'a, L, const N: usize> {
    pub integrator: &'i (dyn Integrator<'a, L, N> + Sync + 'a),
    pub lagrangian: &'a L,
}

impl<'a, L, const N: usize> OfMember<'_, 'a, L, N> {
    /// A problem for the lifetime of the members.
    fn own(&self, problem: &Problem<'_, L, N>) -> Problem<'a, L, N> {
        let Problem { t0, start, state, from_momentum, structure, .. } = *problem;
        Problem { lagrangian: self.lagrangian, t0, start, state, from_momentum, structure, interrupt: None }
    }
}

impl<'p, 'i: 'p, 'a: 'p, L: Lagrangian<N>, const N: usize> Integrator<'p, L, N> for OfMember<'i, 'a, L, N> {
    fn info(&self) -> MethodInfo {
        self.integrator.info()
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        self.integrator.check(lagrangian)
    }

    fn stepper(
        &self,
        problem: &Problem<'p, L, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'p>, InputError> {
        self.integrator.stepper(&self.own(problem), h, options)
    }

    fn constraint_force(&self, lagrangian: &L, t: f64, x: &VelocityPoint<N>) -> Result<SVector<f64, N>, StepError> {
        self.integrator.constraint_force(lagrangian, t, x)
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        self.integrator.batch_kernel()
    }

    fn step_formula(&self) -> Option<StepFormula> {
        self.integrator.step_formula()
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'p, L, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        self.integrator.step_jacobian(&self.own(problem), h, step)
    }

    fn step_variation(
        &self,
        problem: &Problem<'p, L, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
        parameter: Option<usize>,
        variation: &mut dyn FnMut(f64, &VelocityPoint<N>) -> (f64, ChartVector<N>),
    ) -> Result<Option<ChartVector<N>>, StepError> {
        self.integrator.step_variation(&self.own(problem), h, step, parameter, variation)
    }

    fn start_projection(
        &self,
        problem: &Problem<'p, L, N>,
        parameters: usize,
    ) -> Result<Option<StartProjection>, StepError> {
        self.integrator.start_projection(&self.own(problem), parameters)
    }
}

/// The settings that all members have in common.
#[derive(Clone, Copy)]
pub(crate) struct Common {
    pub until: Until,
    pub action: bool,
    /// The number of steps from one recorded row to the next.
    pub rows: Option<usize>,
}

/// The plans of some members.
pub struct LongestPlan {
    /// A member with its step size and its number of steps, which is the largest one; the first error if none has a plan.
    pub planned: Result<(usize, (f64, usize)), EnsembleError>,
    /// Whether one of the members is expected to come to rest.
    pub rests: bool,
}

impl Common {
    /// Runs a member with all checks of a run, and with an observer if there is one.
    pub fn run(
        &self,
        members: &dyn Members,
        index: usize,
        mut observer: Option<&mut impl Observer>,
        interrupt: Option<Interrupt<'_>>,
    ) -> Member {
        let mut rows = Vec::new();
        let mut outcome: Result<Outcome, InputError> = Err(InputError::NoSteps);
        let started = members.with_run(index, (MemberSteps::Own, interrupt), &mut |run| {
            let run = if self.action { run } else { run.without_action() };
            let mut asking = interrupt.map(Interruption);
            let run = match &mut asking {
                Some(asking) => run.observe(asking),
                None => run,
            };
            let recorded = match self.rows.map(Rows::every).transpose() {
                Ok(recorded) => recorded,
                Err(cause) => {
                    outcome = Err(cause);
                    return;
                }
            };
            let mut recorded = recorded.map(|rows| if self.action { rows } else { rows.without_action() });
            let run = match observer.as_deref_mut() {
                Some(observer) => run.observe(observer),
                None => run,
            };
            outcome = match &mut recorded {
                Some(rows) => run.observe(rows).run(self.until),
                None => run.run(self.until),
            };
            rows = recorded.map_or_else(Vec::new, |recorded| recorded.rows);
        });
        Member { index, ending: started.and(outcome).map(Ending::from), rows }
    }

    /// The number of rows for a number of steps, if they are recorded: the start, every stride, and the end.
    pub fn rows_of(&self, steps: usize) -> usize {
        self.rows.map_or(0, |stride| steps / stride.max(1) + 2)
    }

    /// The longest plan of some members.
    ///
    /// # Errors
    /// [`EnsembleError::Member`] with a false claim of structure, or an interruption.
    pub fn longest_plan(
        &self,
        members: &dyn Members,
        sample: impl Iterator<Item = usize>,
        settings: (MemberSteps, Option<Interrupt<'_>>),
    ) -> Result<LongestPlan, EnsembleError> {
        let (mut planned, mut rests) = (Err(EnsembleError::Empty), false);
        for index in sample {
            let plan = self.plan(members, index, settings).map(|(plan, at_rest)| {
                rests |= at_rest;
                plan
            });
            match (plan, &planned) {
                (Ok(plan), Ok((_, (_, most)))) if plan.1 <= *most => {}
                (Ok(plan), _) => planned = Ok((index, plan)),
                (Err(cause @ (InputError::FalseClaim { .. } | InputError::Interrupted)), _) => {
                    return Err(EnsembleError::Member { index, cause });
                }
                (Err(cause), Err(EnsembleError::Empty)) => planned = Err(EnsembleError::Member { index, cause }),
                (Err(_), _) => {}
            }
        }
        Ok(LongestPlan { planned, rests })
    }

    /// The step size and the number of steps of the run of a member with these steps, and whether it is expected to come
    /// to rest, after all checks of a plan.
    pub fn plan(
        &self,
        members: &dyn Members,
        index: usize,
        settings: (MemberSteps, Option<Interrupt<'_>>),
    ) -> Result<((f64, usize), bool), InputError> {
        let mut planned = Err(InputError::NoSteps);
        members.with_run(index, settings, &mut |run| {
            let run = if self.action { run } else { run.without_action() };
            planned = run
                .plan(self.until)
                .map(|plan: Plan<'_>| ((plan.step_size(), plan.count()), plan.rests_after.is_some()));
        })?;
        planned
    }
}
