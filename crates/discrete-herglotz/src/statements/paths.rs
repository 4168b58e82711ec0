//! Statements on the discrete action along paths.

use crate::statements::measures::relative_vector;
use crate::theory::{DiscretePath, discrete_action, discrete_flow};
use crate::{DiscreteLagrangian, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    DiscretePoint, Dual, GeometryError,
    numbers::{MaxAbsOrNan, MaxOrNan, max_or_nan},
};

/// A path with this number of steps near the points of `x`, with velocities of the same size; it is not a solution.
fn wiggly_path<const N: usize>(x: &DiscretePoint<N>, steps: usize) -> Result<DiscretePath<N>, GeometryError> {
    let stride = x.q1 - x.q0;
    let points = (0..=steps).map(|k| x.q0 + stride * (0.6 * (1.3 * k as f64).sin() + 0.2 * k as f64)).collect();
    DiscretePath::new(points).map_err(|_| GeometryError::Undefined { what: "the path" })
}

/// The differential of A_d by dual numbers through the whole recursion, with the directions of one point at a time.
fn differentiated<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    path: &DiscretePath<N>,
    z0: f64,
) -> Result<Vec<SVector<f64, N>>, StepError> {
    let moving = |k: usize| -> Vec<SVector<Dual<f64, SVector<f64, N>>, N>> {
        let seeded = |j: usize, q: &SVector<f64, N>| {
            SVector::from_fn(|i, _| {
                let mut c: Dual<f64, SVector<f64, N>> = Dual::constant(q[i]);
                c.d[i] = f64::from(u8::from(j == k));
                c
            })
        };
        path.points().iter().enumerate().map(|(j, q)| seeded(j, q)).collect()
    };
    (0..path.points().len()).map(|k| Ok(discrete_action(ld, t, &moving(k), Dual::constant(z0))?.d)).collect()
}

/// Statement 13: the paper's formula for dA_d against the derivative of A_d, for paths of 1 to `most` steps; and
/// `z_{k+1} - z_k = L_d(q_k, q_{k+1}, z_k)`.
pub(super) fn action_differential<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
    most: usize,
) -> Result<f64, GeometryError> {
    let mut worst: f64 = 0.0;
    for steps in [1, 2, 3, most] {
        let path = wiggly_path(x, steps)?;
        let (formula, derived) = (path.action_differential(ld, t, x.z0)?, differentiated(ld, t, &path, x.z0)?);
        let size = ld
            .jet(t, x)?
            .d1
            .max_abs_or_nan()
            .max_or_nan(derived.iter().map(MaxAbsOrNan::max_abs_or_nan).fold(0.0, max_or_nan));
        for (a, b) in formula.iter().zip(&derived) {
            worst = worst.max_or_nan(relative_vector(*a, *b, size));
        }
        let z = path.actions(ld, t, x.z0)?;
        let end = discrete_action(ld, t, path.points(), x.z0)?;
        worst = worst.max_or_nan((z[steps] - end).abs() / (1.0 + end.abs()));
    }
    Ok(worst)
}

/// Statement 14: the remark on N = 2, its formula written out.
pub(super) fn two_steps<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let path = wiggly_path(x, 2)?;
    let q = path.points();
    let first = ld.jet(t, &DiscretePoint { q0: q[0], q1: q[1], z0: x.z0 })?;
    let second = ld.jet(t + ld.step_size(), &DiscretePoint { q0: q[1], q1: q[2], z0: x.z0 + first.value })?;
    let remark = [first.d1 * (1.0 + second.dz), second.d1 + first.d2 * (1.0 + second.dz), second.d2];
    let derived = differentiated(ld, t, &path, x.z0)?;
    let size = remark.iter().map(MaxAbsOrNan::max_abs_or_nan).fold(first.d2.max_abs_or_nan(), max_or_nan);
    Ok(remark.iter().zip(&derived).map(|(a, b)| relative_vector(*a, *b, size)).fold(0.0, max_or_nan))
}

/// Statement 15: a path is critical for A_d with fixed ends if and only if it solves the discrete Herglotz equations.
///
/// Both directions are checked. Along the discrete flow the interior part of dA_d, differentiated independently,
/// vanishes; on a path that is not a solution it is the residual of the equations times the product of the later
/// sigma_d, none of which vanishes.
pub(super) fn principle<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let h = ld.step_size();
    let (mut points, mut step) = (vec![x.q0, x.q1], *x);
    for k in 0..2 {
        step = discrete_flow(ld, t + k as f64 * h, &step)?;
        points.push(step.q1);
    }
    let solution = DiscretePath::new(points).map_err(|_| GeometryError::Undefined { what: "the path" })?;
    let size = ld.jet(t, x)?.d1.max_abs_or_nan().max_or_nan(ld.jet(t, x)?.d2.max_abs_or_nan());
    // Round-off in a point of the path changes the residuals at its neighbours by D12 times that round-off.
    let second = ld.second_jet(t, x)?;
    let largest = solution.points().iter().map(MaxAbsOrNan::max_abs_or_nan).fold(0.0, max_or_nan);
    let size_of_solution = size.max_or_nan(second.d12.max_abs_or_nan() * largest);
    let differential = differentiated(ld, t, &solution, x.z0)?;
    let mut worst = differential[1..3].iter().map(|d| d.max_abs_or_nan() / size_of_solution).fold(0.0, max_or_nan);

    let path = wiggly_path(x, 5)?;
    let (differential, residuals) = (differentiated(ld, t, &path, x.z0)?, path.herglotz_residuals(ld, t, x.z0)?);
    let z = path.actions(ld, t, x.z0)?;
    let mut later = 1.0;
    for k in (1..5).rev() {
        worst = worst.max_or_nan(relative_vector(
            differential[k],
            residuals[k - 1] * later,
            size.max_or_nan(differential[k].max_abs_or_nan()),
        ));
        let at = DiscretePoint { q0: path.points()[k], q1: path.points()[k + 1], z0: z[k] };
        let sigma = ld.jet(t + k as f64 * h, &at)?.sigma();
        if sigma == 0.0 {
            return Ok(f64::INFINITY);
        }
        later *= sigma;
    }
    Ok(worst)
}
