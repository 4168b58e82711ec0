//! Composition of discrete Lagrangians: one step of length `h1 + h2` from two.

use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{ChartVector, DiscretePoint};
use discrete_herglotz::{
    DiscreteLagrangian, StepError,
    solve::{ITERATION_LIMIT, last_correction},
};

/// Two steps through an intermediate point `q1`, with the change of the action over both.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct JoinedSteps<const N: usize> {
    /// The intermediate point.
    pub q1: SVector<f64, N>,
    /// The action there.
    pub z1: f64,
    /// `L_{h1}(q0, q1, z0) + L_{h2}(q1, q2, z1)`, the change of the action over both steps.
    pub value: f64,
    /// The derivative of the value in `q1`, `(1 + Dz L_{h2}) D2 L_{h1} + D1 L_{h2}`: zero where it is critical.
    pub slope: SVector<f64, N>,
}

/// The two steps through a given intermediate point.
///
/// # Errors
/// Those of the discrete Lagrangians.
pub fn through<const N: usize>(
    first: &impl DiscreteLagrangian<N>,
    second: &impl DiscreteLagrangian<N>,
    t: f64,
    (ends, z0): (&[SVector<f64, N>; 2], f64),
    q1: &SVector<f64, N>,
) -> Result<JoinedSteps<N>, StepError> {
    let [q0, q2] = *ends;
    let one = first.jet(t, &DiscretePoint { q0, q1: *q1, z0 })?;
    let z1 = z0 + one.value;
    let two = second.jet(t + first.step_size(), &DiscretePoint { q0: *q1, q1: q2, z0: z1 })?;
    Ok(JoinedSteps { q1: *q1, z1, value: one.value + two.value, slope: one.d2 * two.sigma() + two.d1 })
}

/// The composition at its critical point: the `q1` at which the change of the action over two steps is critical, by
/// Newton's method on the momentum matching `F+L_{h1} = F-L_{h2}`, from a guess.
///
/// For exact discrete Lagrangians its value is that of one step, `L_{h1+h2}^e(q0, q2, z0)`, and only at the critical
/// point. This is the composition of Hamilton-Jacobi theory for Lagrangians that depend on the action; for the case
/// without action see Marsden and West, Acta Numerica 10 (2001).
///
/// # Errors
/// Those of the discrete Lagrangians; [`StepError::Singular`] where the critical point is degenerate,
/// [`StepError::NotConverged`].
pub fn compose<const N: usize>(
    first: &impl DiscreteLagrangian<N>,
    second: &impl DiscreteLagrangian<N>,
    t: f64,
    (ends, z0): (&[SVector<f64, N>; 2], f64),
    guess: &SVector<f64, N>,
) -> Result<JoinedSteps<N>, StepError> {
    let [q0, q2] = *ends;
    let (mut q1, mut before, mut residual) = (*guess, f64::INFINITY, f64::INFINITY);
    for _ in 0..ITERATION_LIMIT {
        let one = first.second_jet(t, &DiscretePoint { q0, q1, z0 })?;
        let z1 = z0 + one.first.value;
        let two = second.second_jet(t + first.step_size(), &DiscretePoint { q0: q1, q1: q2, z0: z1 })?;
        // F-L_{h2} depends on q1 directly and through z1.
        let start = two.legendre_minus_jacobian();
        let mut matrix = SMatrix::<f64, N, N>::from_fn(|i, j| {
            one.d22[(i, j)] - start[(N + i, j)] - start[(N + i, 2 * N)] * one.first.d2[j]
        });
        let mut change = -(one.first.d2 + two.first.d1 / two.first.sigma());
        residual = change.amax();
        solve(&mut matrix, &mut change).map_err(|e| StepError::Singular { pivot: e.pivot })?;
        q1 += change;
        let (now, size) = (change.amax(), ChartVector { x: q0, y: q1, z: 0.0 }.amax().max(q2.amax()));
        if !now.is_finite() {
            return Err(StepError::NonFinite);
        }
        let predicted = before.is_finite() && last_correction(now, before, f64::EPSILON * size);
        if now == 0.0 || predicted || (now >= 0.5 * before && now <= 64.0 * f64::EPSILON * size) {
            return through(first, second, t, (ends, z0), &q1);
        }
        before = now;
    }
    Err(StepError::NotConverged { residual, iterations: ITERATION_LIMIT })
}
