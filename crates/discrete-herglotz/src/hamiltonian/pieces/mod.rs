//! Pieces of contact Hamiltonians with closed contact flows.

mod action_part;
mod action_times_homogeneous;
mod affine_flow;
mod kinetic;
mod list;
mod polynomial_in_action;
mod potential;
mod prolonged;
mod quadratic;

pub use action_part::ActionPart;
pub use action_times_homogeneous::ActionTimesHomogeneous;
pub use affine_flow::AffineFlow;
pub use kinetic::Kinetic;
pub use list::{PieceList, PieceSum};
pub use polynomial_in_action::{Polynomial, PolynomialInAction};
pub use potential::Potential;
pub use prolonged::{PointFlow, Prolonged};
pub use quadratic::{Quadratic, QuadraticMap};

use super::ContactIncrement;
use contact_geom::{ContactHamiltonian, PhasePoint, Scalar};

/// A contact Hamiltonian whose flow is known in closed form at each fixed time t: a piece of a splitting.
///
/// The flow over a time tau is conformally contact, `phi* eta = sigma eta` with `ln sigma = -int H_z`. Where it depends
/// on the state only through `(q, z)`, implement [`PointFlow`] instead: [`Prolonged`] derives the momenta. The flow of
/// a z-free piece is a strict contact transformation, `sigma = 1`.
///
/// ```
/// use contact_geom::{PhasePoint, nalgebra::SMatrix};
/// use discrete_herglotz::hamiltonian::{ContactPiece, Quadratic};
/// // The damped oscillator H = p^2/2 + q^2/2 + z/10: a rotation with decay.
/// let one = SMatrix::<f64, 1, 1>::identity();
/// let piece = Quadratic::new(one, one * 0.0, one, -0.1);
/// let x = PhasePoint::new([1.0], [0.0], 0.0);
/// let change = piece.change(&piece.over(0.5), 0.0, &x);
/// assert!((change.sigma_minus_one - (-0.05f64).exp_m1()).abs() < 1e-16);
/// ```
pub trait ContactPiece<const N: usize>: ContactHamiltonian<N> {
    /// What the flow over a time needs and does not depend on the state: the time itself, or matrices.
    type Map: Clone + std::fmt::Debug;

    /// The map over a time tau of either sign.
    fn over(&self, tau: f64) -> Self::Map;

    /// The increment of a state by the map, with the time of H fixed at t; NaN where the flow is not defined so far.
    fn change<T: Scalar>(&self, map: &Self::Map, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T>;
}
