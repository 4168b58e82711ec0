//! The inverse of the Legendre transformation.

use crate::rules::step_equations::mass_matrix;
use crate::{ITERATION_LIMIT, StepError, last_correction};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint, largest, linear};

/// `FL^-1 (q, p, z) = (q, v, z)` with `L_v(t, q, v, z) = p`, by Newton's method from a guess of the velocity: the state of a run with its
/// velocity, and back to [`legendre`](contact_geom::legendre). A guess of 0 finds it where there is one alone.
///
/// # Errors
/// [`StepError::Singular`] where W is, [`StepError::NonFinite`] where L is not defined on the way, [`StepError::NotConverged`].
///
/// ```
/// use contact_geom::{PhasePoint, systems::Relativistic};
/// let (system, state) = (Relativistic::default(), PhasePoint::new([0.2], [1.5], 0.1));
/// let x = discrete_herglotz::legendre_inverse(&system, 0.0, &state, &[0.0].into())?;
/// assert!((contact_geom::legendre(&system, 0.0, &x).p[0] - 1.5).abs() < 1e-14);
/// # Ok::<(), discrete_herglotz::StepError>(())
/// ```
#[inline(never)]
pub fn legendre_inverse<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: &SVector<f64, N>,
) -> Result<VelocityPoint<N>, StepError> {
    let mut x = VelocityPoint { q: state.q, v: *guess, z: state.z };
    let mut before = f64::INFINITY;
    for _ in 0..ITERATION_LIMIT {
        let momenta = lagrangian.gradient(t, &x).y;
        let mut change = momenta - state.p;
        let mut w = mass_matrix(lagrangian, t, &x);
        // To the round-off of its terms: where W is ill conditioned the velocity is determined no better.
        let of = |i: usize| (0..N).map(|j| (w[(i, j)] * x.v[j]).abs()).sum::<f64>() + state.p[i].abs();
        let terms: SVector<f64, N> = SVector::from_fn(|i, _| of(i));
        let held = change.iter().zip(&terms).all(|(off, term)| off.abs() <= 2.0 * N as f64 * f64::EPSILON * term);
        linear::solve(&mut w, &mut change).map_err(|e| StepError::Singular { pivot: e.pivot })?;
        x.v -= change;
        let (size, scale) = (largest(change.iter().copied()), largest(x.v.iter().copied()));
        if !(size + scale).is_finite() {
            return Err(StepError::NonFinite);
        }
        let round_off = f64::EPSILON * scale;
        if last_correction(size, before, round_off) || (size >= 0.5 * before && (held || size <= 64.0 * round_off)) {
            return Ok(x);
        }
        before = size;
    }
    Err(StepError::NotConverged { residual: before, iterations: ITERATION_LIMIT })
}
