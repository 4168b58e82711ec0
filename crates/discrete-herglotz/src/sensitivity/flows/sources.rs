//! The derivatives of a system in its parameters and in time, as sub-flows take them.

use crate::integration::QuantityDerivatives;
use crate::sensitivity::parametric_system::{ExplicitDerivatives, Quantities, Quantity};
use contact_geom::{PhasePoint, VelocityPoint};

/// The derivatives in parameters and time, for a number of coordinates that is known at compile time.
pub(crate) struct Sources<'a>(pub Box<dyn Quantities + 'a>);

impl Sources<'_> {
    /// The number of parameters.
    pub fn count(&self) -> usize {
        self.0.count()
    }

    /// The derivatives at a point.
    pub fn at<const N: usize>(&mut self, quantity: Quantity, t: f64, x: &VelocityPoint<N>) -> QuantityDerivatives<N> {
        fixed(&self.0.at(quantity, t, &x.into()))
    }

    /// The derivatives of a contact Hamiltonian at a state; NaN for a Lagrangian that is not given by one.
    pub fn of_hamiltonian<const N: usize>(
        &mut self,
        quantity: Quantity,
        t: f64,
        state: &PhasePoint<N>,
    ) -> QuantityDerivatives<N> {
        fixed(&self.0.of_hamiltonian(quantity, t, &state.into()))
    }
}

fn fixed<const N: usize>(of: &ExplicitDerivatives) -> QuantityDerivatives<N> {
    QuantityDerivatives { l: of.l, gradient: of.gradient.fixed(), force: of.force.fixed() }
}
