//! The sub-flows of splittings.

use super::coefficients::CoefficientDerivatives;
use super::drift::{Drag, Drift};
use super::kick::Kick;
use super::kinetic::{Kinetic, rest_of};
use super::sub_flow::SubFlow;
use super::velocity_drag::DragLaw;
use super::{SubFlows, action_map, velocity_drag};
use crate::integration::{StepEnds, SystemProblem};
use crate::sensitivity::parametric_system::Quantities;
use crate::splitting::Riccati;
use crate::{ForceKind, InputError, SplittingScheme, State, StepError, System};
use std::rc::Rc;

/// A kick or a drift of a scheme, which begins at this fraction of the step, over a fraction of it.
#[derive(Clone, Copy, Debug)]
enum Part {
    Kick { start: f64, duration: f64 },
    Drift { start: f64, duration: f64 },
}

/// The kicks and drifts of a scheme, in their order. The last ones of a step are not combined with the first ones of the
/// next, as steppers do to save an evaluation.
fn parts(scheme: &SplittingScheme) -> Vec<Part> {
    let (drifts, kicks) = scheme.coefficients();
    let mut parts = Vec::with_capacity(drifts.len() + kicks.len());
    let mut start = 0.0;
    for i in 0..drifts.len().max(kicks.len()) {
        if let Some(&duration) = kicks.get(i).filter(|kick| **kick != 0.0) {
            parts.push(Part::Kick { start, duration });
        }
        if let Some(&duration) = drifts.get(i).filter(|drift| **drift != 0.0) {
            parts.push(Part::Drift { start, duration });
            start += duration;
        }
    }
    parts
}

/// The derivatives of the coefficients in each parameter, at the start of a problem.
fn coefficients_of(problem: &SystemProblem<'_>, of: &mut dyn Quantities) -> Vec<CoefficientDerivatives> {
    CoefficientDerivatives::all(problem.system.hints().forced, of, problem.t0, &rest_of(problem))
}

/// Kicks, and drifts with a linear drag in z.
pub(super) struct LinearDragFlows<'a> {
    system: Rc<dyn System + 'a>,
    kinetic: Kinetic,
    drag: Drag,
    coefficients: Vec<CoefficientDerivatives>,
    parts: Vec<Part>,
}

impl<'a> LinearDragFlows<'a> {
    /// # Errors
    /// Those of [`Splitting::new`](crate::splitting::Splitting::new).
    pub fn new(
        problem: &SystemProblem<'a>,
        scheme: &SplittingScheme,
        of: &mut dyn Quantities,
    ) -> Result<Self, InputError> {
        let (system, rest) = (problem.system.clone(), rest_of(problem));
        let drag = match system.structure().has_constant_rate() {
            true => Drag::Constant(system.gradient(problem.t0, &rest).z),
            false => Drag::Timed(rest),
        };
        let (kinetic, coefficients) = (Kinetic::of(problem)?, coefficients_of(problem, of));
        Ok(LinearDragFlows { system, kinetic, drag, coefficients, parts: parts(scheme) })
    }
}

impl SubFlows for LinearDragFlows<'_> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut (dyn Quantities + '_)>,
        flows: &mut Vec<SubFlow>,
    ) -> Result<(), StepError> {
        let mut state = step.start.clone();
        for part in &self.parts {
            let of = of.as_deref_mut();
            flows.push(match *part {
                Part::Kick { start, duration } => {
                    let kick = Kick { t: step.t + start * step.h, s: duration * step.h, z: 0.0, constant: 0.0 };
                    SubFlow { start, duration, ..kick.linearise(&*self.system, of, &[], &mut state) }
                }
                Part::Drift { start, duration } => {
                    let (t, s) = (step.t + start * step.h, duration * step.h);
                    let drift = Drift { system: &*self.system, kinetic: &self.kinetic, drag: Some(&self.drag), t, s };
                    let of = of.map(|of| (of, &self.coefficients[..]));
                    SubFlow { start, duration, ..drift.linearise(of, &mut state) }
                }
            });
        }
        Ok(())
    }

    fn obstacle(&self, parameter: usize) -> Option<&'static str> {
        let of = self.coefficients.get(parameter)?;
        let drags = " in a parameter of a drag of the velocity that is 0, with this mass matrix or rate L_z";
        of.obstacle_in_action().or_else(|| of.has_drag().then_some(drags))
    }
}

/// Kicks, and drifts with a drag of the velocity.
pub(super) struct DragFlows<'a> {
    system: Rc<dyn System + 'a>,
    law: DragLaw,
    nystrom: bool,
    coefficients: Vec<CoefficientDerivatives>,
    parts: Vec<Part>,
}

impl<'a> DragFlows<'a> {
    /// Whether the drag of a problem is that of the velocity: if there is one, or if a parameter changes it, where the flow
    /// allows it.
    pub fn applies(problem: &SystemProblem<'a>, of: &mut dyn Quantities) -> bool {
        let system = &problem.system;
        if !system.hints().forced {
            return false;
        }
        if !matches!(system.force_kind(), ForceKind::None | ForceKind::OfPositions) {
            return true;
        }
        let coefficients = coefficients_of(problem, of);
        let law = Kinetic::of(problem).and_then(|kinetic| DragLaw::of(problem, &kinetic));
        let allowed = system.structure().has_constant_rate() && law.is_ok();
        allowed && coefficients.iter().any(CoefficientDerivatives::has_drag)
    }

    /// # Errors
    /// Those of [`DragSplitting::new`](crate::splitting::DragSplitting::new).
    pub fn new(
        problem: &SystemProblem<'a>,
        scheme: &SplittingScheme,
        of: &mut dyn Quantities,
    ) -> Result<Self, InputError> {
        let law = DragLaw::of(problem, &Kinetic::of(problem)?)?;
        let (system, coefficients) = (problem.system.clone(), coefficients_of(problem, of));
        Ok(DragFlows { system, law, nystrom: scheme.is_nystrom(), coefficients, parts: parts(scheme) })
    }
}

impl SubFlows for DragFlows<'_> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut (dyn Quantities + '_)>,
        flows: &mut Vec<SubFlow>,
    ) -> Result<(), StepError> {
        let mut state = step.start.clone();
        for part in &self.parts {
            let of = of.as_deref_mut();
            flows.push(match *part {
                Part::Kick { start, duration } => {
                    let kick = Kick { t: step.t + start * step.h, s: duration * step.h, z: 0.0, constant: 0.0 };
                    SubFlow { start, duration, ..kick.linearise(&*self.system, of, &[], &mut state) }
                }
                Part::Drift { start, duration } => {
                    let coefficients = of.map(|_| &self.coefficients[..]);
                    let flow = velocity_drag::linearise(&self.law, duration * step.h, coefficients, &mut state);
                    SubFlow { start, duration, ..flow }
                }
            });
        }
        Ok(())
    }

    fn obstacle(&self, parameter: usize) -> Option<&'static str> {
        let equal = self.law.has_equal_coefficients();
        self.coefficients.get(parameter)?.obstacle(self.law.quadratic != 0.0, equal, self.nystrom)
    }
}

/// Flows of the action, kicks, and drifts without drag.
pub(super) struct ActionFlows<'a> {
    system: Rc<dyn System + 'a>,
    kinetic: Kinetic,
    flow: Riccati,
    /// The derivatives of the coefficients `(b, c)` of the flow in each parameter.
    of_flow: Vec<[f64; 2]>,
    coefficients: Vec<CoefficientDerivatives>,
    /// The action at which L is evaluated for the kicks.
    z: f64,
    substeps: Vec<f64>,
}

impl<'a> ActionFlows<'a> {
    /// # Errors
    /// Those of [`ActionSplitting::new`](crate::splitting::ActionSplitting::new).
    pub fn new(
        problem: &SystemProblem<'a>,
        scheme: &SplittingScheme,
        of: &mut dyn Quantities,
    ) -> Result<Self, InputError> {
        let (system, t, rest) = (problem.system.clone(), problem.t0, rest_of(problem));
        let c = 0.5 * system.hessian(t, &rest).zz;
        let flow = Riccati { b: system.gradient(t, &rest).z - 2.0 * c * rest.z, c };
        let (kinetic, coefficients) = (Kinetic::of(problem)?, coefficients_of(problem, of));
        // The rate is L_z = b + 2 c z.
        let of_flow = coefficients.iter().map(|of| [of.gamma - of.bend * rest.z, 0.5 * of.bend]);
        let of_flow = of_flow.collect();
        let substeps = scheme.substeps().ok_or(InputError::Unclaimed { claim: "z_affine" })?;
        Ok(ActionFlows { system, kinetic, flow, of_flow, coefficients, z: rest.z, substeps })
    }

    /// `b z + c z^2` at the action of the kicks.
    fn constant([b, c]: [f64; 2], z: f64) -> f64 {
        z * (z * c + b)
    }
}

impl SubFlows for ActionFlows<'_> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut (dyn Quantities + '_)>,
        flows: &mut Vec<SubFlow>,
    ) -> Result<(), StepError> {
        let mut state = step.start.clone();
        let Riccati { b, c } = self.flow;
        let constant = Self::constant([b, c], self.z);
        let constants: Vec<f64> = self.of_flow.iter().map(|of| Self::constant(*of, self.z)).collect();
        let (mut start, with_sources) = (0.0, of.is_some());
        for g in &self.substeps {
            let half = 0.5 * g;
            let act = |start: f64, state: &mut State| {
                let of_flow = with_sources.then_some(&self.of_flow[..]);
                SubFlow { start, duration: half, ..action_map::linearise(self.flow, half * step.h, of_flow, state) }
            };
            let kick = |start: f64, of: Option<&mut (dyn Quantities + '_)>, state: &mut State| {
                let kick = Kick { t: step.t + start * step.h, s: half * step.h, z: self.z, constant };
                SubFlow { start, duration: half, ..kick.linearise(&*self.system, of, &constants, state) }
            };
            flows.push(act(start, &mut state));
            flows.push(kick(start, of.as_deref_mut(), &mut state));
            let (t, s) = (step.t + start * step.h, g * step.h);
            let drift = Drift { system: &*self.system, kinetic: &self.kinetic, drag: None, t, s };
            let sources = of.as_deref_mut().map(|of| (of, &self.coefficients[..]));
            flows.push(SubFlow { start, duration: *g, ..drift.linearise(sources, &mut state) });
            start += g;
            flows.push(kick(start, of.as_deref_mut(), &mut state));
            flows.push(act(start, &mut state));
        }
        Ok(())
    }
}
