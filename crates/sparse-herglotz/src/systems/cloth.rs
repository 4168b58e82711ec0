//! A cloth of masses and springs.

use crate::{Difference, Potential, SparseError, SparseSystem};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// A spring between two points in space, `V(r) = k (|r| - l)^2/2`, with the parameters stiffness k and natural length
/// l.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthSpring;

impl Potential<3, 2> for LengthSpring {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, r: &SVector<T, 3>, c: &[T; 2]) -> T {
        let stretch = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt() - c[1];
        stretch * stretch * c[0] * 0.5
    }

    #[inline(always)]
    fn gradient<T: Scalar>(&self, _t: T, r: &SVector<T, 3>, c: &[T; 2]) -> SVector<T, 3> {
        let factor = c[0] - c[0] * c[1] / (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
        SVector::from([r[0] * factor, r[1] * factor, r[2] * factor])
    }
}

/// The weight of a mass, `V(z) = m g z`, with the parameter `m g`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight;

impl Potential<1, 1> for Weight {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, z: &SVector<T, 1>, c: &[T; 1]) -> T {
        z[0] * c[0]
    }
}

/// A cloth of `size[0] x size[1]` unit masses, free at its edges, with springs of natural length 1 along the threads
/// and sqrt(2) along the diagonals, under a weight g, with drag:
/// `L = sum v_i^2/2 - sum k (|r_ij| - l_ij)^2/2 - sum g z_i + gamma z`. Dimensionless. The third coordinate is the
/// height, and the mass (i, j) has the unknowns `3 (i + size[0] j)` and the two after it.
///
/// # Errors
/// [`SparseError::Unknowns`] if a size is 0; [`SparseError::Parameter`] if the stiffness or g is not finite.
pub fn cloth(size: [usize; 2], stiffness: f64, g: f64, gamma: f64) -> Result<SparseSystem, SparseError> {
    let [width, height] = size;
    let count = width.checked_mul(height).and_then(|c| c.checked_mul(3)).unwrap_or(usize::MAX);
    let system = SparseSystem::new(count)?.with_mass(1.0).with_drag(gamma);
    let mut system = system.with_potential(Weight, (0..count / 3).map(|i| ([3 * i + 2], [g])))?;
    // Springs along the threads and along both diagonals, to the neighbour at (dx, dy).
    for (dx, dy) in [(1isize, 0usize), (0, 1), (1, 1), (-1, 1)] {
        let length = ((dx * dx) as f64 + (dy * dy) as f64).sqrt();
        let places = (0..height).flat_map(|j| (0..width).map(move |i| (i, j)));
        let springs = places.filter_map(|(i, j)| {
            let (a, b) = (i.checked_add_signed(dx)?, j + dy);
            let (from, to) = (3 * (i + width * j), 3 * (a + width * b));
            let inside = a < width && b < height;
            inside.then_some(([from, from + 1, from + 2, to, to + 1, to + 2], [stiffness, length]))
        });
        system = system.with_potential(Difference(LengthSpring), springs)?;
    }
    Ok(system)
}
