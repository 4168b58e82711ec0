//! Gravitating bodies in space, and the outer solar system.

use crate::{Difference, Potential, SparseError, SparseSystem};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The Newtonian gravitational potential of a pair with separation vector r in the plane or in space, `V(r) = -c/|r|`
/// with the parameter `c = G m_a m_b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gravitation;

macro_rules! gravitation {
    ($($dimensions:literal)*) => {$(
        impl Potential<$dimensions, 1> for Gravitation {
            #[inline(always)]
            fn energy<T: Scalar>(&self, _t: T, r: &SVector<T, $dimensions>, c: &[T; 1]) -> T {
                -(c[0] / square(r).sqrt())
            }

            #[inline(always)]
            fn gradient<T: Scalar>(&self, _t: T, r: &SVector<T, $dimensions>, c: &[T; 1]) -> SVector<T, $dimensions> {
                let square = square(r);
                let factor = c[0] / (square * square.sqrt());
                SVector::from_fn(|i, _| r[i] * factor)
            }
        }
    )*};
}
gravitation! { 2 3 }

/// `|r|^2`, summed in the order of the components.
#[inline(always)]
fn square<T: Scalar, const D: usize>(r: &SVector<T, D>) -> T {
    let mut sum = r[0] * r[0];
    for i in 1..D {
        sum += r[i] * r[i];
    }
    sum
}

/// Bodies in space with Newtonian gravitation between all pairs, and linear drag:
/// `L = sum m_i v_i^2/2 + sum_(i<j) G m_i m_j/|q_i - q_j| + gamma z`. Body i has the unknowns `3i, 3i + 1, 3i + 2`.
///
/// Each pair is an element, so that the cost grows with the square of the number of bodies. Over many revolutions use
/// [`SparseSplitting::compensated`](crate::SparseSplitting::compensated). For few bodies
/// `contact_examples::systems::Bodies` with Gauss collocation is more efficient.
///
/// # Errors
/// [`SparseError::Unknowns`] if there are no bodies; [`SparseError::Parameter`] if a mass or `g` is not finite.
pub fn bodies(masses: &[f64], g: f64, gamma: f64) -> Result<SparseSystem, SparseError> {
    let n = masses.len();
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    let elements = pairs.map(|(i, j)| {
        let unknowns = [3 * i, 3 * i + 1, 3 * i + 2, 3 * j, 3 * j + 1, 3 * j + 2];
        (unknowns, [g * masses[i] * masses[j]])
    });
    let each = masses.iter().flat_map(|m| [*m; 3]).collect();
    let system = SparseSystem::new(3 * n)?.with_masses(each).with_drag(gamma);
    system.with_potential(Difference(Gravitation), elements)
}

/// The outer solar system: the Sun with the inner planets, Jupiter, Saturn, Uranus, Neptune and Pluto, on September 5,
/// 1994 at 0h00, in astronomical units, days and solar masses. Source: Hairer, Lubich and Wanner, Geometric Numerical
/// Integration, second edition (2006), section I.2.4, table 2.2 (taken there from Ahnerts Kalender für Sternfreunde
/// 1994).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OuterSolarSystem;

impl OuterSolarSystem {
    /// The gravitational constant, in au^3 / (solar mass day^2).
    pub const G: f64 = 2.95912208286e-4;

    /// The masses in solar masses; that of the Sun includes the inner planets.
    pub const MASSES: [f64; 6] =
        [1.00000597682, 0.000954786104043, 0.000285583733151, 0.0000437273164546, 0.0000517759138449, 1.0 / 1.3e8];

    /// The positions in au.
    pub const POSITIONS: [[f64; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [-3.5023653, -3.8169847, -1.5507963],
        [9.0755314, -3.0458353, -1.6483708],
        [8.3101420, -16.2901086, -7.2521278],
        [11.4707666, -25.7294829, -10.8169456],
        [-15.5387357, -25.2225594, -3.1902382],
    ];

    /// The velocities in au/day.
    pub const VELOCITIES: [[f64; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [0.00565429, -0.00412490, -0.00190589],
        [0.00168318, 0.00483525, 0.00192462],
        [0.00354178, 0.00137102, 0.00055029],
        [0.00288930, 0.00114527, 0.00039677],
        [0.00276725, -0.00170702, -0.00136504],
    ];

    /// The system of the first `count` bodies, from 2 to 6, with the drag `gamma`; five bodies are all but Pluto.
    ///
    /// # Errors
    /// [`SparseError::Parameters`] for any other `count`.
    pub fn system(count: usize, gamma: f64) -> Result<SparseSystem, SparseError> {
        match Self::MASSES.get(..count) {
            Some(masses) if count >= 2 => bodies(masses, Self::G, gamma),
            _ => Err(SparseError::Parameters {
                what: "the number of bodies",
                value: count as f64,
                remedy: "take 2 to 6",
            }),
        }
    }

    /// The initial positions of the first `count` bodies.
    pub fn positions(count: usize) -> Vec<f64> {
        Self::POSITIONS.iter().take(count).flatten().copied().collect()
    }

    /// The initial velocities of the first `count` bodies.
    pub fn velocities(count: usize) -> Vec<f64> {
        Self::VELOCITIES.iter().take(count).flatten().copied().collect()
    }
}
