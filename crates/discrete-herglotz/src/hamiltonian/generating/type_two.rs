//! Generating functions of type II.

use super::lift::{MAX_CORRECTIONS, MAX_ITERATIONS, NEWTON_TOLERANCE, PLATEAU, ROUND_OFF, inverse, real, scale, times};
use crate::StepError;
use crate::hamiltonian::ContactIncrement;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::max_abs_or_nan;
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianDerivatives, Hessian, PhasePoint, Scalar};

/// A generating function of type II, `H+(q0, p1, z0) = p1 . q0 + S(q0, p1, z0)`, of a step of length h from the time t.
/// With the increment S it generates the map
///
/// `q1 = q0 + S_p`, `p1 = p0 - S_q - p0 S_z`, `z1 = z0 + p1 . S_p - S`, `sigma = 1 - S_z`,
///
/// that is `q1 = H+_p1`, `sigma p0 = H+_q0`, `z1 = z0 + p1 . q1 - H+`, `sigma = 1 - H+_z0`. Each such map is
/// conformally contact:
///
/// `dz1 - p1 dq1 = dz0 + q1 dp1 - dH+ = (1 - H+_z0) dz0 - H+_q0 dq0 = sigma (dz0 - p0 dq0)`.
///
/// It is a map where `sigma > 0` and `H+_(q0 p1) + p0 H+_(z0 p1)^T` is regular, the derivative of `sigma p0 = H+_q0` in
/// p1. For a discrete Lagrangian `H+ = p1 . q1 - L_d` at the q1 with `p1 = D2 L_d`; then `H+_q0 = -D1 L_d = sigma p0`
/// and `H+_z0 = -Dz L_d`. H+ may exist where L_d does not, as at a conjugate point.
///
/// ```
/// use contact_geom::{PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{TypeTwo, type_two_step};
/// /// Contact symplectic Euler for H = p^2/2 + q^2/2 + z/10.
/// struct Oscillator;
/// impl TypeTwo<1> for Oscillator {
///     fn increment<T: Scalar>(&self, _t: f64, h: f64, q0: &SVector<T, 1>, p1: &SVector<T, 1>, z0: T) -> T {
///         (p1[0] * p1[0] * 0.5 + q0[0] * q0[0] * 0.5 + z0 * 0.1) * h
///     }
/// }
/// let change = type_two_step(&Oscillator, 0.0, 0.1, &PhasePoint::new([1.0], [0.0], 0.0), &mut 0)?;
/// assert!((change.p[0] + 0.1).abs() < 1e-16 && (change.q[0] + 0.01).abs() < 1e-16);
/// # Ok::<(), discrete_herglotz::StepError>(())
/// ```
pub trait TypeTwo<const N: usize>: Sized {
    /// The increment `S = H+ - p1 . q0`, which vanishes for h = 0.
    fn increment<T: Scalar>(&self, t: f64, h: f64, q0: &SVector<T, N>, p1: &SVector<T, N>, z0: T) -> T;

    /// The increment with its derivatives in `(q0, p1, z0)`; by automatic differentiation unless it is overridden.
    fn with_gradient<T: Scalar>(&self, t: f64, h: f64, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>) {
        AtStep { function: self, t, h }.with_gradient(T::zero(), x)
    }

    /// The second derivatives of the increment, with p1 in the place of v.
    fn second_derivatives(&self, t: f64, h: f64, x: &PhasePoint<N>) -> Hessian<N> {
        AtStep { function: self, t, h }.hessian(0.0, x)
    }
}

/// The increment of a step as a function of a point.
struct AtStep<'a, G> {
    function: &'a G,
    t: f64,
    h: f64,
}

impl<G: TypeTwo<N>, const N: usize> ContactHamiltonian<N> for AtStep<'_, G> {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.function.increment(self.t, self.h, q, p, z)
    }
}

/// The step of a generating function of type II, by Newton's method for `p1`; adds the number of evaluations of
/// derivatives to a counter.
///
/// # Errors
/// [`StepError::SigmaVanished`] where `sigma <= 0`, [`StepError::Singular`], [`StepError::NotConverged`],
/// [`StepError::NonFinite`].
pub fn type_two_step<G: TypeTwo<N>, T: Scalar, const N: usize>(
    function: &G,
    t: f64,
    h: f64,
    x: &PhasePoint<N, T>,
    evaluations: &mut u64,
) -> Result<ContactIncrement<N, T>, StepError> {
    // `S_q + p0 S_z`, the negative increment of p by the equation.
    let pull = |d: &ChartVector<N>, p0: &SVector<f64, N>| d.x + p0 * d.z;
    let from = real(x);
    let (mut p1, mut last) = (from.p, SMatrix::<f64, N, N>::zeros());
    let (mut iterations, mut size) = (0, f64::INFINITY);
    while size.is_nan() || size > NEWTON_TOLERANCE {
        let at = PhasePoint { p: p1, ..from };
        let (_, d) = function.with_gradient(t, h, &at);
        let second = function.second_derivatives(t, h, &at);
        *evaluations += 2;
        let residual = (p1 - from.p) + pull(&d, &from.p);
        let matrix = SMatrix::<f64, N, N>::from_fn(|i, j| {
            second.qv[(i, j)] + from.p[i] * second.vz[j] + if i == j { 1.0 } else { 0.0 }
        });
        let largest = max_abs_or_nan(residual.iter().copied());
        if !(largest.is_finite() && matrix.iter().all(|e| e.is_finite())) {
            return Err(StepError::NonFinite);
        }
        last = inverse(&matrix)?;
        let change = last * residual;
        p1 -= change;
        size = max_abs_or_nan(change.iter().copied()) / scale([&p1, &from.p, &d.x]);
        iterations += 1;
        if iterations >= MAX_ITERATIONS {
            return Err(StepError::NotConverged { residual: largest, iterations });
        }
    }
    // With the differentials, and to round-off.
    let mut p1 = p1.map(T::from);
    let mut before = f64::INFINITY;
    for corrections in 0.. {
        let (value, d) = function.with_gradient(t, h, &PhasePoint { p: p1, ..*x });
        *evaluations += 1;
        let p = SVector::<T, N>::from_fn(|i, _| -(d.x[i] + x.p[i] * d.z));
        let change = times(&last, &((p1 - x.p) - p));
        let size = max_abs_or_nan(change.iter().map(|e| e.extent())) / scale([&p1, &x.p, &d.x]);
        if size <= ROUND_OFF || (size <= PLATEAU && size >= 0.5 * before) {
            let sigma = 1.0 - d.z.re();
            if sigma <= 0.0 {
                return Err(StepError::SigmaVanished { sigma });
            }
            let z = p1.dot(&d.y) - value;
            // The action is no part of the equations that are solved.
            if !z.re().is_finite() {
                return Err(StepError::NonFinite);
            }
            return Ok(ContactIncrement { q: d.y, p, z, sigma_minus_one: -d.z });
        }
        if !size.is_finite() {
            return Err(StepError::NonFinite);
        }
        if corrections == MAX_CORRECTIONS {
            break;
        }
        (before, p1) = (size, p1 - change);
    }
    Err(StepError::NotConverged { residual: before, iterations: iterations + MAX_CORRECTIONS })
}
