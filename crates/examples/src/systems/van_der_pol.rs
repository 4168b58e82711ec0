//! Van der Pol's oscillator as a contact Hamiltonian system.

use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar, VectorField};

/// Van der Pol's oscillator `q'' + mu (q^2 - 1) q' + q = amplitude cos(omega t)` as the contact Hamiltonian
/// `H = p z + mu (q^2 - 1) z + q - amplitude cos(omega t)` on T\*R x R. Dimensionless: time in units of the inverse
/// frequency of small oscillations, q in units of the amplitude at which the damping changes sign.
///
/// A [`Lienard`](super::Lienard) system: z is the velocity, there is no regular Lagrangian, and `p` usually blows up in
/// finite time while q and z continue to the limit cycle of amplitude about 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VanDerPol {
    /// The strength of the nonlinear damping; for large values the limit cycle is a relaxation oscillation.
    pub mu: f64,
    /// The amplitude of the forcing.
    pub amplitude: f64,
    /// The angular frequency of the forcing.
    pub omega: f64,
}

impl Default for VanDerPol {
    fn default() -> Self {
        VanDerPol { mu: 1.0, amplitude: 0.0, omega: 0.0 }
    }
}

impl VanDerPol {
    /// Natural initial data: `q = 2` at rest, near the limit cycle, with the momentum `p = 0`.
    pub fn initial(&self) -> PhasePoint<1> {
        PhasePoint::new([2.0], [0.0], 0.0)
    }
}

impl VanDerPol {
    /// The restoring and the damping force, and the forcing, at a velocity: `-q''`.
    #[inline(always)]
    fn deceleration<T: Scalar>(&self, t: T, q: T, velocity: T) -> T {
        velocity * (q * q - 1.0) * self.mu + q - (t * self.omega).cos() * self.amplitude
    }

    fn is_autonomous(&self) -> bool {
        self.amplitude == 0.0 || self.omega == 0.0
    }
}

impl ContactHamiltonian<1> for VanDerPol {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        p[0] * z + self.deceleration(t, q[0], z)
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure { autonomous: self.is_autonomous(), degree: Some(1), ..HamiltonianStructure::default() }
    }
}

/// The first-order system `q' = v`, `v' = q''` in the coordinates (q, v). [`Lifted`](contact_geom::Lifted), it runs on where the
/// momentum of the contact Hamiltonian above blows up.
impl VectorField<2> for VanDerPol {
    #[inline(always)]
    fn at<T: Scalar>(&self, t: T, x: &SVector<T, 2>) -> SVector<T, 2> {
        SVector::from([x[1], -self.deceleration(t, x[0], x[1])])
    }

    fn is_autonomous(&self) -> bool {
        VanDerPol::is_autonomous(self)
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl contact_geom::ParametricHamiltonian<1> for VanDerPol {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::Lienard;
    use contact_geom::{AsFunction, ChartVector, SmoothFunction};

    #[test]
    fn it_is_a_lienard_system() {
        let system = VanDerPol { mu: 1.5, amplitude: 0.4, omega: 1.1 };
        let general =
            Lienard { damping: [-1.5, 0.0, 1.5], restoring: [0.0, 1.0, 0.0, 0.0], amplitude: 0.4, omega: 1.1 };
        let (system, general) = (AsFunction(&system), AsFunction(&general));
        for (t, q, p, z) in [(0.0, 2.0, 0.0, 0.5), (0.7, -1.3, 0.4, -0.9), (2.0, 0.2, -2.0, 1.5)] {
            let x = ChartVector { x: [q].into(), y: [p].into(), z };
            let difference = system.differential(t, &x).minus(general.differential(t, &x));
            // A few roundings of terms below 8.
            assert!(difference.amax() <= 32.0 * f64::EPSILON);
            assert!((system.value(t, &x) - general.value(t, &x)).abs() <= 32.0 * f64::EPSILON);
        }
    }
}
