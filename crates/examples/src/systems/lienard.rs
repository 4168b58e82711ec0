//! Liénard systems as contact Hamiltonian systems without a Lagrangian.

use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar, VectorField};

/// A forced Liénard system `q'' + f(q) q' + F(q, t) = 0` as the contact Hamiltonian `H = p z + f(q) z + F(q, t)` on
/// T\*R x R. Dimensionless.
///
/// Here `z` is not an action but the velocity: `q' = H_p = z` and `z' = p H_p - H = -f(q) z - F(q, t)`. H is affine in
/// p, so its fibre derivative is not a diffeomorphism and there is no corresponding regular Lagrangian. The momentum
/// obeys a Riccati equation, `p' = -p^2 - f p - f' z - F_q`, and usually blows up in finite time; q and z do not depend
/// on it. Zadra, Bravetti and Seri, "Geometric numerical integration of Liénard systems via a contact Hamiltonian
/// approach", Mathematics 9 (2021).
///
/// `f` and `F` are polynomials in q, with the periodic forcing `-amplitude cos(omega t)` in F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lienard {
    /// The damping `f = f0 + f1 q + f2 q^2`, as `[f0, f1, f2]`.
    pub damping: [f64; 3],
    /// The restoring force `F0 + F1 q + F2 q^2 + F3 q^3`, as `[F0, F1, F2, F3]`.
    pub restoring: [f64; 4],
    /// The amplitude of the forcing.
    pub amplitude: f64,
    /// The angular frequency of the forcing.
    pub omega: f64,
}

impl Default for Lienard {
    /// A double well with damping that is negative at small amplitudes, unforced.
    fn default() -> Self {
        Lienard { damping: [-0.1, 0.0, 0.1], restoring: [0.0, -1.0, 0.0, 1.0], amplitude: 0.0, omega: 0.0 }
    }
}

impl Lienard {
    /// Natural initial data: `q = 1.5` at rest, with the momentum `p = 0`.
    pub fn initial(&self) -> PhasePoint<1> {
        PhasePoint::new([1.5], [0.0], 0.0)
    }
}

impl Lienard {
    /// The restoring and the damping force, and the forcing, at a velocity: `-q''`.
    #[inline(always)]
    fn deceleration<T: Scalar>(&self, t: T, q: T, velocity: T) -> T {
        let forcing = (t * self.omega).cos() * self.amplitude;
        velocity * horner(&self.damping, q) + horner(&self.restoring, q) - forcing
    }

    fn is_autonomous(&self) -> bool {
        self.amplitude == 0.0 || self.omega == 0.0
    }
}

impl ContactHamiltonian<1> for Lienard {
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
impl VectorField<2> for Lienard {
    #[inline(always)]
    fn at<T: Scalar>(&self, t: T, x: &SVector<T, 2>) -> SVector<T, 2> {
        SVector::from([x[1], -self.deceleration(t, x[0], x[1])])
    }

    fn is_autonomous(&self) -> bool {
        Lienard::is_autonomous(self)
    }
}

/// The polynomial with these coefficients, lowest degree first.
#[inline(always)]
fn horner<T: Scalar>(coefficients: &[f64], q: T) -> T {
    coefficients.iter().rev().fold(T::zero(), |sum, c| sum * q + *c)
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl contact_geom::ParametricHamiltonian<1> for Lienard {}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::{AsFunction, ChartVector, SmoothFunction};

    #[test]
    fn the_contact_hamiltonian_equations_are_lienards() {
        let system =
            Lienard { damping: [0.3, -0.2, 0.7], restoring: [0.1, 1.0, -0.4, 0.6], amplitude: 0.5, omega: 1.2 };
        let system = AsFunction(&system);
        for (t, q, p, z) in [(0.0, 1.0, 0.0, 0.5), (0.7, -1.3, 0.4, -0.9), (2.0, 0.2, -2.0, 1.5)] {
            let x = ChartVector { x: [q].into(), y: [p].into(), z };
            let (h, d) = (system.value(t, &x), system.differential(t, &x));
            let f: f64 = 0.3 - 0.2 * q + 0.7 * q * q;
            let force: f64 = 0.1 + q - 0.4 * q * q + 0.6 * q * q * q - 0.5 * (1.2 * t).cos();
            // Some ten roundings of terms below 8.
            let tolerance = 64.0 * f64::EPSILON;
            assert_eq!(d.y[0], z);
            assert!((p * d.y[0] - h + f * z + force).abs() <= tolerance);
            let momentum_rate = -p * p - f * p - (1.4 * q - 0.2) * z - (1.0 - 0.8 * q + 1.8 * q * q);
            assert!((-d.x[0] - p * d.z - momentum_rate).abs() <= tolerance);
        }
    }
}
