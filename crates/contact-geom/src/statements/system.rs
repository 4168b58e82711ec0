//! What a statement needs to know about a system.

use crate::{Parametric, PhasePoint, Scalar, Symmetry, VelocityPoint};

/// A system on which the statements are checked: a regular Lagrangian with initial data, sample points, and its known
/// properties. The package `contact-examples` has a gallery of them.
pub trait System<const N: usize>: Parametric<N> {
    /// The name in tables, in lower case with underscores.
    fn name(&self) -> &'static str;

    /// Natural initial data at time [`initial_time`](Self::initial_time).
    fn initial(&self) -> VelocityPoint<N>;

    /// The time at which a motion naturally starts.
    fn initial_time(&self) -> f64 {
        0.0
    }

    /// A sample time and a sample point of the domain on which L is smooth and regular, away from its boundary: the
    /// image of `2N + 2` numbers of `[0, 1]`. The samples cover the region of typical use; randomised tests draw from
    /// them.
    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<N>);

    /// The Hamiltonian `H` with `E_L = H o FL`, where it is known in closed form.
    fn hamiltonian<T: Scalar>(&self, _t: T, _x: &PhasePoint<N, T>) -> Option<T> {
        None
    }

    /// One-parameter groups that leave L invariant.
    fn symmetries(&self) -> Vec<Symmetry<N>> {
        Vec::new()
    }
}
