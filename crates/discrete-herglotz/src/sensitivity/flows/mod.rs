//! Tangents and adjoints of steps that are compositions of sub-flows: splittings, quadrature rules, compositions of rules,
//! and contact Gauss collocation on a contact Hamiltonian, whose step is one sub-flow.
//!
//! The derivative of each sub-flow in the state, in the parameters, in the time and in its duration has a closed form, or
//! follows from the linearised equations of the rule. The tangent of a step is their product; its adjoint is the product of
//! their transposes, in the reverse order.

mod action_map;
mod coefficients;
mod collocation;
mod discrete;
mod drift;
mod exponential_integrals;
mod kick;
mod kinetic;
mod rule_step;
mod rules;
mod splittings;
mod sub_flow;
mod tangent_matrix;
mod velocity_drag;

use crate::StepError;
use crate::integration::{SharedIntegrator, StepEnds, StepFormula};
use crate::sensitivity::SensitivityError;
use crate::sensitivity::columns::{Column, Covector};
use crate::sensitivity::parametric_system::{Differentiable, Quantities};
use collocation::HamiltonianSteps;
use contact_geom::numbers::max_or_nan;
use discrete::DiscreteSteps;
use rules::Rules;
use splittings::{ActionFlows, DragFlows, LinearDragFlows};
use sub_flow::SubFlow;

/// A method whose steps are compositions of sub-flows.
trait SubFlows {
    /// Appends the sub-flows of a step, linearised at its states; with their sources, if `of` is given.
    ///
    /// # Errors
    /// [`StepError`] for a step of a rule that cannot be solved.
    fn linearise(
        &self,
        step: &StepEnds,
        of: Option<&mut (dyn Quantities + '_)>,
        flows: &mut Vec<SubFlow>,
    ) -> Result<(), StepError>;

    /// Why the steps are not differentiable in a parameter, if they are not.
    fn obstacle(&self, _parameter: usize) -> Option<&'static str> {
        None
    }

    /// Whether the steps are differentiable with respect to their start alone: not in parameters, time and step size.
    fn only_in_start(&self) -> bool {
        false
    }
}

/// The tangent of steps that are compositions of sub-flows.
pub(crate) struct FlowEngine<'a> {
    method: Box<dyn SubFlows + 'a>,
    of_parameters: Box<dyn Quantities + 'a>,
    flows: Vec<SubFlow>,
    /// Why the steps are not differentiable in each parameter, if they are not.
    obstacles: Vec<Option<&'static str>>,
}

impl<'a> FlowEngine<'a> {
    /// # Errors
    /// Those of the steps of the method.
    pub fn new(
        of_system: &Differentiable<'a>,
        formula: StepFormula,
        integrator: &SharedIntegrator<'a>,
    ) -> Result<Self, SensitivityError> {
        let (problem, mut of_parameters) = (&of_system.problem, of_system.stages.quantities());
        let (system, of) = (problem.system.clone(), &mut *of_parameters);
        let discrete = |varies| {
            let (problem, integrator) = (problem.clone(), integrator.clone());
            Box::new(DiscreteSteps { problem, integrator, varies })
        };
        let method: Box<dyn SubFlows + 'a> = match formula {
            StepFormula::Splitting(scheme) if !problem.structure.is_affine_in_z() => {
                Box::new(ActionFlows::new(problem, &scheme, of)?)
            }
            StepFormula::Splitting(scheme) if DragFlows::applies(problem, of) => {
                Box::new(DragFlows::new(problem, &scheme, of)?)
            }
            StepFormula::Splitting(scheme) => Box::new(LinearDragFlows::new(problem, &scheme, of)?),
            StepFormula::Rule(nodes) => Box::new(Rules { system, nodes, lengths: vec![1.0] }),
            StepFormula::Composition(nodes, scheme) => {
                let lengths = scheme.substeps().unwrap_or_else(|| vec![1.0]);
                Box::new(Rules { system, nodes, lengths })
            }
            StepFormula::Collocation { stages } => match of_system.of.hamiltonian() {
                Some(system) => Box::new(HamiltonianSteps { system, stages }),
                None => return Err(SensitivityError::NoTangent { method: integrator.info().name, case: "" }),
            },
            StepFormula::Jacobian => discrete(false),
            // The variation of a Lagrangian that is given by a contact Hamiltonian is that of its Legendre transform, which
            // is not implemented.
            StepFormula::Derivatives => discrete(!of_system.is_hamiltonian()),
        };
        let obstacles = (0..of.count()).map(|index| method.obstacle(index)).collect();
        Ok(FlowEngine { method, of_parameters, flows: Vec::new(), obstacles })
    }

    fn linearise(&mut self, step: &StepEnds, with_sources: bool) -> Result<(), StepError> {
        self.flows.clear();
        let of = with_sources.then_some(&mut *self.of_parameters);
        self.method.linearise(step, of, &mut self.flows)?;
        if let Some(first) = self.flows.first_mut() {
            for (source, obstacle) in first.sources.iter_mut().zip(&self.obstacles) {
                if obstacle.is_some() {
                    source.z = f64::NAN;
                }
            }
        }
        Ok(())
    }

    /// Why the steps are not differentiable in a parameter, if they are not.
    pub fn obstacle(&self, parameter: usize) -> Option<&'static str> {
        self.obstacles.get(parameter).copied().flatten()
    }

    /// Whether the steps are differentiable with respect to their start alone.
    pub fn only_in_start(&self) -> bool {
        self.method.only_in_start()
    }

    /// Carries columns from the start of a step, the k-th of the run, to its end; returns the largest component of them.
    ///
    /// # Errors
    /// [`StepError::NonFinite`] for a derivative that is not finite, and those of the steps.
    pub fn push(&mut self, step: &StepEnds, k: usize, columns: &mut [Column]) -> Result<f64, StepError> {
        let with_sources =
            columns.iter().any(|column| column.parameter.is_some() || column.dt0 != 0.0 || column.dh != 0.0);
        self.linearise(step, with_sources)?;
        let mut largest = 0.0;
        for column in columns {
            let mut image = column.state();
            self.flows.iter().for_each(|flow| flow.push(k, column, &mut image));
            column.set_state(image);
            largest = max_or_nan(largest, column.size());
        }
        if largest.is_finite() { Ok(largest) } else { Err(StepError::NonFinite) }
    }

    /// Carries covectors from the end of a step, the k-th of the run, to its start.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn pull(&mut self, step: &StepEnds, k: usize, covectors: &mut [Covector]) -> Result<(), StepError> {
        self.linearise(step, true)?;
        for covector in covectors {
            let mut image = covector.state();
            self.flows.iter().rev().for_each(|flow| flow.pull(k, covector, &mut image));
            covector.set_state(image);
            let size = covector.size();
            if !size.is_finite() {
                return Err(StepError::NonFinite);
            }
            covector.largest = max_or_nan(covector.largest, size);
        }
        Ok(())
    }
}
