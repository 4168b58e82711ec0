//! Contact Hamiltonians in a new time.

use crate::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};
use nalgebra::SVector;

/// A contact Hamiltonian times a rate, `g K`: on the surface `K = 0` its motions are those of K in a new time tau with
/// `dt = g dtau`.
///
/// The rate `g(t, q, p, z)` is any function on the phase space. Derivation: by the product rule
/// `X_(g K) = g X_K + K (X_g + g R)` with the Reeb field R, so that `X_(g K) = g X_K` where `K = 0`. The surface is
/// invariant, since `(g K)' = -(g K)_z g K`, and so is the conformal factor, `(g K)_z = g K_z` on it. The rate of an
/// autonomous K is positive along the motion; for a K that depends on time use [`InTransformedTime`].
///
/// With `K = H - E0`, [`AtEnergy`](crate::AtEnergy), it is Poincare's transformation: that of the evolution field of H.
///
/// ```
/// use contact_examples::systems::hamiltonian::HeatedOscillator;
/// use contact_geom::{AtEnergy, HamiltonianDerivatives, PhasePoint, TimesRate};
/// let start = PhasePoint::new([1.0], [2.0], 3.0);
/// let hamiltonian = AtEnergy::of(HeatedOscillator::default(), &start);
/// // A rate that depends on (q, p, z): the energy itself, 2.8.
/// let field = TimesRate { hamiltonian, rate: HeatedOscillator::default() }.contact_field(0.0, &start);
/// assert!((field.x[0] - 2.0 * 2.8).abs() < 1e-14);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimesRate<K, G> {
    /// The contact Hamiltonian K.
    pub hamiltonian: K,
    /// The rate `g = dt/dtau`.
    pub rate: G,
}

impl<const N: usize, K: ContactHamiltonian<N>, G: ContactHamiltonian<N>> ContactHamiltonian<N> for TimesRate<K, G> {
    const INTERPRETED: bool = K::INTERPRETED || G::INTERPRETED;

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.rate.value(t, q, p, z) * self.hamiltonian.value(t, q, p, z)
    }

    fn structure(&self) -> HamiltonianStructure {
        let (k, g) = (self.hamiltonian.structure(), self.rate.structure());
        HamiltonianStructure {
            autonomous: k.autonomous && g.autonomous,
            z_free: k.z_free && g.z_free,
            z_affine: k.z_free && g.z_free,
            constant_rate: k.z_free && g.z_free,
            degree: k.degree.zip(g.degree).map(|(a, b)| a + b),
            ..HamiltonianStructure::default()
        }
    }
}

/// A contact Hamiltonian in a new time tau with `dt = g dtau`, with the time as an additional coordinate:
/// `K = g(t, q, p, z) (H(t, q, p, z) + p_t)` with coordinates `(q, t)` and momenta `(p, p_t)`, `M = N + 1`.
///
/// On the surface `K = 0`, that is `p_t = -H`, the motions are those of H: `q' = g H_p`, `t' = g`,
/// `p' = g (-H_q - p H_z)`, `z' = g (p . H_p - H)`, since `X_(g K0) = g X_K0` for `K0 = H + p_t` (see [`TimesRate`]) and
/// `X_K0` is `X_H` with `t' = 1`. The conformal factor is that of H. Unlike
/// that of [`Lagrangian::dt_dtau`](crate::Lagrangian::dt_dtau) the rate may depend on time, momenta and action, and H on time.
///
/// ```
/// use contact_examples::systems::hamiltonian::HeatedOscillator;
/// use contact_geom::{HamiltonianDerivatives, InTransformedTime, PhasePoint};
/// let h = HeatedOscillator::default(); // p^2/2 + q^2/2 + z/10
/// let moving = InTransformedTime::<_, _, 1> { hamiltonian: h, rate: h };
/// let start: PhasePoint<2> = moving.start(5.0, &PhasePoint::new([1.0], [2.0], 3.0));
/// let field = moving.contact_field(0.0, &start);
/// assert!((field.x[0] - 5.6).abs() + (field.x[1] - 2.8).abs() < 1e-14); // g H_p and g
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InTransformedTime<H, G, const N: usize> {
    /// The contact Hamiltonian H.
    pub hamiltonian: H,
    /// The rate `g = dt/dtau`.
    pub rate: G,
}

impl<H: ContactHamiltonian<N>, G: ContactHamiltonian<N>, const N: usize> InTransformedTime<H, G, N> {
    /// The state with `K = 0` at a time and a state of H.
    pub fn start<const M: usize>(&self, t: f64, x: &PhasePoint<N>) -> PhasePoint<M> {
        extended(x, t, -self.hamiltonian.value(t, &x.q, &x.p, x.z))
    }
}

impl<H: ContactHamiltonian<N>, G: ContactHamiltonian<N>, const N: usize, const M: usize> ContactHamiltonian<M>
    for InTransformedTime<H, G, N>
{
    const INTERPRETED: bool = H::INTERPRETED || G::INTERPRETED;

    #[inline(always)]
    fn value<T: Scalar>(&self, _tau: T, q: &SVector<T, M>, p: &SVector<T, M>, z: T) -> T {
        let [(position, t), (momentum, energy)] = [first::<T, N, M>(q), first::<T, N, M>(p)];
        let h = self.hamiltonian.value(t, &position, &momentum, z) + energy;
        self.rate.value(t, &position, &momentum, z) * h
    }

    fn structure(&self) -> HamiltonianStructure {
        let z_free = self.hamiltonian.structure().z_free && self.rate.structure().z_free;
        HamiltonianStructure {
            autonomous: true,
            z_free,
            z_affine: z_free,
            constant_rate: z_free,
            ..HamiltonianStructure::default()
        }
    }
}

/// The first N entries of a vector with N + 1 entries, and the last one.
#[inline(always)]
pub(crate) fn first<T: Scalar, const N: usize, const M: usize>(x: &SVector<T, M>) -> (SVector<T, N>, T) {
    const { assert!(M == N + 1, "M is the number of coordinates N of the Hamiltonian, and one more") };
    (SVector::from_fn(|i, _| x[i]), x[N])
}

/// A state with one more coordinate and its momentum.
pub(crate) fn extended<const N: usize, const M: usize>(x: &PhasePoint<N>, q: f64, p: f64) -> PhasePoint<M> {
    const { assert!(M == N + 1, "M is the number of coordinates N of the Hamiltonian, and one more") };
    let with = |of: &SVector<f64, N>, last: f64| SVector::from_fn(|i, _| if i < N { of[i] } else { last });
    PhasePoint { q: with(&x.q, q), p: with(&x.p, p), z: x.z }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<const N: usize, K: ContactHamiltonian<N>, G: ContactHamiltonian<N>> crate::ParametricHamiltonian<N>
    for TimesRate<K, G>
{
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::hamiltonian::{HeatedOscillator, Piston, SpinOrbit};
    use crate::{AtEnergy, ChartVector, HamiltonianDerivatives};

    /// Some hundred units of round-off.
    const ROUND_OFF: f64 = 256.0 * f64::EPSILON;

    /// `X_(g K) = g X_K + K (X_g + g R)` at any point, so that the two are parallel on K = 0.
    #[test]
    fn the_field_of_a_product() {
        let (k, g) = (Piston::default(), HeatedOscillator { rate: 0.7, ..HeatedOscillator::default() });
        for (q, p, z) in [(1.0, 0.5, 0.3), (0.6, -1.0, 2.0), (2.0, 0.1, -1.0)] {
            let x = PhasePoint::new([q], [p], z);
            let (of_k, of_g) = (k.value(0.0, &x.q, &x.p, z), g.value(0.0, &x.q, &x.p, z));
            let (x_k, mut x_g) = (k.contact_field(0.0, &x), g.contact_field(0.0, &x));
            x_g.z += of_g;
            let expected = x_k.scale(of_g).plus(x_g.scale(of_k));
            let found = TimesRate { hamiltonian: k, rate: g }.contact_field(0.0, &x);
            assert!(found.minus(expected).amax() <= ROUND_OFF * (1.0 + expected.amax()), "{found:?}");
            // On a level of K, the evolution field times the rate.
            let found = TimesRate { hamiltonian: AtEnergy::of(k, &x), rate: g }.contact_field(0.0, &x);
            let evolution = ChartVector { z: x_k.z + of_k, ..x_k };
            let off = found.minus(evolution.scale(of_g)).amax();
            assert!(off <= ROUND_OFF * (1.0 + evolution.amax() * of_g.abs()), "{off:e}");
        }
    }

    /// The field of a Hamiltonian that depends on time, with a rate that depends on everything.
    #[test]
    fn the_field_with_the_time_as_a_coordinate() {
        let h = SpinOrbit { amplitude: 0.3, ..SpinOrbit::default() };
        let g = HeatedOscillator { rate: 0.7, ..HeatedOscillator::default() };
        let moving = InTransformedTime::<_, _, 1> { hamiltonian: h, rate: g };
        for (t, q, p, z) in [(0.3, 1.0, 0.5, 0.3), (2.0, 0.6, -1.0, 2.0), (-1.0, 2.0, 0.1, -1.0)] {
            let x = PhasePoint::new([q], [p], z);
            let start: PhasePoint<2> = moving.start(t, &x);
            let (field, of_h) = (moving.contact_field(9.0, &start), h.contact_field(t, &x));
            let rate = g.value(t, &x.q, &x.p, z);
            for (found, expected) in
                [(field.x[0], of_h.x[0]), (field.x[1], 1.0), (field.y[0], of_h.y[0]), (field.z, of_h.z)]
            {
                assert!((found - rate * expected).abs() <= ROUND_OFF * (1.0 + (rate * expected).abs()));
            }
        }
    }
}
