//! Chains and nets of rods.

use super::Weight;
use crate::{Distance, DistanceToPoint, FIXED, SparseError, SparseSystem};

/// A chain of point masses in a vertical plane, joined by rigid rods without mass and hung from the origin: the multiple
/// pendulum `L = sum m |v_i|^2/2 - sum m g y_i + gamma z` with `|x_i - x_(i-1)|^2 = l^2`, `x_0 = 0`. The mass i has the
/// unknowns `2 i` and `2 i + 1`, which is its height.
///
/// ```
/// use sparse_herglotz::systems::RodChain;
/// let rods = RodChain { links: 3, length: 0.5, mass: 1.0, gravity: 9.81 };
/// let chain = rods.system(-0.1)?;
/// assert_eq!(chain.unknowns(), 6);
/// assert_eq!(rods.straight(0.0), [0.0, -0.5, 0.0, -1.0, 0.0, -1.5]);
/// # Ok::<(), sparse_herglotz::SparseError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodChain {
    /// The number of rods, and of masses.
    pub links: usize,
    /// The length of a rod.
    pub length: f64,
    /// The mass of a point.
    pub mass: f64,
    /// The acceleration g of gravity.
    pub gravity: f64,
}

impl RodChain {
    /// The chain hung from the origin, with the drag gamma z.
    ///
    /// # Errors
    /// [`SparseError::Unknowns`] without links; [`SparseError::Parameter`] if a number is not finite.
    pub fn system(&self, gamma: f64) -> Result<SparseSystem, SparseError> {
        let before = |i: usize, k: usize| if i == 0 { FIXED } else { 2 * i - 2 + k };
        let rods = (0..self.links).map(|i| ([before(i, 0), before(i, 1), 2 * i, 2 * i + 1], [self.length]));
        self.masses(gamma)?.with_constraint(Distance, rods)
    }

    /// The chain with a free end instead of the origin: without the first rod.
    ///
    /// # Errors
    /// Those of [`system`](Self::system).
    pub fn free(&self, gamma: f64) -> Result<SparseSystem, SparseError> {
        let rods = (1..self.links).map(|i| ([2 * i - 2, 2 * i - 1, 2 * i, 2 * i + 1], [self.length]));
        self.masses(gamma)?.with_constraint(Distance, rods)
    }

    /// The masses with their weight.
    fn masses(&self, gamma: f64) -> Result<SparseSystem, SparseError> {
        let weights = (0..self.links).map(|i| ([2 * i + 1], [self.mass * self.gravity]));
        let count = self.links.saturating_mul(2);
        SparseSystem::new(count)?.with_mass(self.mass).with_drag(gamma).with_potential(Weight, weights)
    }

    /// The positions in a line, at an angle to the vertical in radians.
    pub fn straight(&self, angle: f64) -> Vec<f64> {
        let (sin, cos) = angle.sin_cos();
        let radius = |i: usize| (i + 1) as f64 * self.length;
        (0..self.links).flat_map(|i| [radius(i) * sin, -radius(i) * cos]).collect()
    }
}

/// A net of point masses in space, with rigid rods without mass between neighbours of a row and of a column, whose first
/// row hangs by rods from the fixed points `(i l, 0, 0)`:
/// `L = sum m |v_i|^2/2 - sum m g z_i + gamma z`, `|x_i - x_j|^2 = l^2`. The mass (i, j) has the unknowns
/// `3 (i + size[0] j)` and the two after it; the third coordinate is the height.
///
/// ```
/// use sparse_herglotz::systems::RodNet;
/// let rods = RodNet { size: [4, 3], length: 0.5, mass: 1.0, gravity: 9.81 };
/// let net = rods.system(-0.1)?;
/// assert_eq!((net.unknowns(), rods.hanging(0.0).len()), (36, 36));
/// # Ok::<(), sparse_herglotz::SparseError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodNet {
    /// The number of masses in a row, and of rows.
    pub size: [usize; 2],
    /// The length of a rod.
    pub length: f64,
    /// The mass of a point.
    pub mass: f64,
    /// The acceleration g of gravity.
    pub gravity: f64,
}

impl RodNet {
    /// The net with the drag gamma z.
    ///
    /// # Errors
    /// [`SparseError::Unknowns`] if a size is 0; [`SparseError::Parameter`] if a number is not finite.
    pub fn system(&self, gamma: f64) -> Result<SparseSystem, SparseError> {
        let ([width, height], l) = (self.size, self.length);
        let count = width.checked_mul(height).and_then(|c| c.checked_mul(3)).unwrap_or(usize::MAX);
        let system = SparseSystem::new(count)?.with_mass(self.mass).with_drag(gamma);
        let unknowns = |i: usize, j: usize| [0, 1, 2].map(|k| 3 * (i + width * j) + k);
        let rod = |a: [usize; 3], b: [usize; 3]| ([a[0], a[1], a[2], b[0], b[1], b[2]], [l]);
        let along = (0..height).flat_map(|j| (1..width).map(move |i| rod(unknowns(i - 1, j), unknowns(i, j))));
        let across = (1..height).flat_map(|j| (0..width).map(move |i| rod(unknowns(i, j - 1), unknowns(i, j))));
        system
            .with_potential(Weight, (0..count / 3).map(|i| ([3 * i + 2], [self.mass * self.gravity])))?
            .with_constraint(DistanceToPoint, (0..width).map(|i| (unknowns(i, 0), [i as f64 * l, 0.0, 0.0, l])))?
            .with_constraint(Distance, along.chain(across))
    }

    /// The positions in a plane through the fixed points, at an angle to the vertical in radians.
    pub fn hanging(&self, angle: f64) -> Vec<f64> {
        let ([width, height], (sin, cos)) = (self.size, angle.sin_cos());
        let depth = |j: usize| (j + 1) as f64 * self.length;
        let row = |j: usize| (0..width).flat_map(move |i| [i as f64 * self.length, depth(j) * sin, -depth(j) * cos]);
        (0..height).flat_map(row).collect()
    }
}
