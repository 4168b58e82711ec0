//! Motions of the evolution field of a contact Hamiltonian: thermodynamics.

use crate::{ChartVector, ContactHamiltonian, HamiltonianStructure, Hessian, PhasePoint, Scalar};
use nalgebra::SVector;

/// An autonomous contact Hamiltonian minus its value, `H - E0`: its motions from a state with `H = E0` are those of the
/// evolution field of H.
///
/// The evolution field is `E_H = X_H + H R` with the Reeb field R: `q' = H_p`, `p' = -H_q - p H_z`, `z' = p . H_p`. It
/// conserves H, the first law of thermodynamics. If H is the energy of a system and z its entropy, then `H_z = T` is the
/// temperature, `-T p` is a friction force, and `T z' = T p . H_p` is its power, which is heat: where `p . H_p >= 0`,
/// the entropy does not decrease, the second law. Simoes, de Leon, Lainz Valcazar and Martin de Diego, "Contact geometry
/// for simple thermodynamical systems with friction", Proc. R. Soc. A 476 (2020).
///
/// Derivation: `X_(H - E0) = X_H + E0 R`, since only the term `-H` of z' changes, and this is `E_H` where `H = E0`. Along
/// a motion of `H - E0`, `(H - E0)' = -H_z (H - E0)`: the level is invariant, and it attracts where `H_z > 0`. So a
/// contact method for `H - E0` is a method for `E_H`, whose error of the energy decays at the rate of the temperature
/// and does not grow.
///
/// ```
/// use contact_examples::systems::hamiltonian::HeatedOscillator;
/// use contact_geom::{AtEnergy, HamiltonianDerivatives, PhasePoint};
/// let oscillator = HeatedOscillator::default(); // p^2/2 + q^2/2 + z/10
/// let start = PhasePoint::new([1.0], [2.0], 3.0);
/// let field = AtEnergy::of(oscillator, &start).contact_field(0.0, &start);
/// assert_eq!((field.x[0], field.y[0]), (2.0, -1.2));
/// assert!((field.z - 4.0).abs() < 1e-14); // p . H_p
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtEnergy<H> {
    /// The contact Hamiltonian.
    pub hamiltonian: H,
    /// Its value `E0` on the motion.
    pub energy: f64,
}

impl<H> AtEnergy<H> {
    /// The contact Hamiltonian minus its value at a state.
    pub fn of<const N: usize>(hamiltonian: H, start: &PhasePoint<N>) -> Self
    where
        H: ContactHamiltonian<N>,
    {
        let energy = hamiltonian.value(0.0, &start.q, &start.p, start.z);
        AtEnergy { hamiltonian, energy }
    }
}

impl<const N: usize, H: ContactHamiltonian<N>> ContactHamiltonian<N> for AtEnergy<H> {
    const PROVED: bool = H::PROVED;
    const INTERPRETED: bool = H::INTERPRETED;
    const SWITCHING: bool = H::SWITCHING;

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.hamiltonian.value(t, q, p, z) - self.energy
    }

    fn structure(&self) -> HamiltonianStructure {
        let structure = self.hamiltonian.structure();
        HamiltonianStructure { homogeneous: structure.homogeneous && self.energy == 0.0, ..structure }
    }

    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        self.hamiltonian.closed_with_gradient(t, x).map(|(h, d)| (h - self.energy, d))
    }

    fn closed_hessian<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<Hessian<N, T>> {
        self.hamiltonian.closed_hessian(t, x)
    }

    fn switching_functions(&self, t: f64, x: &PhasePoint<N>, values: &mut Vec<f64>) {
        self.hamiltonian.switching_functions(t, x, values);
    }

    fn breaks(&self) -> &[f64] {
        self.hamiltonian.breaks()
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<const N: usize, H: ContactHamiltonian<N>> crate::ParametricHamiltonian<N> for AtEnergy<H> {}
