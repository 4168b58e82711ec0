//! Pieces f(z) with a flow of the user's.

use super::PointFlow;
use crate::splitting::{ActionFlow, ActionMap};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The part `z' = g(z)` of an [`ActionFlow`], as a [`PointFlow`]: `Prolonged(ActionPart(flow))` is the piece `-g(z)`,
/// with `p1 = phi'(z0) p0` and `sigma = phi'(z0)`.
///
/// ```
/// use contact_geom::{ContactHamiltonian, nalgebra::SVector};
/// use discrete_herglotz::{hamiltonian::{ActionPart, Prolonged}, splitting::Riccati};
/// let drag = Prolonged(ActionPart(Riccati { b: -0.1, c: -0.02 })); // H = 0.1 z + 0.02 z^2
/// let still = SVector::<f64, 1>::zeros();
/// assert!((drag.value(0.0, &still, &still, 1.0) - 0.12).abs() < 1e-16);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ActionPart<F>(pub F);

impl<F: ActionFlow, const N: usize> PointFlow<N> for ActionPart<F> {
    type Map = F::Map;

    fn field<T: Scalar>(&self, _t: T, _q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        (SVector::from_element(T::zero()), self.0.rate(z))
    }

    fn over(&self, tau: f64) -> F::Map {
        self.0.over(tau)
    }

    fn change<T: Scalar>(&self, map: &F::Map, _t: f64, _q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        (SVector::from_element(T::zero()), map.change(z))
    }
}
