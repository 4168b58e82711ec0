//! Two gas containers with a common wall.

use super::Gas;
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, Scalar, VectorField};

/// The coordinates of [`Containers`] for the thermal state of the two gases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThermalCoordinates {
    /// The entropies `(S1, S2)`: Gauss collocation has `S1 + S2` not decrease in any step, and errors of the energy of
    /// the order of the method.
    Entropies,
    /// The energies `(E1, E2)`: the total energy is then quadratic, and Gauss collocation conserves it to round-off.
    Energies,
}

/// Two gases in a cylinder of length 2 L that a movable wall separates, a composed thermodynamic system with two
/// entropies: heat conduction and friction of the wall are irreversible.
///
/// With the position q of the wall, its momentum p, the volumes `V1 = A q`, `V2 = A (2 L - q)`, the pressures and the
/// temperatures of the gases, `w = alpha (1/T1 - 1/T2)` and the friction force `-lambda q'`, whose heat is shared equally:
/// `q' = p/m`, `p' = A (P1 - P2) - lambda q'`, `T1 S1' = w + lambda q'^2/2`, `T2 S2' = -w + lambda q'^2/2`. The energy
/// `p^2/(2 m) + E1 + E2` is conserved (first law), and `(S1 + S2)' = w (1/T1 - 1/T2) + lambda q'^2 (1/T1 + 1/T2)/2 >= 0`
/// (second law). The default is the example of Shang and Oettinger, "Structure-preserving integrators for dissipative
/// systems based on reversible-irreversible splitting", Proc. R. Soc. A 476 (2020).
///
/// It is a vector field on `(q, p, S1, S2)` or `(q, p, E1, E2)`; runs take [`Lifted`](contact_geom::Lifted) of it.
///
/// ```
/// use contact_examples::systems::hamiltonian::Containers;
/// use contact_geom::VectorField;
/// let containers = Containers::default();
/// let start = containers.initial().q;
/// assert_eq!(containers.energy(&start), 6.0);
/// assert_eq!(containers.at(0.0, &start).as_slice(), [2.0, 0.0, 0.0, 0.0]); // in equilibrium, but for the momentum
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Containers {
    /// The gases.
    pub gases: [Gas; 2],
    /// The mass m of the wall.
    pub mass: f64,
    /// The area A of the wall.
    pub area: f64,
    /// Half the length L of the cylinder.
    pub length: f64,
    /// The conductivity alpha.
    pub conductivity: f64,
    /// The coefficient lambda of the friction.
    pub friction: f64,
    /// The coordinates.
    pub coordinates: ThermalCoordinates,
}

impl Default for Containers {
    fn default() -> Self {
        Containers {
            gases: [Gas::ideal(); 2],
            mass: 1.0,
            area: 1.0,
            length: 1.0,
            conductivity: 0.5,
            friction: 0.0,
            coordinates: ThermalCoordinates::Entropies,
        }
    }
}

impl Containers {
    /// The initial data of the example: `q = L`, `p = 2`, both entropies 0, and momenta 0 of the lifted system.
    pub fn initial(&self) -> PhasePoint<4> {
        let volume = self.area * self.length;
        let thermal = self.gases.map(|gas| match self.coordinates {
            ThermalCoordinates::Entropies => 0.0,
            ThermalCoordinates::Energies => gas.energy(volume, 0.0),
        });
        PhasePoint::new([self.length, 2.0, thermal[0], thermal[1]], [0.0; 4], 0.0)
    }

    /// The volumes.
    #[inline(always)]
    fn volumes<T: Scalar>(&self, q: T) -> [T; 2] {
        [q * self.area, (-q + 2.0 * self.length) * self.area]
    }

    /// The volumes and the temperatures.
    #[inline(always)]
    fn thermal<T: Scalar>(&self, x: &SVector<T, 4>) -> ([T; 2], [T; 2]) {
        let volumes = self.volumes(x[0]);
        let of = |i: usize| match self.coordinates {
            ThermalCoordinates::Entropies => self.gases[i].temperature(volumes[i], x[2 + i]),
            ThermalCoordinates::Energies => self.gases[i].temperature_of_energy(volumes[i], x[2 + i]),
        };
        (volumes, [of(0), of(1)])
    }

    /// The temperatures.
    pub fn temperatures(&self, x: &SVector<f64, 4>) -> [f64; 2] {
        self.thermal(x).1
    }

    /// The energies of the gases.
    pub fn energies(&self, x: &SVector<f64, 4>) -> [f64; 2] {
        let volumes = self.volumes(x[0]);
        match self.coordinates {
            ThermalCoordinates::Entropies => [0, 1].map(|i| self.gases[i].energy(volumes[i], x[2 + i])),
            ThermalCoordinates::Energies => [x[2], x[3]],
        }
    }

    /// The entropies of the gases.
    pub fn entropies(&self, x: &SVector<f64, 4>) -> [f64; 2] {
        match self.coordinates {
            ThermalCoordinates::Entropies => [x[2], x[3]],
            ThermalCoordinates::Energies => {
                let (volumes, temperatures) = self.thermal(x);
                [0, 1].map(|i| self.gases[i].entropy(volumes[i], temperatures[i]))
            }
        }
    }

    /// The total energy `p^2/(2 m) + E1 + E2`, which is conserved.
    pub fn energy(&self, x: &SVector<f64, 4>) -> f64 {
        x[1] * x[1] * 0.5 / self.mass + self.energies(x).iter().sum::<f64>()
    }
}

impl VectorField<4> for Containers {
    #[inline(always)]
    fn at<T: Scalar>(&self, _t: T, x: &SVector<T, 4>) -> SVector<T, 4> {
        let (volumes, temperatures) = self.thermal(x);
        let pressures = [0, 1].map(|i: usize| self.gases[i].pressure(volumes[i], temperatures[i]) * self.area);
        let velocity = x[1] / self.mass;
        let flow = (temperatures[0].recip() - temperatures[1].recip()) * self.conductivity;
        let heat = velocity * velocity * (0.5 * self.friction);
        let force = pressures[0] - pressures[1] - velocity * self.friction;
        let (first, second) = match self.coordinates {
            ThermalCoordinates::Entropies => ((heat + flow) / temperatures[0], (heat - flow) / temperatures[1]),
            ThermalCoordinates::Energies => {
                (heat + flow - pressures[0] * velocity, heat - flow + pressures[1] * velocity)
            }
        };
        SVector::from([velocity, force, first, second])
    }

    fn is_autonomous(&self) -> bool {
        true
    }
}
