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
    const SWITCHING: bool = K::SWITCHING || G::SWITCHING;

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

    /// Those of both, and the time since each of their breaks.
    fn switching_functions(&self, t: f64, x: &PhasePoint<N>, values: &mut Vec<f64>) {
        self.hamiltonian.switching_functions(t, x, values);
        self.rate.switching_functions(t, x, values);
        values.extend(self.hamiltonian.breaks().iter().chain(self.rate.breaks()).map(|at| t - at));
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
    const SWITCHING: bool = H::SWITCHING || G::SWITCHING;

    #[inline(always)]
    fn value<T: Scalar>(&self, _tau: T, q: &SVector<T, M>, p: &SVector<T, M>, z: T) -> T {
        let [(position, t), (momentum, energy)] = [split_last::<T, N, M>(q), split_last::<T, N, M>(p)];
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

    /// Those of both, and the time, which is a coordinate, since each of their breaks.
    fn switching_functions(&self, _tau: f64, x: &PhasePoint<M>, values: &mut Vec<f64>) {
        let [(q, t), (p, _)] = [split_last::<f64, N, M>(&x.q), split_last::<f64, N, M>(&x.p)];
        let x = PhasePoint { q, p, z: x.z };
        self.hamiltonian.switching_functions(t, &x, values);
        self.rate.switching_functions(t, &x, values);
        values.extend(self.hamiltonian.breaks().iter().chain(self.rate.breaks()).map(|at| t - at));
    }
}

/// The first N entries of a vector with N + 1 entries, and the last one.
#[inline(always)]
pub fn split_last<T: Scalar, const N: usize, const M: usize>(x: &SVector<T, M>) -> (SVector<T, N>, T) {
    const { assert!(M == N + 1, "M is the number of coordinates N of the Hamiltonian, and one more") };
    (SVector::from_fn(|i, _| x[i]), x[N])
}

/// A state with one more coordinate and its momentum.
pub fn extended<const N: usize, const M: usize>(x: &PhasePoint<N>, q: f64, p: f64) -> PhasePoint<M> {
    const { assert!(M == N + 1, "M is the number of coordinates N of the Hamiltonian, and one more") };
    let with = |of: &SVector<f64, N>, last: f64| SVector::from_fn(|i, _| if i < N { of[i] } else { last });
    PhasePoint { q: with(&x.q, q), p: with(&x.p, p), z: x.z }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<const N: usize, K: ContactHamiltonian<N>, G: ContactHamiltonian<N>> crate::ParametricHamiltonian<N>
    for TimesRate<K, G>
{
}
