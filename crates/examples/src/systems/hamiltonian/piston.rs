//! A gas under a piston.

use super::Gas;
use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};

/// A gas in a cylinder under a piston with friction, a simple thermodynamic system: the energy
/// `H = p^2/(2 m) + F q + U(A q, S)` with the height q of the piston and `S = s z`.
///
/// The motions of the evolution field, those of [`AtEnergy`](contact_geom::AtEnergy), are `q' = p/m`,
/// `p' = A P - F - s T p`, `S' = s p^2/m`: the friction is proportional to the temperature, and its power `T S'` is heat
/// of the gas. With `s = 0` the piston oscillates at constant entropy. Gay-Balmaz and Yoshimura, "A Lagrangian variational
/// formulation for nonequilibrium thermodynamics", J. Geom. Phys. 111 (2017); Bajo, de Leon and Lopez-Gordon, "Geometric
/// integrators for adiabatically closed simple thermodynamic systems", arXiv 2511.14154 (the same piston with ideal gas
/// and van der Waals' gas; a friction that does not depend on the temperature is that of
/// [`Containers`](super::Containers)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piston {
    /// The gas.
    pub gas: Gas,
    /// The mass m of the piston.
    pub mass: f64,
    /// Its area A.
    pub area: f64,
    /// The force F on the piston, from its weight and from the pressure outside.
    pub load: f64,
    /// The coefficient s of the friction.
    pub friction: f64,
}

impl Default for Piston {
    fn default() -> Self {
        Piston { gas: Gas::ideal(), mass: 1.0, area: 1.0, load: 1.0, friction: 0.1 }
    }
}

impl Piston {
    /// Natural initial data: at rest at `q = 1`, where the gas is not in equilibrium with the load; `S = 0`.
    pub fn initial(&self) -> PhasePoint<1> {
        PhasePoint::new([1.0], [0.0], 0.0)
    }

    /// The temperature of the gas in a state.
    pub fn temperature(&self, x: &PhasePoint<1>) -> f64 {
        self.gas.temperature(x.q[0] * self.area, x.z * self.friction)
    }

    /// The entropy of the gas in a state.
    pub fn entropy(&self, x: &PhasePoint<1>) -> f64 {
        x.z * self.friction
    }
}

impl ContactHamiltonian<1> for Piston {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        let gas = self.gas.energy(q[0] * self.area, z * self.friction);
        p[0] * p[0] * (0.5 / self.mass) + q[0] * self.load + gas
    }

    fn structure(&self) -> HamiltonianStructure {
        let adiabatic = self.friction == 0.0;
        HamiltonianStructure {
            autonomous: true,
            z_free: adiabatic,
            z_affine: adiabatic,
            constant_rate: adiabatic,
            separable: adiabatic,
            degree: Some(2),
            homogeneous: false,
        }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl contact_geom::ParametricHamiltonian<1> for Piston {}
