//! Pieces of degree two in z with coefficients that depend on the position.

use super::PointFlow;
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The coefficients of a polynomial in z.
pub trait Polynomial<const N: usize> {
    /// `[c0, c1, c2]` of `c0(t, q) + c1(t, q) z + c2(t, q) z^2`.
    fn coefficients<T: Scalar>(&self, t: T, q: &SVector<T, N>) -> [T; 3];
}

/// The piece `H = c0(t, q) + c1(t, q) z + c2(t, q) z^2` as a [`PointFlow`], to be used as
/// `Prolonged(PolynomialInAction(c))`. The positions are constant along its flow, and z satisfies a Riccati equation:
/// with `D = c1^2/4 - c0 c2` and `S = sinh(sqrt(D) tau)/sqrt(D)`,
///
/// `z1 - z0 = -H S/(cosh(sqrt(D) tau) + (c1/2 + c2 z0) S)` as long as the denominator has no zero.
///
/// For `c2 = 0` this is `z1 - z0 = -H (1 - e^(-c1 tau))/c1`, the flow of `V(q) + a(q) z`.
///
/// ```
/// use contact_geom::{PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{ContactPiece, Polynomial, PolynomialInAction, Prolonged};
/// /// A drag that grows with the distance: H = q^2 z.
/// struct Drag;
/// impl Polynomial<1> for Drag {
///     fn coefficients<T: Scalar>(&self, _t: T, q: &SVector<T, 1>) -> [T; 3] { [T::zero(), q[0] * q[0], T::zero()] }
/// }
/// let drag = Prolonged(PolynomialInAction(Drag));
/// let change = drag.change(&drag.over(0.1), 0.0, &PhasePoint::new([2.0], [0.0], 1.0));
/// assert!((change.sigma_minus_one - (-0.4f64).exp_m1()).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PolynomialInAction<C>(pub C);

impl<C: Polynomial<N>, const N: usize> PointFlow<N> for PolynomialInAction<C> {
    type Map = f64;

    fn field<T: Scalar>(&self, t: T, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        let [c0, c1, c2] = self.0.coefficients(t, q);
        (SVector::from_element(T::zero()), -(c0 + z * (c1 + z * c2)))
    }

    fn over(&self, tau: f64) -> f64 {
        tau
    }

    fn change<T: Scalar>(&self, tau: &f64, t: f64, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        let [c0, c1, c2] = self.0.coefficients(T::from(t), q);
        let square = (c1 * c1 * 0.25 - c0 * c2) * (*tau * *tau);
        let (cosh, quotient) = cosh_and_quotient(square);
        let s = quotient * *tau;
        let below = cosh + (c1 * 0.5 + c2 * z) * s;
        let still = SVector::from_element(T::zero());
        // The denominator starts at 1, and where it oscillates its zeros are pi apart. A NaN is passed on.
        if below.re() <= 0.0 || square.re() <= -std::f64::consts::PI.powi(2) {
            return (still, T::from(f64::NAN));
        }
        (still, -(c0 + z * (c1 + z * c2)) * s / below)
    }
}

/// The number of terms of the series: the remainder is below round-off for arguments up to 1.
const TERMS: u32 = 9;

/// `cosh(sqrt(x))` and `sinh(sqrt(x))/sqrt(x)`, entire functions of x.
fn cosh_and_quotient<T: Scalar>(x: T) -> (T, T) {
    let size = x.re();
    if size > 1.0 {
        let root = x.sqrt();
        return (root.cosh(), root.sinh() / root);
    }
    if size < -1.0 {
        let root = (-x).sqrt();
        let (sin, cos) = root.sin_cos();
        return (cos, sin / root);
    }
    let (mut cosh, mut quotient) = (T::one(), T::one());
    for k in (1..=TERMS).rev() {
        let even = f64::from(2 * k);
        cosh = cosh * x / (even * (even - 1.0)) + 1.0;
        quotient = quotient * x / (even * (even + 1.0)) + 1.0;
    }
    (cosh, quotient)
}
