//! Newton's method for the implicit part of a step.

use crate::{StepError, solve::Solver};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::max_or_nan;

/// The largest number of Newton iterations of a step.
pub const ITERATION_LIMIT: u32 = 50;

/// The step equations linearised at an iterate `(u, z)`, with the scalar unknown `z` already eliminated.
pub(crate) struct Linearised<const N: usize> {
    /// The residual of the momentum equation, `z` eliminated.
    pub residual: SVector<f64, N>,
    /// Its derivative in `u`, `z` eliminated.
    pub jacobian: SMatrix<f64, N, N>,
    /// The size of the terms of the residual, for a bound on its round-off.
    pub size: f64,
    /// The correction of `z` is `z_change + z_slope . (correction of u)`.
    pub z_change: f64,
    /// See `z_change`.
    pub z_slope: SVector<f64, N>,
}

/// The initial guess of Newton's method, and the sizes for bounds on round-off.
pub(crate) struct NewtonStart<const N: usize> {
    /// The initial guess of the mean velocity.
    pub u: SVector<f64, N>,
    /// The initial guess of the unknown action.
    pub z: f64,
    /// The size of the known position divided by the step: a correction below `eps` times this does not change the
    /// position.
    pub resolution: f64,
    /// The known momentum times the step, so that its product with the velocity has the size of the action of a step.
    pub impulse: f64,
}

/// The solution of the step equations.
pub(crate) struct Root<const N: usize> {
    pub u: SVector<f64, N>,
    pub z: f64,
    pub iterations: u32,
}

/// The largest absolute component. A plain loop, since nalgebra's `amax` uses lane-wise comparisons and costs a tenth
/// of a small step.
#[inline(always)]
pub(crate) fn max_abs<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> f64 {
    let mut largest = 0.0;
    for column in &m.data.0 {
        for &c in column {
            largest = f64::max(largest, c.abs());
        }
    }
    largest
}

/// Whether the next Newton correction is predicted to be within a tolerance: convergence is quadratic, so from two
/// corrections `before > now` the next is about `now^3 / before^2`. After the first correction (`before` infinite)
/// there is no prediction, unless the correction vanishes.
#[inline]
pub fn last_correction(now: f64, before: f64, tolerance: f64) -> bool {
    now == 0.0 || before.is_finite() && now * (now / before) * (now / before) <= tolerance
}

/// Solves the step equations for `(u, z)` from an initial guess.
///
/// The iteration stops as soon as one of these holds: the next corrections of `u` and `z`, predicted from the last two,
/// are below their round-off; the residual and the defect of `z` are below the round-off of their terms; the
/// corrections stagnate, and either that of `u` does not move the position, or the residual and the correction of `z`
/// are below `rounding`, the round-off of the two due to the terms of L. If an iterate is outside the domain (a value
/// is not finite), half of the last correction is taken back, which counts as an iteration. After [`ITERATION_LIMIT`]
/// iterations the step fails.
#[inline(always)]
pub(crate) fn newton<const N: usize>(
    start: NewtonStart<N>,
    solver: &mut Solver<N>,
    rounding: impl Fn(&SVector<f64, N>, f64) -> [f64; 2],
    mut linearise: impl FnMut(&SVector<f64, N>, f64) -> Result<Linearised<N>, StepError>,
) -> Result<Root<N>, StepError> {
    let NewtonStart { mut u, mut z, resolution, impulse } = start;
    let (mut last, mut last_z) = (SVector::<f64, N>::zeros(), 0.0f64);
    // The size of the last correction; infinite before the first.
    let (mut last_size, mut last_z_size) = (f64::INFINITY, f64::INFINITY);
    let mut residual_size = f64::INFINITY;
    for iterations in 1..=ITERATION_LIMIT {
        let mut at = linearise(&u, z)?;
        residual_size = max_abs(&at.residual);
        // The maximum ignores a NaN; the sum does not.
        if !(at.residual.sum() + at.jacobian.sum() + at.z_change).is_finite() {
            if last_size == f64::INFINITY {
                return Err(StepError::NonFinite);
            }
            last *= 0.5;
            last_z *= 0.5;
            u -= last;
            z -= last_z;
            continue;
        }
        let mut change = -at.residual;
        solver.solve(&mut at.jacobian, &mut change)?;
        let z_change = at.z_change + at.z_slope.dot(&change);
        u += change;
        z += z_change;
        let u_size = max_abs(&u);
        let (size, z_size) = (max_abs(&change), z_change.abs());
        let predicted = last_size.is_finite()
            && last_correction(size, last_size, f64::EPSILON * u_size)
            && last_correction(z_size, last_z_size, f64::EPSILON * z.abs());
        let round_off = 8.0 * f64::EPSILON;
        // The size of the terms of z, with a lower bound for the round-off of subnormal terms.
        let action = z.abs() + start.z.abs() + impulse * u_size + f64::MIN_POSITIVE / f64::EPSILON;
        // A subnormal residual is round-off.
        let exact = residual_size <= round_off * at.size + f64::MIN_POSITIVE && at.z_change.abs() <= round_off * action;
        // If no z solves its equation (beyond a pole of the motion) the corrections of z stagnate too, but are as large
        // as z. A tolerance of half of the digits distinguishes this from stagnation due to cancellation within a
        // potential.
        let unresolved_within =
            z_size <= round_off * action || (z_size >= 0.5 * last_z_size && z_size <= f64::EPSILON.sqrt() * action);
        let rounded = |u: &SVector<f64, N>| {
            let [of_residual, of_z] = rounding(u, z);
            residual_size <= of_residual && z_size <= max_or_nan(of_z, round_off * action)
        };
        let stagnant =
            size >= 0.5 * last_size && (unresolved_within && size <= round_off * (resolution + u_size) || rounded(&u));
        if predicted || exact || stagnant {
            return Ok(Root { u, z, iterations });
        }
        (last, last_z, last_size, last_z_size) = (change, z_change, size, z_size);
    }
    Err(StepError::NotConverged { residual: residual_size, iterations: ITERATION_LIMIT })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `u = 1`, which is the initial guess, and `z^2 = 2`: the iteration continues until z has converged too.
    #[test]
    fn an_exact_guess_of_u_does_not_end_the_search_for_z() {
        let start = NewtonStart { u: SVector::from([1.0]), z: 1.5, resolution: 1.0, impulse: 1.0 };
        let root = newton(
            start,
            &mut Solver::default(),
            |_, _| [0.0; 2],
            |u: &SVector<f64, 1>, z| {
                Ok(Linearised {
                    residual: SVector::from([u[0] - 1.0]),
                    jacobian: SMatrix::identity(),
                    // No bound on the round-off of the residual, so that the corrections decide.
                    size: 0.0,
                    z_change: (2.0 - z * z) / (2.0 * z),
                    z_slope: SVector::zeros(),
                })
            },
        );
        let z = root.unwrap().z;
        assert!((z - 2.0f64.sqrt()).abs() <= 2.0 * f64::EPSILON, "{z}");
    }
}
