//! The tangent of the steps of a run, for every integrator that has one. Steps with several parts are those of
//! [`tangent_parts`](crate::sensitivity::tangent_parts) and [`gradient_parts`](crate::sensitivity::gradient_parts).

use crate::integration::{PartPoint, SolvedPart, StepEnds, WholeStep};
use crate::run::discretization::Discretization;
use crate::sensitivity::SensitivityError;
use crate::sensitivity::columns::{Column, Covector};
use crate::sensitivity::engine::Engine;
use crate::sensitivity::flows::FlowEngine;
use crate::sensitivity::parametric_system::Differentiable;
use crate::sensitivity::step_maps::Direction;
use crate::{State, StepError, Stepper};

/// A step that was taken, with what its tangent needs.
#[expect(clippy::large_enum_variant, reason = "a box would be an allocation in each step")]
pub(crate) enum TakenStep {
    Whole(WholeStep),
    /// The parts of a step that ends parts at zeros of switching functions and at breaks.
    Parts(Vec<SolvedPart>),
}

impl TakenStep {
    /// The last step of a stepper, which started at the given time and state, with the stages of collocation or without;
    /// `None` where they are not known.
    pub fn last_of(stepper: &dyn Stepper, has_stages: bool, h: f64, (t, start): (f64, State)) -> Option<Self> {
        let parts = || {
            let parts = stepper.last_step().map(|step| step.solved_parts());
            parts.filter(|parts| !parts.is_empty()).map(TakenStep::Parts)
        };
        if has_stages {
            let stages = stepper.solved_stages().map(|stages| TakenStep::Whole(WholeStep::Collocation(stages)));
            return stages.or_else(parts);
        }
        let whole = || TakenStep::Whole(WholeStep::Flow(StepEnds { t, h, start, end: stepper.state() }));
        Some(parts().unwrap_or_else(whole))
    }

    /// The time at its start.
    pub fn start_time(&self) -> Option<f64> {
        match self {
            TakenStep::Whole(step) => Some(step.start().0),
            TakenStep::Parts(parts) => parts.first().map(|part| part.from.t),
        }
    }

    /// The point at its start, with a velocity near there.
    pub fn start(&self) -> Option<PartPoint> {
        match self {
            TakenStep::Whole(step) => {
                let (t, state) = step.start();
                Some(PartPoint { t, state: state.clone(), v: step.velocity() })
            }
            TakenStep::Parts(parts) => parts.first().map(|part| part.from.clone()),
        }
    }
}

/// The tangent of the steps of an integrator, forward or as its adjoint.
pub(crate) enum StepTangent<'a> {
    /// From the stages of contact Gauss collocation.
    Collocation(Box<Engine<'a>>),
    /// From the sub-flows of a splitting, a rule or a composition.
    Flow(Box<FlowEngine<'a>>),
}

impl<'a> StepTangent<'a> {
    /// The tangent of the steps of a run.
    ///
    /// # Errors
    /// [`SensitivityError::NoTangent`] and [`SensitivityError::UnderConstraints`] for an integrator without tangent; those of the steps of a splitting.
    pub fn new(
        problem: &Differentiable<'a>,
        steps: &Discretization<'a>,
        direction: Direction,
    ) -> Result<Self, SensitivityError> {
        let info = &steps.info;
        let refused = |case| Err(SensitivityError::NoTangent { method: info.name.clone(), case });
        if info.in_transformed_time || info.divides && problem.is_hamiltonian() {
            return refused("");
        }
        // The steps of a Lagrangian that is given by a contact Hamiltonian have a formula.
        if !problem.is_hamiltonian() && info.collocation.is_some() && steps.integrator.step_formula().is_none() {
            let engine = Engine::new(problem, steps.stages(), steps.h, direction);
            return Ok(StepTangent::Collocation(Box::new(engine)));
        }
        // Its steps near a surface would be those of another method, except for those of a contact Hamiltonian.
        if steps.switches && !(problem.is_hamiltonian() && info.collocation.is_some()) {
            return refused(" for Lagrangians with switching functions");
        }
        match steps.integrator.step_formula() {
            Some(formula) => {
                let engine = FlowEngine::new(problem, formula, &steps.integrator)?;
                Ok(StepTangent::Flow(Box::new(engine)))
            }
            None if info.constrained => {
                Err(SensitivityError::UnderConstraints { method: info.name.clone(), what: "derivatives" })
            }
            None => refused(""),
        }
    }

    /// Whether it is that of the stages of collocation.
    pub fn has_stages(&self) -> bool {
        matches!(self, StepTangent::Collocation(_))
    }

    /// Why the steps are not differentiable in a parameter, if they are not.
    pub fn obstacle(&self, parameter: usize) -> Option<&'static str> {
        match self {
            StepTangent::Collocation(_) => None,
            StepTangent::Flow(engine) => engine.obstacle(parameter),
        }
    }

    /// Whether the steps are differentiable with respect to their start alone.
    pub fn only_in_start(&self) -> bool {
        matches!(self, StepTangent::Flow(engine) if engine.only_in_start())
    }

    /// Carries columns from the start of a step, the k-th of the run, to its end; returns the largest component of them.
    ///
    /// # Errors
    /// [`StepError`] where the equations of the tangent cannot be solved.
    pub fn push(&mut self, step: &WholeStep, k: usize, columns: &mut [Column]) -> Result<f64, StepError> {
        match (self, step) {
            (StepTangent::Collocation(engine), WholeStep::Collocation(step)) => engine.push(step, k, columns),
            (StepTangent::Flow(engine), WholeStep::Flow(step)) => engine.push(step, k, columns),
            _ => Err(StepError::NonFinite),
        }
    }

    /// Carries covectors from the end of a step, the k-th of the run, to its start.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn pull(&mut self, step: &WholeStep, k: usize, covectors: &mut [Covector]) -> Result<(), StepError> {
        match (self, step) {
            (StepTangent::Collocation(engine), WholeStep::Collocation(step)) => engine.pull(step, k, covectors),
            (StepTangent::Flow(engine), WholeStep::Flow(step)) => engine.pull(step, k, covectors),
            _ => Err(StepError::NonFinite),
        }
    }
}

/// The tangent of shortened steps and of parts of steps, which is kept from one to the next.
pub(crate) struct RowTangent<'a> {
    collocation: Option<Engine<'a>>,
}

impl<'a> RowTangent<'a> {
    pub fn new() -> Self {
        RowTangent { collocation: None }
    }

    /// Carries columns over a shortened step or a part from its start; `steps` is the tangent of whole steps.
    ///
    /// # Errors
    /// Those of [`StepTangent::push`].
    pub fn push(
        &mut self,
        steps: &mut StepTangent<'a>,
        problem: &Differentiable<'a>,
        step: &WholeStep,
        columns: &mut [Column],
    ) -> Result<(), StepError> {
        match step {
            // Such steps of a Lagrangian that is given by a contact Hamiltonian are sub-flows.
            WholeStep::Collocation(_) if problem.is_hamiltonian() => Err(StepError::NonFinite),
            WholeStep::Collocation(step) => {
                let engine = Engine::of_row(&mut self.collocation, problem, step, Direction::Forward);
                engine.push(step, 0, columns).map(|_| ())
            }
            WholeStep::Flow(_) => steps.push(step, 0, columns).map(|_| ()),
        }
    }

    /// Carries covectors back over a shortened step or a part; `steps` is the tangent of whole steps.
    ///
    /// # Errors
    /// Those of [`StepTangent::push`].
    pub fn pull(
        &mut self,
        steps: &mut StepTangent<'a>,
        problem: &Differentiable<'a>,
        step: &WholeStep,
        covectors: &mut [Covector],
    ) -> Result<(), StepError> {
        match step {
            WholeStep::Collocation(_) if problem.is_hamiltonian() => Err(StepError::NonFinite),
            WholeStep::Collocation(step) => {
                let engine = Engine::of_row(&mut self.collocation, problem, step, Direction::Backward);
                engine.pull(step, 0, covectors)
            }
            WholeStep::Flow(_) => steps.pull(step, 0, covectors),
        }
    }
}
