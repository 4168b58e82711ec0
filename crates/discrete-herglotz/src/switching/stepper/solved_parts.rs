//! The parts of the last step with their stages and with what happened at their ends, for derivatives.

use crate::integration::{PartEnd, PartPoint, SolvedPart, SolvedStages, StepEnds, WholeStep};
use crate::switching::step_curve::TimedState;
use crate::switching::stepper::SwitchingStepper;

/// The end of a part of a step.
#[derive(Clone, Debug)]
pub(crate) struct EndOfPart {
    /// The point at which the part begins, the point at which it ends, before anything happens there, and the point from
    /// which the motion continues.
    pub from: TimedState,
    pub to: TimedState,
    pub next: TimedState,
    /// Whether the part has a stepper; otherwise its length is zero.
    pub has_stepper: bool,
    /// The stages of this stepper, if it is not kept but they are.
    pub stages: Option<SolvedStages>,
    pub end: PartEnd,
}

impl SwitchingStepper<'_> {
    /// The parts of the last step, if it had parts and their steppers are kept.
    pub(super) fn parts_with_stages(&self) -> Vec<SolvedPart> {
        if !self.switched {
            return Vec::new();
        }
        let mut steppers = self.parts.iter().flatten();
        let is_hamiltonian = self.problem.system.hints().hamiltonian;
        let point = |at: &TimedState| PartPoint { t: at.t, state: at.state.clone(), v: at.v.clone() };
        let part = |of: &EndOfPart| {
            let kept = if of.has_stepper { steppers.next().and_then(|s| s.stepper().solved_stages()) } else { None };
            let step = match kept.or_else(|| of.stages.clone()) {
                // The derivatives of a step of a contact Hamiltonian are those of a sub-flow.
                Some(_) if is_hamiltonian => Some(WholeStep::Flow(StepEnds {
                    t: of.from.t,
                    h: of.to.t - of.from.t,
                    start: of.from.state.clone(),
                    end: of.to.state.clone(),
                })),
                stages => stages.map(WholeStep::Collocation),
            };
            let known = step.is_some() || !of.has_stepper;
            known.then(|| SolvedPart {
                step,
                from: point(&of.from),
                to: point(&of.to),
                next: point(&of.next),
                end: of.end,
            })
        };
        // Without the stages of one part there is no derivative of the step.
        self.ends.iter().map(part).collect::<Option<Vec<_>>>().unwrap_or_default()
    }
}
