//! Steps of quadrature rules, and compositions of them.

use super::SubFlows;
use super::rule_step::RuleStep;
use super::sources::Sources;
use super::sub_flow::SubFlow;
use crate::StepError;
use crate::integration::StepEnds;
use crate::rules::Node;
use contact_geom::{Parametric, PhasePoint};

/// Steps of the quadrature rule with these nodes, over these fractions of a step. A step over a negative fraction is that
/// of the rule with a negative step size; for a symmetric rule it is the step backward.
pub(super) struct Rules<'a, L> {
    pub lagrangian: &'a L,
    pub nodes: &'static [Node],
    pub lengths: Vec<f64>,
}

impl<L: Parametric<N>, const N: usize> SubFlows<N> for Rules<'_, L> {
    fn linearise(
        &self,
        step: &StepEnds,
        mut of: Option<&mut Sources<'_>>,
        flows: &mut Vec<SubFlow<N>>,
    ) -> Result<(), StepError> {
        let StepEnds { t, h, .. } = *step;
        let (mut state, end): (PhasePoint<N>, PhasePoint<N>) = (step.start.fixed(), step.end.fixed());
        let mut start = 0.0;
        let mut velocity = (end.q - state.q) / h;
        let mut rate = (end.z - state.z) / h;
        for length in &self.lengths {
            let h = length * h;
            let rule = RuleStep { lagrangian: self.lagrangian, nodes: self.nodes, t: t + start * step.h, h };
            // A single step has the known end.
            let guess =
                if self.lengths.len() == 1 { (end.q, end.z) } else { (state.q + velocity * h, state.z + rate * h) };
            let before = state;
            let flow = rule.linearise(of.as_deref_mut(), guess, &mut state)?;
            (velocity, rate) = ((state.q - before.q) / h, (state.z - before.z) / h);
            flows.push(SubFlow { start, duration: *length, ..flow });
            start += length;
        }
        Ok(())
    }
}
