//! Newton's method for the implicit part of a step.

use crate::{StepError, solve::Solver};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::max_or_nan;

/// The iterations that a step may take.
pub const ITERATION_LIMIT: u32 = 50;

/// The step equations linearised at an iterate `(u, z)`, with the scalar unknown `z` already eliminated.
pub(crate) struct Linearised<const N: usize> {
    /// The residual of the momentum equation, `z` eliminated.
    pub residual: SVector<f64, N>,
    /// Its derivative in `u`, `z` eliminated.
    pub jacobian: SMatrix<f64, N, N>,
    /// The size that the terms of the residual have, for a bound on its round-off.
    pub size: f64,
    /// The correction of `z` is `z_change + z_slope . (correction of u)`.
    pub z_change: f64,
    /// See `z_change`.
    pub z_slope: SVector<f64, N>,
}

/// Where Newton's method starts, and the sizes that tell round-off.
pub(crate) struct NewtonStart<const N: usize> {
    /// The guess of the mean velocity.
    pub u: SVector<f64, N>,
    /// The guess of the unknown action.
    pub z: f64,
    /// The size of the known position divided by the step: `eps` times this is the velocity below which a correction does
    /// not move the position.
    pub resolution: f64,
    /// The known momentum times the step, so that its product with the velocity is an action of the size of a step's.
    pub impulse: f64,
}

/// The solution of the step equations.
pub(crate) struct Root<const N: usize> {
    pub u: SVector<f64, N>,
    pub z: f64,
    pub iterations: u32,
}

/// The largest absolute component. A plain loop: nalgebra's `amax` goes through lane-wise comparisons, and costs a tenth of
/// a small step.
#[inline(always)]
pub(crate) fn max_abs_or_nan<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> f64 {
    let mut largest = 0.0;
    for column in &m.data.0 {
        for &c in column {
            largest = f64::max(largest, c.abs());
        }
    }
    largest
}

/// Whether the correction of a Newton iteration after this one is within a tolerance: convergence is quadratic, so from two
/// corrections `before > now` the next is about `now^3 / before^2`. The first correction, with an infinite one before, tells nothing
/// of the next unless it vanishes.
#[inline]
pub fn last_correction(now: f64, before: f64, tolerance: f64) -> bool {
    now == 0.0 || before.is_finite() && now * (now / before) * (now / before) <= tolerance
}

/// Solves the step equations for `(u, z)` from a guess.
///
/// Stopping rule, the first that holds: the next corrections of `u` and `z`, predicted from the last two, are below their
/// round-off; the residual and the defect of `z` are below the round-off of their own terms; the corrections stagnate, that of
/// `u` below what moves the position, or the residual and that of `z` below what `rounding` says
/// that the terms within L may leave of the two. An iterate outside the domain (a value that is not finite) is drawn back half-way, which counts
/// as an iteration; after [`ITERATION_LIMIT`] the step fails.
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
        residual_size = max_abs_or_nan(&at.residual);
        // `amax` ignores a NaN; the sum does not.
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
        let u_size = max_abs_or_nan(&u);
        let (size, z_size) = (max_abs_or_nan(&change), z_change.abs());
        let predicted = last_size.is_finite()
            && last_correction(size, last_size, f64::EPSILON * u_size)
            && last_correction(z_size, last_z_size, f64::EPSILON * z.abs());
        let round_off = 8.0 * f64::EPSILON;
        // The size of the terms that z is the sum of, with what rounding leaves of subnormal ones.
        let action = z.abs() + start.z.abs() + impulse * u_size + f64::MIN_POSITIVE / f64::EPSILON;
        // A residual of subnormal numbers is their rounding.
        let exact = residual_size <= round_off * at.size + f64::MIN_POSITIVE && at.z_change.abs() <= round_off * action;
        // Where no z solves its equation (beyond a pole of the motion) its corrections stagnate too, but are as large as z: half
        // of the digits tell that from what a potential's own cancellation leaves.
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

    /// `u = 1`, known from the start, and `z^2 = 2`: the iteration goes on until z is there as well.
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
