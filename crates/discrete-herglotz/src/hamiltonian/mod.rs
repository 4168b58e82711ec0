//! Integrators for contact Hamiltonians `H(t, q, p, z)` that are given directly: splittings into pieces with closed
//! contact flows, generating functions of types II and III, and the modified Hamiltonians of steps.
//!
//! `eta = dz - p dq`, `q' = H_p`, `p' = -H_q - p H_z`, `z' = p . H_p - H`, `sigma' = -H_z sigma`. Every map of this
//! module is conformally contact by construction, `Phi* eta = sigma eta`, whatever the rank of `H_pp`.

mod generating;
mod increment;
mod map_stepper;
mod matrix_exponential;
mod modified;
mod pieces;
mod separable;
mod splitting;
#[cfg(test)]
mod tests;

pub use generating::ContactEuler;
pub use increment::ContactIncrement;
pub use map_stepper::MapStepper;
pub use modified::{MAX_MODIFIED_ORDER, ModifiedDefect, modified_defects, modified_hamiltonian};
pub use pieces::{
    ActionPart, ActionTimesHomogeneous, AffineFlow, ContactPiece, Kinetic, PieceList, PieceSum, PointFlow, Polynomial,
    PolynomialInAction, Potential, Prolonged, Quadratic, QuadraticMap,
};
pub use separable::{
    PartOfAction, PartOfMomenta, PartOfPositions, SeparablePieces, SeparableSplitting, separable_pieces,
};
pub use splitting::{HamiltonianSplitting, PieceMaps, PieceStepper};
