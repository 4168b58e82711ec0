//! Steps of contact Gauss collocation on a contact Hamiltonian.

use super::SubFlows;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::gauss::routes::hamiltonian::{StepDerivatives, step_derivatives};
use crate::gauss::system::CollocationSystem;
use crate::integration::StepEnds;
use crate::sensitivity::parametric_system::{Quantities, Quantity};
use crate::{State, StepError};

/// Steps on the contact Hamiltonian by which a Lagrangian is given, whatever the rank of `H_pp`.
pub(super) struct HamiltonianSteps<'a> {
    pub system: Box<dyn CollocationSystem + 'a>,
    pub stages: usize,
}

impl SubFlows for HamiltonianSteps<'_> {
    fn linearise(
        &self,
        step: &StepEnds,
        of: Option<&mut (dyn Quantities + '_)>,
        flows: &mut Vec<SubFlow>,
    ) -> Result<(), StepError> {
        let StepEnds { t, h, start, .. } = step;
        let at = |explicit| step_derivatives(&*self.system, self.stages, *h, (*t, start), explicit);
        let StepDerivatives { state: columns, sources } = match of {
            None => at(None)?,
            Some(of) => {
                let quantities = (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]);
                at(Some(&mut |t, x: &State| {
                    quantities.clone().map(|quantity| of.of_hamiltonian(quantity, t, x)).collect()
                }))?
            }
        };
        let mut state = TangentMatrix::identity(start.q.len());
        columns.into_iter().enumerate().for_each(|(j, column)| state.set_column(j, column));
        flows.push(SubFlow { state, sources, start: 0.0, duration: 1.0 });
        Ok(())
    }
}
