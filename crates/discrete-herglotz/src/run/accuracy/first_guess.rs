//! The steps with which the search for an accuracy begins.

use crate::Problem;
use crate::run::request::Request;
use crate::solve::mass_matrix::inverted;
use contact_geom::nalgebra::SMatrix;
use contact_geom::{Derivatives, Lagrangian, numbers::max_or_nan};
use std::f64::consts::PI;

/// The steps in which the motion linearised at its start has an error: few, since what is not linear has higher frequencies.
pub(crate) fn first_guess<L: Lagrangian<N>, const N: usize>(
    request: &Request<'_, L, N>,
    stages: usize,
    goal: f64,
) -> usize {
    let Request { problem: Problem { lagrangian, start, t0, .. }, span, .. } = request;
    let h = lagrangian.hessian(*t0, start);
    // Of forces of position, and of those that turn the velocity as a magnetic field does.
    let [of_position, turning] = inverted(&h.vv).map_or([0.0; 2], |inverse| {
        [spectral_radius(*inverse * h.qq).sqrt(), spectral_radius(*inverse * (h.qv - h.qv.transpose()))]
    });
    // The error of a step of x radians is about x^(2s+1) s!^4 / (2s)!^3.
    let s = stages as f64;
    let logarithm = |n: usize| (1..=n).map(|i| (i as f64).ln()).sum::<f64>();
    let constant = 4.0 * logarithm(stages) - 3.0 * logarithm(2 * stages);
    let radians = ((goal.ln() - constant) / (2.0 * s + 1.0)).exp();
    // Beyond half a period sweeps do not contract.
    let radians = 0.5 * radians;
    // Sweeps for the velocity contract by the angle that it turns.
    let count = span.abs() * max_or_nan(of_position / radians.min(s / 3.0).min(PI), turning / radians.min(1.0));
    // What is stiff at its start need not be resolved, and what is free there may be anything later.
    if count.is_finite() { (count.ceil() as usize).clamp(1, 1 << 20) } else { 1 }
}

/// The largest absolute eigenvalue, by the norm of the eighth power: at most `N^(1/16)` times too large for a symmetric matrix. Not finite where
/// the matrix is not.
fn spectral_radius<const N: usize>(matrix: SMatrix<f64, N, N>) -> f64 {
    let (mut power, mut logarithm) = (matrix, 0.0);
    for squared in 0..=3 {
        let norm = power.norm();
        if norm == 0.0 || !norm.is_finite() {
            return norm;
        }
        logarithm += norm.ln() / f64::from(1 << squared);
        power /= norm;
        power *= power;
    }
    logarithm.exp()
}
