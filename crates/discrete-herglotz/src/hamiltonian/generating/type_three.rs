//! Generating functions of type III.

use super::lift::{MAX_CORRECTIONS, MAX_ITERATIONS, NEWTON_TOLERANCE, PLATEAU, ROUND_OFF, inverse, real, scale, times};
use crate::StepError;
use crate::hamiltonian::ContactIncrement;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianDerivatives, Hessian, PhasePoint, Scalar};

/// A generating function of type III, `H-(p0, q1, z1) = -p0 . q1 + S(q1, p0, z1)`, of a step of length h from the time
/// t. With the increment S it generates the map
///
/// `q1 = q0 + S_p`, `z1 = z0 + p0 . S_p - S`, `(1 + S_z) p1 = p0 - S_q`, `sigma = 1/(1 + S_z)`,
///
/// that is `q0 = -H-_p0`, `p1 = -sigma H-_q1`, `z1 = z0 - p0 . q0 - H-`, `1/sigma = 1 + H-_z1`. Each such map is
/// conformally contact: with `q0 = -H-_p0` the differential of the equation for z1 is
///
/// `(1 + H-_z1) dz1 + H-_q1 dq1 = dz0 - p0 dq0`, hence `dz1 - p1 dq1 = sigma (dz0 - p0 dq0)`.
///
/// It depends on the action at the end of the step, so that the inverse of a map of [type II](super::TypeTwo) has type
/// III: see [`Adjoint`](super::Adjoint). It is a map where `sigma > 0` and `H-_(p0 q1) + H-_(p0 z1) p1^T` is regular.
///
/// ```
/// use contact_geom::{ContactHamiltonian, PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{Euler, type_three_step, type_two_step};
/// struct Drag;
/// impl ContactHamiltonian<1> for Drag {
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T { p[0] * p[0] * 0.5 - q[0].cos() + z * z }
/// }
/// // A step back with type III undoes a step with type II.
/// let x = PhasePoint::new([1.0], [0.5], 0.3);
/// let y = type_two_step(&Euler(Drag), 0.0, 0.1, &x, &mut 0)?.after(&x);
/// let back = type_three_step(&Euler(Drag), 0.1, -0.1, &y, &mut 0)?.after(&y);
/// assert!((back.q[0] - x.q[0]).abs() < 1e-15 && (back.z - x.z).abs() < 1e-15);
/// # Ok::<(), discrete_herglotz::StepError>(())
/// ```
pub trait TypeThree<const N: usize>: Sized {
    /// The increment `S = H- + p0 . q1`, which vanishes for h = 0.
    fn increment<T: Scalar>(&self, t: f64, h: f64, q1: &SVector<T, N>, p0: &SVector<T, N>, z1: T) -> T;

    /// The increment with its derivatives in `(q1, p0, z1)`; by automatic differentiation unless it is overridden.
    fn with_gradient<T: Scalar>(&self, t: f64, h: f64, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>) {
        AtStep { function: self, t, h }.with_gradient(T::zero(), x)
    }

    /// The second derivatives of the increment, with p0 in the place of v.
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

impl<G: TypeThree<N>, const N: usize> ContactHamiltonian<N> for AtStep<'_, G> {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.function.increment(self.t, self.h, q, p, z)
    }
}

/// The linear equations `(1 - S_pq) u - S_pz w = r`, `(S_q - p0) u + (1 + S_z) w = s` of a correction: the inverse of
/// the matrix that remains when w is eliminated, `1 - S_pq - S_pz p1^T`, and the coefficients.
struct Linearised<const N: usize> {
    inverse: SMatrix<f64, N, N>,
    pz: SVector<f64, N>,
    row: SVector<f64, N>,
    corner: f64,
}

impl<const N: usize> Linearised<N> {
    fn new<G: TypeThree<N>>(
        function: &G,
        (t, h): (f64, f64),
        at: &PhasePoint<N>,
        d: &ChartVector<N>,
    ) -> Result<Self, StepError> {
        let second = function.second_derivatives(t, h, at);
        let (row, corner) = (d.x - at.p, 1.0 + d.z);
        let matrix = SMatrix::<f64, N, N>::from_fn(|i, j| {
            let identity = if i == j { 1.0 } else { 0.0 };
            identity - second.qv[(j, i)] + second.vz[i] * row[j] / corner
        });
        if matrix.iter().all(|e| e.is_finite()) {
            Ok(Linearised { inverse: inverse(&matrix)?, pz: second.vz, row, corner })
        } else if corner == 0.0 {
            Err(StepError::Singular { pivot: 0.0 })
        } else {
            Err(StepError::NonFinite)
        }
    }

    fn solve<T: Scalar>(&self, r: &SVector<T, N>, s: T) -> (SVector<T, N>, T) {
        let right = SVector::from_fn(|i, _| r[i] + s * (self.pz[i] / self.corner));
        let u = times(&self.inverse, &right);
        let w = (0..N).fold(s, |sum, j| sum - u[j] * self.row[j]) / self.corner;
        (u, w)
    }
}

/// The residuals of the two equations at `(q1, p0, z1)`.
fn residuals<T: Scalar, const N: usize>(
    from: &PhasePoint<N, T>,
    at: &PhasePoint<N, T>,
    (value, d): &(T, ChartVector<N, T>),
) -> (SVector<T, N>, T) {
    let moved = at.q - from.q;
    (moved - d.y, (at.z - from.z) - from.p.dot(&moved) + *value)
}

/// The step of a generating function of type III, by Newton's method for `(q1, z1)`; adds the number of evaluations of
/// derivatives to a counter.
///
/// # Errors
/// [`StepError::SigmaVanished`] where `1 + S_z` is not positive, [`StepError::Singular`], [`StepError::NotConverged`],
/// [`StepError::NonFinite`].
pub fn type_three_step<G: TypeThree<N>, T: Scalar, const N: usize>(
    function: &G,
    t: f64,
    h: f64,
    x: &PhasePoint<N, T>,
    evaluations: &mut u64,
) -> Result<ContactIncrement<N, T>, StepError> {
    let from = real(x);
    let mut at = from;
    let (mut iterations, mut size) = (0, f64::INFINITY);
    let mut last = None;
    while size.is_nan() || size > NEWTON_TOLERANCE {
        let found = function.with_gradient(t, h, &at);
        let (r, s) = residuals(&from, &at, &found);
        let largest = max_or_nan(max_abs_or_nan(r.iter().copied()), s.abs());
        if !largest.is_finite() {
            return Err(StepError::NonFinite);
        }
        let equations = Linearised::new(function, (t, h), &at, &found.1)?;
        *evaluations += 2;
        let (u, w) = equations.solve(&r, s);
        at = PhasePoint { q: at.q - u, z: at.z - w, ..at };
        size = relative(&u, w, &at, &found);
        last = Some(equations);
        iterations += 1;
        if iterations >= MAX_ITERATIONS {
            return Err(StepError::NotConverged { residual: largest, iterations });
        }
    }
    let Some(equations) = last else { return Err(StepError::NonFinite) };
    // With the differentials, and to round-off.
    let mut at = PhasePoint { q: at.q.map(T::from), p: x.p, z: T::from(at.z) };
    let mut before = f64::INFINITY;
    for corrections in 0.. {
        let found = function.with_gradient(t, h, &at);
        *evaluations += 1;
        let (r, s) = residuals(x, &at, &found);
        let (u, w) = equations.solve(&r, s);
        let size = relative(&u, w, &at, &found);
        if size <= ROUND_OFF || (size <= PLATEAU && size >= 0.5 * before) {
            return finish(x, found);
        }
        if !size.is_finite() {
            return Err(StepError::NonFinite);
        }
        if corrections == MAX_CORRECTIONS {
            break;
        }
        before = size;
        at = PhasePoint { q: at.q - u, z: at.z - w, ..at };
    }
    Err(StepError::NotConverged { residual: before, iterations: iterations + MAX_CORRECTIONS })
}

/// The size of a correction, relative to the state.
fn relative<T: Scalar, const N: usize>(
    u: &SVector<T, N>,
    w: T,
    at: &PhasePoint<N, T>,
    (value, d): &(T, ChartVector<N, T>),
) -> f64 {
    let of_q = max_abs_or_nan(u.iter().map(|e| e.extent())) / scale([&at.q, &d.y]);
    let terms = (0..N).map(|i| (at.p[i] * d.y[i]).extent()).chain([at.z.extent(), value.extent(), f64::MIN_POSITIVE]);
    max_or_nan(of_q, w.extent() / max_abs_or_nan(terms))
}

/// The increment from the solved equations.
fn finish<T: Scalar, const N: usize>(
    x: &PhasePoint<N, T>,
    (value, d): (T, ChartVector<N, T>),
) -> Result<ContactIncrement<N, T>, StepError> {
    let below = d.z + 1.0;
    if below.re() <= 0.0 {
        return Err(StepError::SigmaVanished { sigma: 1.0 / below.re() });
    }
    let p = SVector::from_fn(|i, _| -(d.x[i] + x.p[i] * d.z) / below);
    let z = x.p.dot(&d.y) - value;
    // The increment of the action may overflow where that of the equations does not.
    if !z.re().is_finite() {
        return Err(StepError::NonFinite);
    }
    Ok(ContactIncrement { q: d.y, p, z, sigma_minus_one: -d.z / below })
}
