//! The damped oscillator with the heat that it produces.

use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};

/// A damped oscillator whose friction heats a body: the energy `H = p^2/(2 m) + k q^2/2 + r z`, a simple thermodynamic
/// system. Units: any consistent ones.
///
/// The motions of the evolution field, those of [`AtEnergy`](contact_geom::AtEnergy), are `q' = p/m`, `p' = -k q - r p`,
/// `z' = p^2/m`: linear friction of rate r, whose heat `r z` is the internal energy of the body. With its heat capacity
/// C the temperature is `T = T0 + r z/C` and the entropy `S = C ln(T/T0)`, so that `T S' = r p^2/m >= 0`. The coordinate
/// z is a function of the entropy: the contact form `dz - p dq` fixes it up to this choice, and this one makes the
/// friction linear. The motions of H itself, without [`AtEnergy`](contact_geom::AtEnergy), have the same q and p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatedOscillator {
    /// The mass m.
    pub mass: f64,
    /// The stiffness k of the spring.
    pub stiffness: f64,
    /// The rate r of the friction, positive.
    pub rate: f64,
    /// The heat capacity C of the body.
    pub heat_capacity: f64,
    /// The temperature T0 of the body at `z = 0`.
    pub temperature: f64,
}

impl Default for HeatedOscillator {
    fn default() -> Self {
        HeatedOscillator { mass: 1.0, stiffness: 1.0, rate: 0.1, heat_capacity: 1.0, temperature: 1.0 }
    }
}

impl HeatedOscillator {
    /// Natural initial data: stretched to `q = 1`, at rest, at the temperature T0.
    pub fn initial(&self) -> PhasePoint<1> {
        PhasePoint::new([1.0], [0.0], 0.0)
    }

    /// The temperature at z.
    pub fn temperature_at(&self, z: f64) -> f64 {
        self.temperature + self.rate * z / self.heat_capacity
    }

    /// The entropy at z, 0 at `z = 0`.
    pub fn entropy(&self, z: f64) -> f64 {
        self.heat_capacity * (self.rate * z / (self.heat_capacity * self.temperature)).ln_1p()
    }
}

impl ContactHamiltonian<1> for HeatedOscillator {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        p[0] * p[0] * (0.5 / self.mass) + q[0] * q[0] * (0.5 * self.stiffness) + z * self.rate
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure {
            autonomous: true,
            z_free: self.rate == 0.0,
            z_affine: true,
            constant_rate: true,
            separable: true,
            degree: Some(2),
            homogeneous: false,
        }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl contact_geom::ParametricHamiltonian<1> for HeatedOscillator {}
