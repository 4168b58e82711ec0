//! Contact density dynamics.

use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, InTransformedTime, PhasePoint, Scalar};

/// The density f of the action z in the ensemble of a [`ContactThermostat`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bath {
    /// The logistic density `f = 1/(4 c cosh^2(z/(2 c)))`.
    Logistic {
        /// The scale c.
        scale: f64,
    },
    /// The normal density of mean 0.
    Gaussian {
        /// The variance.
        variance: f64,
    },
}

impl Bath {
    /// The logarithm of the density, without its normalization for the normal one.
    #[inline(always)]
    fn log_density<T: Scalar>(&self, z: T) -> T {
        match self {
            Bath::Logistic { scale } => (z * (0.5 / scale)).cosh().ln() * -2.0 - (4.0 * scale).ln(),
            Bath::Gaussian { variance } => z * z * (-0.5 / variance),
        }
    }
}

/// Contact density dynamics: a deterministic thermostat for the Gibbs ensemble of an energy `E(q, p)`.
///
/// The contact Hamiltonian is a power of the target density, `h = rho^(-1/(n + 1))` with
/// `rho = exp(-beta E) f(z)` and n coordinates; rho need not be normalized. Then `h' = -h_z h` along a motion, while the
/// flow contracts volume at the rate `(n + 1) h_z`: `rho dq dp dz` is invariant, and `ln rho + (n + 1) ln sigma` is
/// constant along a motion with the conformal factor sigma. If the motion is ergodic, averages in time of functions of
/// (q, p) are those of the Gibbs ensemble of inverse temperature beta. In the sign of this project the coordinate S of
/// the paper is -z. Bravetti and Tapias, "Thermostat algorithm for generating target ensembles", Phys. Rev. E 93 (2016);
/// the logistic bath is that of Tapias, Sanders and Bravetti, "Geometric integrator for simulations in the canonical
/// ensemble", J. Chem. Phys. 145 (2016).
///
/// Since h varies by orders of magnitude, runs of equal steps are better [in the time of the
/// energy](Self::in_time_of_energy).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactThermostat<E> {
    /// The energy; it is evaluated at `z = 0`.
    pub energy: E,
    /// The inverse temperature beta.
    pub beta: f64,
    /// The density of z.
    pub bath: Bath,
}

impl<E> ContactThermostat<E> {
    /// The logarithm of the density rho.
    #[inline(always)]
    pub fn log_density<T: Scalar, const N: usize>(&self, t: T, x: &PhasePoint<N, T>) -> T
    where
        E: ContactHamiltonian<N>,
    {
        self.bath.log_density(x.z) - self.energy.value(t, &x.q, &x.p, T::zero()) * self.beta
    }

    /// The same motion in the time with the rate `g = (n + 1)/(beta h)`, in which it is `q' = E_p`,
    /// `p' = -E_q + (f'/(beta f)) p`, `z' = p . E_p - (n + 1)/beta`. The time of h is the last coordinate. Averages in the
    /// time of h are those with the weights g at equal steps.
    pub fn in_time_of_energy<const N: usize>(self) -> InTransformedTime<Self, TimeOfEnergy<E>, N>
    where
        E: ContactHamiltonian<N> + Clone,
    {
        InTransformedTime { hamiltonian: self.clone(), rate: TimeOfEnergy(self) }
    }
}

impl<E: ContactHamiltonian<N>, const N: usize> ContactHamiltonian<N> for ContactThermostat<E> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        (self.log_density(t, &PhasePoint { q: *q, p: *p, z }) * (-1.0 / (N as f64 + 1.0))).exp()
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure { autonomous: self.energy.structure().autonomous, ..HamiltonianStructure::default() }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<E: ContactHamiltonian<N>, const N: usize> contact_geom::ParametricHamiltonian<N> for ContactThermostat<E> {}

/// The rate `g = (n + 1)/(beta h)` of the time of the energy of a [`ContactThermostat`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeOfEnergy<E>(pub ContactThermostat<E>);

impl<E: ContactHamiltonian<N>, const N: usize> ContactHamiltonian<N> for TimeOfEnergy<E> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, p, z).recip() * ((N as f64 + 1.0) / self.0.beta)
    }

    fn structure(&self) -> HamiltonianStructure {
        ContactHamiltonian::<N>::structure(&self.0)
    }
}
