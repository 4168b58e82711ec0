//! The sub-flows of splittings.

use super::coefficients::CoefficientDerivatives;
use super::drift::Drift;
use super::kick::Kick;
use super::sources::Sources;
use super::sub_flow::SubFlow;
use super::velocity_drag::has_equal_coefficients;
use super::{SubFlows, action_map, velocity_drag};
use crate::integration::StepEnds;
use crate::splitting::Riccati;
use crate::splitting::drag::Drag;
use crate::splitting::separable::SeparableForm;
use crate::splitting::velocity_drag_flow::DragLaw;
use crate::{InputError, Problem, SplittingScheme, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{Parametric, PhasePoint, VelocityPoint};

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

/// The start of a problem at rest, where coefficients are evaluated.
fn rest_of<L, const N: usize>(problem: &Problem<'_, L, N>) -> VelocityPoint<N> {
    VelocityPoint { q: problem.state.q, v: SVector::zeros(), z: problem.state.z }
}

/// The separable form of a problem whose claims are verified.
fn form_of<'a, L: Parametric<N>, const N: usize>(
    problem: &Problem<'a, L, N>,
) -> Result<SeparableForm<&'a L, N>, InputError> {
    SeparableForm::read_of(problem.lagrangian, 1.0, problem.t0, &problem.state, true)
}

/// Kicks, and drifts with a linear drag in z.
pub(super) struct LinearDragFlows<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    drag: Drag<N>,
    coefficients: Vec<CoefficientDerivatives<N>>,
    parts: Vec<Part>,
}

impl<'a, L: Parametric<N>, const N: usize> LinearDragFlows<'a, L, N> {
    /// # Errors
    /// Those of [`Splitting::new`](crate::splitting::Splitting::new).
    pub fn new(
        problem: &Problem<'a, L, N>,
        scheme: &SplittingScheme,
        of: &mut Sources<'_>,
    ) -> Result<Self, InputError> {
        let form = form_of(problem)?;
        let drag = Drag::of(&form, problem.t0, &problem.state)?;
        let coefficients = CoefficientDerivatives::all(L::HINTS.forced, of, problem.t0, &rest_of(problem));
        Ok(LinearDragFlows { form, drag, coefficients, parts: parts(scheme) })
    }
}

impl<L: Parametric<N>, const N: usize> SubFlows<N> for LinearDragFlows<'_, L, N> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut Sources<'_>>,
        flows: &mut Vec<SubFlow<N>>,
    ) -> Result<(), StepError> {
        let mut state = step.start.fixed();
        for part in &self.parts {
            let of = of.as_deref_mut();
            flows.push(match *part {
                Part::Kick { start, duration } => {
                    let kick = Kick { t: step.t + start * step.h, s: duration * step.h, z: 0.0, constant: 0.0 };
                    SubFlow { start, duration, ..kick.linearise(self.form.lagrangian, of, &[], &mut state) }
                }
                Part::Drift { start, duration } => {
                    let (t, s) = (step.t + start * step.h, duration * step.h);
                    let drift = Drift { form: &self.form, drag: Some(&self.drag), t, s };
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
pub(super) struct DragFlows<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    law: DragLaw<N>,
    nystrom: bool,
    coefficients: Vec<CoefficientDerivatives<N>>,
    parts: Vec<Part>,
}

impl<'a, L: Parametric<N>, const N: usize> DragFlows<'a, L, N> {
    /// Whether the drag of a problem is that of the velocity: if there is one, or if a parameter changes it, where the flow
    /// allows it.
    pub fn applies(problem: &Problem<'a, L, N>, of: &mut Sources<'_>) -> bool {
        if const { !L::HINTS.forced } {
            return false;
        }
        if !problem.lagrangian.force_structure().is_of_positions() {
            return true;
        }
        let rest = rest_of(problem);
        let coefficients = CoefficientDerivatives::all(L::HINTS.forced, of, problem.t0, &rest);
        let law = form_of(problem).and_then(|form| DragLaw::of(&form, problem.t0, &rest));
        let allowed = problem.lagrangian.structure().has_constant_rate() && law.is_ok();
        allowed && coefficients.iter().any(CoefficientDerivatives::has_drag)
    }

    /// # Errors
    /// Those of [`DragSplitting::new`](crate::splitting::DragSplitting::new).
    pub fn new(
        problem: &Problem<'a, L, N>,
        scheme: &SplittingScheme,
        of: &mut Sources<'_>,
    ) -> Result<Self, InputError> {
        let (form, rest) = (form_of(problem)?, rest_of(problem));
        let law = DragLaw::of(&form, problem.t0, &rest)?;
        let coefficients = CoefficientDerivatives::all(L::HINTS.forced, of, problem.t0, &rest);
        Ok(DragFlows { form, law, nystrom: scheme.is_nystrom(), coefficients, parts: parts(scheme) })
    }
}

impl<L: Parametric<N>, const N: usize> SubFlows<N> for DragFlows<'_, L, N> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut Sources<'_>>,
        flows: &mut Vec<SubFlow<N>>,
    ) -> Result<(), StepError> {
        let mut state = step.start.fixed();
        for part in &self.parts {
            let of = of.as_deref_mut();
            flows.push(match *part {
                Part::Kick { start, duration } => {
                    let kick = Kick { t: step.t + start * step.h, s: duration * step.h, z: 0.0, constant: 0.0 };
                    SubFlow { start, duration, ..kick.linearise(self.form.lagrangian, of, &[], &mut state) }
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
        let equal = has_equal_coefficients(&self.law);
        self.coefficients.get(parameter)?.obstacle(self.law.quadratic != 0.0, equal, self.nystrom)
    }
}

/// Flows of the action, kicks, and drifts without drag.
pub(super) struct ActionFlows<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    flow: Riccati,
    /// The derivatives of the coefficients `(b, c)` of the flow in each parameter.
    of_flow: Vec<[f64; 2]>,
    coefficients: Vec<CoefficientDerivatives<N>>,
    /// The action at which L is evaluated for the kicks.
    z: f64,
    substeps: Vec<f64>,
}

impl<'a, L: Parametric<N>, const N: usize> ActionFlows<'a, L, N> {
    /// # Errors
    /// Those of [`ActionSplitting::new`](crate::splitting::ActionSplitting::new).
    pub fn new(
        problem: &Problem<'a, L, N>,
        scheme: &SplittingScheme,
        of: &mut Sources<'_>,
    ) -> Result<Self, InputError> {
        let (lagrangian, t) = (problem.lagrangian, problem.t0);
        let (form, rest) = (form_of(problem)?, rest_of(problem));
        let flow = Riccati::of(lagrangian, t, &problem.state)?;
        let coefficients = CoefficientDerivatives::all(L::HINTS.forced, of, t, &rest);
        // The rate is L_z = b + 2 c z.
        let of_flow = coefficients.iter().map(|of| [of.gamma - of.bend * rest.z, 0.5 * of.bend]);
        let of_flow = of_flow.collect();
        let substeps = scheme.substeps().ok_or(InputError::Unclaimed { claim: "z_affine" })?;
        Ok(ActionFlows { form, flow, of_flow, coefficients, z: rest.z, substeps })
    }

    /// `b z + c z^2` at the action of the kicks.
    fn constant([b, c]: [f64; 2], z: f64) -> f64 {
        z * (z * c + b)
    }
}

impl<L: Parametric<N>, const N: usize> SubFlows<N> for ActionFlows<'_, L, N> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut Sources<'_>>,
        flows: &mut Vec<SubFlow<N>>,
    ) -> Result<(), StepError> {
        let mut state: PhasePoint<N> = step.start.fixed();
        let Riccati { b, c } = self.flow;
        let constant = Self::constant([b, c], self.z);
        let constants: Vec<f64> = self.of_flow.iter().map(|of| Self::constant(*of, self.z)).collect();
        let (mut start, with_sources) = (0.0, of.is_some());
        for g in &self.substeps {
            let half = 0.5 * g;
            let act = |start: f64, state: &mut PhasePoint<N>| {
                let of_flow = with_sources.then_some(&self.of_flow[..]);
                SubFlow { start, duration: half, ..action_map::linearise(self.flow, half * step.h, of_flow, state) }
            };
            let kick = |start: f64, of: Option<&mut Sources<'_>>, state: &mut PhasePoint<N>| {
                let kick = Kick { t: step.t + start * step.h, s: half * step.h, z: self.z, constant };
                SubFlow { start, duration: half, ..kick.linearise(self.form.lagrangian, of, &constants, state) }
            };
            flows.push(act(start, &mut state));
            flows.push(kick(start, of.as_deref_mut(), &mut state));
            let drift = Drift { form: &self.form, drag: None, t: step.t + start * step.h, s: g * step.h };
            let sources = of.as_deref_mut().map(|of| (of, &self.coefficients[..]));
            flows.push(SubFlow { start, duration: *g, ..drift.linearise(sources, &mut state) });
            start += g;
            flows.push(kick(start, of.as_deref_mut(), &mut state));
            flows.push(act(start, &mut state));
        }
        Ok(())
    }
}
