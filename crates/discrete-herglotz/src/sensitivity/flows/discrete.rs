//! Steps of a custom discrete Lagrangian.

use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use super::{StepEnds, SubFlows};
use crate::sensitivity::parameter_derivatives::ParameterDerivatives;
use crate::{Integrator, Problem, StepError};
use contact_geom::ChartVector;
use contact_geom::nalgebra::SVector;
use std::sync::Arc;

/// Steps whose derivative in the state is that of the discrete Hamiltonian flow, by the implicit function theorem and the
/// second jet of the discrete Lagrangian. How the discrete Lagrangian depends on parameters and on the step size is not
/// known.
pub(super) struct DiscreteSteps<'a, L, const N: usize> {
    pub problem: Problem<'a, L, N>,
    pub integrator: Arc<dyn Integrator<'a, L, N> + 'a>,
}

impl<L, const N: usize> SubFlows<N> for DiscreteSteps<'_, L, N> {
    fn linearise(
        &self,
        step: &StepEnds<N>,
        of: Option<&mut ParameterDerivatives<N>>,
        flows: &mut Vec<SubFlow<N>>,
    ) -> Result<(), StepError> {
        let StepEnds { t, h, start, end } = *step;
        let jacobian = self.integrator.step_jacobian(&self.problem, h, (t, &start, &end))?;
        let matrix = jacobian.filter(|m| m.shape() == (2 * N + 1, 2 * N + 1)).ok_or(StepError::NonFinite)?;
        let mut state = TangentMatrix::identity();
        // The coordinates are in the order q, p, z.
        for j in 0..=2 * N {
            let column = |from: usize| SVector::from_fn(|i, _| matrix[(from + i, j)]);
            state.set_column(j, &ChartVector { x: column(0), y: column(N), z: matrix[(2 * N, j)] });
        }
        let unknown = SVector::from_element(f64::NAN);
        let unknown = ChartVector { x: unknown, y: unknown, z: f64::NAN };
        let sources = of.map_or_else(Vec::new, |of| vec![unknown; of.count() + 2]);
        flows.push(SubFlow { state, sources, start: 0.0, duration: 1.0 });
        Ok(())
    }

    fn only_in_start(&self) -> bool {
        true
    }
}
