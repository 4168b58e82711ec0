//! Steps of contact Gauss collocation on a contact Hamiltonian.

use super::SubFlows;
use super::sources::Sources;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::StepError;
use crate::gauss::routes::hamiltonian::{StepDerivatives, step_derivatives};
use crate::integration::StepEnds;
use crate::sensitivity::parametric_system::Quantity;
use contact_geom::{Parametric, PhasePoint};

/// Steps on the contact Hamiltonian by which a Lagrangian is given, whatever the rank of `H_pp`.
pub(super) struct HamiltonianSteps<'a, L> {
    pub lagrangian: &'a L,
    pub stages: usize,
}

impl<L: Parametric<N>, const N: usize> SubFlows<N> for HamiltonianSteps<'_, L> {
    fn linearise(
        &self,
        step: &StepEnds,
        of: Option<&mut Sources<'_>>,
        flows: &mut Vec<SubFlow<N>>,
    ) -> Result<(), StepError> {
        let (t, h, start) = (step.t, step.h, step.start.fixed::<N>());
        let at = |explicit| step_derivatives(self.lagrangian, self.stages, h, (t, &start), explicit);
        let StepDerivatives { state: columns, sources } = match of {
            None => at(None)?,
            Some(of) => {
                let quantities = (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]);
                at(Some(&mut |t, x: &PhasePoint<N>| {
                    quantities.clone().map(|quantity| of.of_hamiltonian(quantity, t, x)).collect()
                }))?
            }
        };
        let mut state = TangentMatrix::identity();
        columns.iter().enumerate().for_each(|(j, column)| state.set_column(j, column));
        flows.push(SubFlow { state, sources, start: 0.0, duration: 1.0 });
        Ok(())
    }
}
