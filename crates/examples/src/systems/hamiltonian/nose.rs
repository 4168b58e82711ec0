//! The thermostats of Nose, and of Nose and Hoover.

use contact_geom::nalgebra::SVector;
use contact_geom::support::{extended, split_last};
use contact_geom::{AtEnergy, ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar, TimesRate};

/// The thermostat of Nose for an energy `E(q, p)` with n coordinates: `H = E(q, p/s) + p_s^2/(2 Q) + g T ln s` with
/// the positions `(q, s)` and the momenta `(p, p_s)`, `M = N + 1`, and `k_B = 1`.
///
/// In the virtual time of H the microcanonical ensemble of H is the Gibbs ensemble of temperature T in `(q, p/s)` for
/// `g = n + 1`. In the physical time, whose rate is s, it is so for `g = n`: [`poincare`](Self::poincare) is the motion in
/// that time. H does not depend on z. Nose, "A molecular dynamics method for simulations in the canonical ensemble", Mol.
/// Phys. 52 (1984).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nose<E, const N: usize> {
    /// The energy; it is evaluated at `z = 0`.
    pub energy: E,
    /// The temperature T, in units of energy.
    pub temperature: f64,
    /// The mass Q of the thermostat.
    pub mass: f64,
    /// The number g of degrees of freedom.
    pub degrees: f64,
}

/// The thermostat of Nose and Poincare: `K = s (H - E0)` with the H of [`Nose`]. Bond, Leimkuhler and Laird, "The
/// Nose-Poincare method for constant temperature molecular dynamics", J. Comput. Phys. 151 (1999).
pub type NosePoincare<E, const N: usize> = TimesRate<AtEnergy<Nose<E, N>>, ScaleOfTime>;

/// The scale s of time, the last position of [`Nose`], as a function on the phase space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScaleOfTime;

impl<const M: usize> ContactHamiltonian<M> for ScaleOfTime {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, M>, _p: &SVector<T, M>, _z: T) -> T {
        q[M - 1]
    }

    fn structure(&self) -> HamiltonianStructure {
        let autonomous = HamiltonianStructure { autonomous: true, z_free: true, ..HamiltonianStructure::default() };
        HamiltonianStructure { z_affine: true, constant_rate: true, degree: Some(0), ..autonomous }
    }
}

impl<E: ContactHamiltonian<N>, const N: usize> Nose<E, N> {
    /// The state with the positions and the momenta of the energy, `s = 1`, and the momentum `p_s` of the thermostat.
    pub fn start<const M: usize>(&self, x: &PhasePoint<N>, p_s: f64) -> PhasePoint<M> {
        PhasePoint { z: 0.0, ..extended(x, 1.0, p_s) }
    }

    /// The Hamiltonian of the motion in the physical time from a state.
    pub fn poincare<const M: usize>(self, start: &PhasePoint<M>) -> NosePoincare<E, N> {
        TimesRate { hamiltonian: AtEnergy::of(self, start), rate: ScaleOfTime }
    }
}

impl<E: ContactHamiltonian<N>, const N: usize, const M: usize> ContactHamiltonian<M> for Nose<E, N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, M>, p: &SVector<T, M>, _z: T) -> T {
        let [(position, s), (momentum, p_s)] = [split_last::<T, N, M>(q), split_last::<T, N, M>(p)];
        let scale = s.recip();
        let energy = self.energy.value(t, &position, &momentum.map(|e| e * scale), T::zero());
        energy + p_s * p_s * (0.5 / self.mass) + s.ln() * (self.degrees * self.temperature)
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure {
            autonomous: self.energy.structure().autonomous,
            z_free: true,
            z_affine: true,
            constant_rate: true,
            ..HamiltonianStructure::default()
        }
    }
}

/// The thermostat of Nose and Hoover for an energy `E(q, p)` with n coordinates, as a contact Hamiltonian in a
/// transformed time: `K = n T (1 + p_t exp(-F))`, `F = (E + z^2/(2 Q))/(n T)`, with the positions `(q, t)` and the momenta
/// `(p, p_t)`, `M = N + 1`, and `k_B = 1`.
///
/// On the surface `K = 0` the motion is `q' = E_p`, `p' = -E_q - (z/Q) p`, `z' = p . E_p - n T`: the friction `z/Q` of Nose
/// and Hoover. Derivation: contact density dynamics, see [`ContactThermostat`](super::ContactThermostat), with a normal
/// bath is the motion of `h = exp(F)`, whose field is `X_h = (h/(n T)) (E_p, -E_q - (z/Q) p, p . E_p - n T)`. In the time
/// with the rate `g = n T/h` this is the field of Nose and Hoover, and by
/// [`InTransformedTime`](contact_geom::InTransformedTime) it is that of `g (h + p_t)` on its surface 0. So it is conformally
/// contact with `ln sigma' = -z/Q`, and `E + z^2/(2 Q) - n T ln sigma` is constant, the conserved quantity of Nose and
/// Hoover. The coordinate t is the time of h. Hoover, "Canonical dynamics: equilibrium phase-space distributions", Phys.
/// Rev. A 31 (1985).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoseHoover<E, const N: usize> {
    /// The energy; it is evaluated at `z = 0`.
    pub energy: E,
    /// The temperature T, in units of energy.
    pub temperature: f64,
    /// The mass Q of the thermostat.
    pub mass: f64,
}

impl<E: ContactHamiltonian<N>, const N: usize> NoseHoover<E, N> {
    /// The exponent F.
    #[inline(always)]
    fn exponent<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let energy = self.energy.value(t, q, p, T::zero()) + z * z * (0.5 / self.mass);
        energy / (N as f64 * self.temperature)
    }

    /// The state with `K = 0` of the positions and momenta of the energy, and of z, which is Q times the friction.
    pub fn start<const M: usize>(&self, x: &PhasePoint<N>) -> PhasePoint<M> {
        extended(x, 0.0, -self.exponent(0.0, &x.q, &x.p, x.z).exp())
    }
}

impl<E: ContactHamiltonian<N>, const N: usize, const M: usize> ContactHamiltonian<M> for NoseHoover<E, N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, M>, p: &SVector<T, M>, z: T) -> T {
        let [(position, t), (momentum, p_t)] = [split_last::<T, N, M>(q), split_last::<T, N, M>(p)];
        let exponent = self.exponent(t, &position, &momentum, z);
        (p_t * (-exponent).exp() + 1.0) * (N as f64 * self.temperature)
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure { autonomous: true, ..HamiltonianStructure::default() }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<const M: usize> contact_geom::ParametricHamiltonian<M> for ScaleOfTime {}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<E: ContactHamiltonian<N>, const N: usize, const M: usize> contact_geom::ParametricHamiltonian<M> for Nose<E, N> {}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<E: ContactHamiltonian<N>, const N: usize, const M: usize> contact_geom::ParametricHamiltonian<M>
    for NoseHoover<E, N>
{
}
