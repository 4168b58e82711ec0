//! The chain of Fermi, Pasta, Ulam and Tsingou.

use crate::{Difference, FIXED, Potential, SparseError, SparseSystem};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// A bond of the alpha-beta chain, `V(r) = r^2/2 + alpha r^3/3 + beta r^4/4` with r its elongation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FputBond {
    /// The coefficient of the cubic term.
    pub alpha: f64,
    /// The coefficient of the quartic term.
    pub beta: f64,
}

impl Potential<1> for FputBond {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, r: &SVector<T, 1>, _c: &[T; 0]) -> T {
        let r = r[0];
        r * r * (r * (r * (0.25 * self.beta) + self.alpha / 3.0) + 0.5)
    }

    #[inline(always)]
    fn gradient<T: Scalar>(&self, _t: T, r: &SVector<T, 1>, _c: &[T; 0]) -> SVector<T, 1> {
        let r = r[0];
        SVector::from([r * (r * (r * self.beta + self.alpha) + 1.0)])
    }
}

/// A chain of `sites` unit masses between two walls, with a bond between neighbours and to the walls, and drag:
/// `L = sum v_i^2/2 - sum V(q_(i+1) - q_i) + gamma z`, `q_0 = q_(n+1) = 0`. Dimensionless.
///
/// This is `contact_examples::systems::Chain` with fixed ends, for any number of sites.
///
/// # Errors
/// [`SparseError::Unknowns`] if `sites` is 0.
pub fn fput_chain(sites: usize, bond: FputBond, gamma: f64) -> Result<SparseSystem, SparseError> {
    let bonds = (0..=sites).map(|i| [i.checked_sub(1).unwrap_or(FIXED), if i == sites { FIXED } else { i }]);
    SparseSystem::new(sites)?.with_mass(1.0).with_drag(gamma).with_potential(Difference(bond), bonds)
}
