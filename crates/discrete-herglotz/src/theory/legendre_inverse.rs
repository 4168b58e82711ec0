//! The inverse of the Legendre transformation.

use crate::system::mass_matrix::mass_matrix;
use crate::{
    StepError, TypedSystem,
    solve::{ITERATION_LIMIT, last_correction},
};
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, VelocityPoint, numbers::max_abs_or_nan, support::linear};

/// After this number of corrections that do not decrease, the remaining ones are taken for round-off: an iteration that
/// still converges has no more than a few.
const MAX_STALLED_CORRECTIONS: u32 = 8;

/// The inverse Legendre transformation `FL^-1 (q, p, z) = (q, v, z)` with `L_v(t, q, v, z) = p`, by Newton's method
/// from a guess of the velocity; the inverse of [`legendre`](contact_geom::legendre).
///
/// The guess selects a solution where several velocities have the same momentum; where the velocity is unique, 0 is a
/// suitable guess. For a Lagrangian that is given by a contact Hamiltonian the velocity is `H_p`, whatever the rank of
/// `H_pp`.
///
/// # Errors
/// [`StepError::Singular`] where `W = L_vv` is singular, [`StepError::NonFinite`] where L is not defined at the guess
/// or at an iterate, [`StepError::NotConverged`].
///
/// ```
/// use contact_examples::systems::Relativistic;
/// use contact_geom::PhasePoint;
/// let (system, state) = (Relativistic::default(), PhasePoint::new([0.2], [1.5], 0.1));
/// let x = discrete_herglotz::theory::legendre_inverse(&system, 0.0, &state, &[0.0].into())?;
/// assert!((contact_geom::legendre(&system, 0.0, &x).p[0] - 1.5).abs() < 1e-14);
/// # Ok::<(), discrete_herglotz::StepError>(())
/// ```
#[inline(never)]
pub fn legendre_inverse<const N: usize>(
    system: &dyn TypedSystem<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: &SVector<f64, N>,
) -> Result<VelocityPoint<N>, StepError> {
    if let Some(x) = velocity_of_hamiltonian(system, t, state) {
        return if x.v.iter().all(|v| v.is_finite()) { Ok(x) } else { Err(StepError::NonFinite) };
    }
    let mut x = VelocityPoint { q: state.q, v: *guess, z: state.z };
    let (mut before, mut stalled) = (f64::INFINITY, 0);
    let mut momenta = system.gradient(t, &x).y;
    for _ in 0..ITERATION_LIMIT {
        let mut change = momenta - state.p;
        let mut w = mass_matrix(system, t, &x);
        // The residual is compared with the round-off of its terms: an ill-conditioned W determines the velocity no
        // better.
        let of = |i: usize| (0..N).map(|j| (w[(i, j)] * x.v[j]).abs()).sum::<f64>() + state.p[i].abs();
        let terms: SVector<f64, N> = SVector::from_fn(|i, _| of(i));
        let held = change.iter().zip(&terms).all(|(off, term)| off.abs() <= 2.0 * N as f64 * f64::EPSILON * term);
        if !(max_abs_or_nan(change.iter().copied()) + max_abs_or_nan(w.iter().copied())).is_finite() {
            return Err(StepError::NonFinite);
        }
        linear::solve(&mut w, &mut change).map_err(|e| StepError::Singular { pivot: e.pivot })?;
        let from = x.v;
        x.v -= change;
        let (size, scale) = (max_abs_or_nan(change.iter().copied()), max_abs_or_nan(x.v.iter().copied()));
        if !(size + scale).is_finite() {
            return Err(StepError::NonFinite);
        }
        let round_off = f64::EPSILON * scale;
        let stalls = size >= 0.5 * before;
        stalled += u32::from(stalls);
        // Where the terms of the gradient cancel, its size does not show its round-off: a stalled iteration is accepted
        // at half of the digits.
        let left = stalled >= MAX_STALLED_CORRECTIONS && size <= f64::EPSILON.sqrt() * scale;
        if last_correction(size, before, round_off) || (stalls && (held || size <= 64.0 * round_off || left)) {
            return Ok(x);
        }
        before = size;
        momenta = system.gradient(t, &x).y;
        // A full correction may leave the domain of L, for example beyond the speed of light.
        for _ in 0..f64::MANTISSA_DIGITS {
            if max_abs_or_nan(momenta.iter().copied()).is_finite() {
                break;
            }
            change *= 0.5;
            x.v = from - change;
            momenta = system.gradient(t, &x).y;
        }
        // A velocity whose momentum is the given one to round-off needs no other correction.
        if (momenta - state.p).iter().zip(&state.p).all(|(off, p)| off.abs() <= f64::EPSILON * p.abs()) {
            return Ok(x);
        }
    }
    Err(StepError::NotConverged { residual: before, iterations: ITERATION_LIMIT })
}

/// The velocity `H_p` at a state, if L is given by a contact Hamiltonian.
fn velocity_of_hamiltonian<const N: usize>(
    system: &dyn TypedSystem<N>,
    t: f64,
    state: &PhasePoint<N>,
) -> Option<VelocityPoint<N>> {
    if !system.hints().hamiltonian {
        return None;
    }
    let (_, d) = system.hamiltonian_with_gradient(t, state)?;
    Some(VelocityPoint { q: state.q, v: d.y, z: state.z })
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_examples::systems::Relativistic;
    use contact_geom::legendre;

    /// Starting from rest, where the first correction may exceed the speed of light. The tolerance allows for the
    /// round-off of the velocity, which W carries into the momentum, and for that of the gradient, a difference of
    /// terms of size one.
    #[test]
    fn from_rest_to_any_momentum() {
        let system = Relativistic::default();
        for p in [0.0, 1e-8, -0.9, 1.5, -30.0, 1e3] {
            let state = PhasePoint::new([0.0], [p], 0.1);
            let x = legendre_inverse(&system, 0.0, &state, &[0.0].into()).unwrap();
            let off = (legendre(&system, 0.0, &x).p[0] - p).abs();
            let w = system.hessian(0.0, &x).vv[(0, 0)];
            assert!(off <= 2.0 * f64::EPSILON * (1.0 + p.abs() + w * x.v[0].abs()), "p = {p}: {off:e}, W = {w:e}");
        }
    }

    /// Where the terms of the gradient cancel, its round-off limits the residual of the momentum.
    #[test]
    fn a_gradient_whose_terms_cancel() {
        let system = contact_geom::WithoutClosedDerivatives(Relativistic::default());
        for p in [-0.9, 1e-3, -1e-5, 1e-7] {
            let x = legendre_inverse(&system, 0.0, &PhasePoint::new([0.0], [p], 0.1), &[0.0].into()).unwrap();
            let expected = p / (1.0 + p * p).sqrt();
            assert!((x.v[0] - expected).abs() <= 4.0 * f64::EPSILON, "p = {p}: {:e}", x.v[0] - expected);
        }
    }

    /// A guess at which L is not defined is reported as such.
    #[test]
    fn a_guess_outside_the_domain() {
        let found = legendre_inverse(&Relativistic::default(), 0.0, &PhasePoint::new([0.0], [1.0], 0.0), &[2.0].into());
        assert_eq!(found, Err(StepError::NonFinite));
    }
}
