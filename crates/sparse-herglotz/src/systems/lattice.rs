//! Lattices with a potential on each site: Klein-Gordon and sine-Gordon.

use crate::{Difference, Potential, SparseError, SparseSystem};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The potential of a site in the Klein-Gordon equation `q_tt = Laplace q - m^2 q - lambda q^3`,
/// `V(q) = m^2 q^2/2 + lambda q^4/4`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KleinGordon {
    /// The square of the mass m.
    pub mass_squared: f64,
    /// The coefficient of the quartic term.
    pub lambda: f64,
}

impl Potential<1> for KleinGordon {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> T {
        let square = q[0] * q[0];
        square * (square * (0.25 * self.lambda) + 0.5 * self.mass_squared)
    }

    #[inline(always)]
    fn gradient<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> SVector<T, 1> {
        SVector::from([q[0] * (q[0] * q[0] * self.lambda + self.mass_squared)])
    }
}

/// The potential of a site in the sine-Gordon equation `q_tt = Laplace q - omega^2 sin q`,
/// `V(q) = omega^2 (1 - cos q)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SineGordon {
    /// The square of the frequency of a single site.
    pub omega_squared: f64,
}

impl Potential<1> for SineGordon {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> T {
        q[0].versine() * self.omega_squared
    }

    #[inline(always)]
    fn gradient<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> SVector<T, 1> {
        SVector::from([q[0].sin() * self.omega_squared])
    }
}

/// A linear spring, `V(r) = k r^2/2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// The stiffness k.
    pub stiffness: f64,
}

impl Potential<1> for Spring {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, r: &SVector<T, 1>, _c: &[T; 0]) -> T {
        r[0] * r[0] * (0.5 * self.stiffness)
    }

    #[inline(always)]
    fn gradient<T: Scalar>(&self, _t: T, r: &SVector<T, 1>, _c: &[T; 0]) -> SVector<T, 1> {
        SVector::from([r[0] * self.stiffness])
    }
}

/// A lattice of `size[0] x size[1] x ...` unit masses in `D` dimensions with free boundaries, a potential on each site,
/// a linear spring between neighbours, and drag:
/// `L = sum v_i^2/2 - sum W(q_i) - sum_bonds k (q_i - q_j)^2/2 + gamma z`. Dimensionless; `k = 1/dx^2` gives the wave
/// equation on a grid of width dx. The site `(i_0, i_1, ..)` is the unknown `i_0 + size[0] (i_1 + size[1] (i_2 + ..))`.
///
/// # Errors
/// [`SparseError::Unknowns`] if a size is 0 or there are too many sites.
pub fn lattice<W: Potential<1>, const D: usize>(
    size: [usize; D],
    site: W,
    stiffness: f64,
    gamma: f64,
) -> Result<SparseSystem, SparseError> {
    let sites = size.iter().try_fold(1usize, |product, s| product.checked_mul(*s)).unwrap_or(usize::MAX);
    let mut system =
        SparseSystem::new(sites)?.with_mass(1.0).with_drag(gamma).with_potential(site, (0..sites).map(|i| [i]))?;
    let mut stride = 1;
    for along in size {
        // A site has a neighbour along this direction unless it is in the last layer.
        let bonds = (0..sites).filter(|i| i / stride % along + 1 < along).map(|i| [i, i + stride]);
        system = system.with_potential(Difference(Spring { stiffness }), bonds)?;
        stride *= along;
    }
    Ok(system)
}
