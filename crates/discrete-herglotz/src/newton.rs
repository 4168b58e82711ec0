//! Newton's method for the implicit part of a step.

use crate::{Solver, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};

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

/// The solution of the step equations.
pub(crate) struct Root<const N: usize> {
    pub u: SVector<f64, N>,
    pub z: f64,
    pub iterations: u32,
}

/// Solves the step equations for `(u, z)` from a guess.
///
/// Stopping rule: convergence is quadratic, so from two corrections `d1 > d2` the next is about `d2^3 / d1^2`; the method
/// stops when that is below round-off of `u`, or when the residual is below the round-off of its own terms. An iterate
/// outside the domain (a value that is not finite) is drawn back half-way, which counts as an iteration; after
/// [`ITERATION_LIMIT`] the step fails.
#[inline]
pub(crate) fn newton<const N: usize>(
    mut u: SVector<f64, N>,
    mut z: f64,
    solver: &mut Solver<N>,
    mut linearise: impl FnMut(&SVector<f64, N>, f64) -> Result<Linearised<N>, StepError>,
) -> Result<Root<N>, StepError> {
    let (mut last, mut last_z, mut last_size) = (SVector::<f64, N>::zeros(), 0.0, f64::INFINITY);
    let mut residual_size = f64::INFINITY;
    for iterations in 1..=ITERATION_LIMIT {
        let mut at = linearise(&u, z)?;
        residual_size = at.residual.amax();
        // `max` ignores a NaN; the sum does not.
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
        let size = change.amax();
        let round_off = f64::EPSILON * u.amax();
        let next = size * (size / last_size) * (size / last_size);
        if (last_size.is_finite() && next <= round_off) || residual_size <= 8.0 * f64::EPSILON * at.size {
            return Ok(Root { u, z, iterations });
        }
        (last, last_z, last_size) = (change, z_change, size);
    }
    Err(StepError::NotConverged { residual: residual_size, iterations: ITERATION_LIMIT })
}
