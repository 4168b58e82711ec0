//! Steps of quadrature rules, and compositions of them.

use super::SubFlows;
use super::rule_step::RuleStep;
use super::sub_flow::SubFlow;
use crate::integration::StepEnds;
use crate::rules::Node;
use crate::sensitivity::parametric_system::Quantities;
use crate::{StepError, System};
use std::rc::Rc;

/// Steps of the quadrature rule with these nodes, over these fractions of a step. A step over a negative fraction is that
/// of the rule with a negative step size; for a symmetric rule it is the step backward.
pub(super) struct Rules<'a> {
    pub system: Rc<dyn System + 'a>,
    pub nodes: &'static [Node],
    pub lengths: Vec<f64>,
}

impl SubFlows for Rules<'_> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut (dyn Quantities + '_)>,
        flows: &mut Vec<SubFlow>,
    ) -> Result<(), StepError> {
        let StepEnds { t, h, .. } = *step;
        let (mut state, end) = (step.start.clone(), &step.end);
        let mut start = 0.0;
        let mut velocity = (&end.q - &state.q) / h;
        let mut rate = (end.z - state.z) / h;
        for length in &self.lengths {
            let h = length * h;
            let rule = RuleStep { system: &*self.system, nodes: self.nodes, t: t + start * step.h, h };
            // A single step has the known end.
            let guess = match self.lengths.len() {
                1 => (end.q.clone(), end.z),
                _ => (&state.q + velocity * h, state.z + rate * h),
            };
            let before = state.clone();
            let flow = rule.linearise(of.as_deref_mut(), guess, &mut state)?;
            (velocity, rate) = ((&state.q - &before.q) / h, (state.z - before.z) / h);
            flows.push(SubFlow { start, duration: *length, ..flow });
            start += length;
        }
        Ok(())
    }
}
