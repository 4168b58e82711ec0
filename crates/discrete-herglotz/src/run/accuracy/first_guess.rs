//! The number of steps with which the search for an accuracy starts.

use crate::integration::SystemProblem;
use crate::run::accuracy::limits::MAX_FIRST_GUESS;
use crate::run::accuracy::matrices::{frobenius_norm, product};
use crate::run::request::Request;
use crate::system::mass_matrix::inverse;
use crate::{Point, Vector};
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_or_nan;
use std::f64::consts::PI;

/// The largest number of radians of a step in which the fixed-point iteration contracts, where the mass matrix varies.
const MAX_RADIANS_OF_VARIABLE_MASS: f64 = 0.6;

/// The largest relative difference of two mass matrices that are equal.
const MAX_CHANGE_OF_CONSTANT_MASS: f64 = 64.0 * f64::EPSILON;

/// The largest product of a step with the rate at which a force damps the velocity at the start: as the motion slows down,
/// such a rate decreases.
const MAX_DAMPING: f64 = 2.0;

/// The smallest relative error for which steps are estimated: below the rounding of one number, shorter steps do not help.
const SMALLEST_ERROR: f64 = f64::EPSILON / 16.0;

/// The number of steps for which the motion linearised at its start has a given error. It is too small if nonlinear
/// terms lead to higher frequencies.
pub(crate) fn first_guess(request: &Request<'_>, stages: usize, goal: f64) -> usize {
    let Request { problem, span, .. } = request;
    let SystemProblem { system, start, t0, .. } = problem;
    if system.hints().hamiltonian {
        let frequency = frequency_of_hamiltonian(request);
        let count = span.abs() * frequency / radians(stages, goal).min(stages as f64 / 3.0).min(1.0);
        return if count.is_finite() { (count.ceil() as usize).clamp(1, MAX_FIRST_GUESS) } else { 1 };
    }
    let (h, force) = (system.hessian(*t0, start), system.force_derivatives(*t0, start));
    // The frequencies of forces that depend on the position, and of forces that rotate the velocity like a magnetic
    // field, and the rate of those that damp it.
    let [of_position, turning, damping] = inverse(&h.vv).map_or([0.0; 3], |inverse| {
        let radius = |of: &DMatrix<f64>| spectral_radius(product(&inverse, of));
        let damping = force.map_or(0.0, |force| radius(&force.v));
        [radius(&h.qq).sqrt(), radius(&(&h.qv - h.qv.transpose())), damping]
    });
    let (s, radians) = (stages as f64, radians(stages, goal));
    // Where the mass matrix varies along the motion, the fixed-point iteration contracts in shorter steps only.
    let varies = !problem.structure.constant_mass && {
        // Differently for each coordinate, since it may depend on differences alone.
        let moved = |x: &Vector| x.iter().enumerate().map(|(i, x)| x + 1.0 + 0.7 * i as f64).collect();
        let moved = Point { q: moved(&start.q), v: moved(&start.v), z: start.z };
        // Written so that a NaN varies.
        let same = (system.mass_matrix(*t0, &moved) - &h.vv).amax() <= MAX_CHANGE_OF_CONSTANT_MASS * h.vv.amax();
        !same
    };
    let longest = if varies { MAX_RADIANS_OF_VARIABLE_MASS } else { (s / 3.0).min(PI) };
    // The fixed-point iteration for the velocity contracts by the angle of its rotation in a step.
    let of_velocity = max_or_nan(turning / radians.min(1.0), damping / radians.min(MAX_DAMPING));
    let count = span.abs() * max_or_nan(of_position / radians.min(longest), of_velocity);
    // A motion that is free at its start may be fast later.
    if count.is_finite() { (count.ceil() as usize).clamp(1, MAX_FIRST_GUESS) } else { 1 }
}

/// The number of radians of a step with a given error. The error of a step of x radians is about
/// `x^(2s+1) s!^4 / (2s)!^3`; half of x is taken, since for steps longer than half a period the fixed-point iteration does
/// not contract.
fn radians(stages: usize, goal: f64) -> f64 {
    let (s, goal) = (stages as f64, max_or_nan(goal, SMALLEST_ERROR));
    let logarithm = |n: usize| (1..=n).map(|i| (i as f64).ln()).sum::<f64>();
    let constant = 4.0 * logarithm(stages) - 3.0 * logarithm(2 * stages);
    0.5 * ((goal.ln() - constant) / (2.0 * s + 1.0)).exp()
}

/// The largest frequency of the motion of a contact Hamiltonian, linearised at its start: the rates of `H_pq`, and the
/// root of the product of `H_pp` and `H_qq`.
fn frequency_of_hamiltonian(request: &Request<'_>) -> f64 {
    let SystemProblem { system, state, t0, .. } = &request.problem;
    let Some(h) = system.hamiltonian_hessian(*t0, state) else { return 0.0 };
    let rate = system.hamiltonian_with_gradient(*t0, state).map_or(0.0, |(_, d)| d.z.abs());
    let of_position = spectral_radius(product(&h.vv, &h.qq)).sqrt();
    max_or_nan(max_or_nan(of_position, spectral_radius(h.qv)), rate)
}

/// The largest absolute eigenvalue, estimated from the norm of the eighth power: too large by at most a factor
/// `n^(1/16)` for a symmetric matrix. Not finite if the matrix is not.
fn spectral_radius(matrix: DMatrix<f64>) -> f64 {
    let (mut power, mut logarithm) = (matrix, 0.0);
    for squared in 0..=3 {
        let norm = frobenius_norm(&power);
        if norm == 0.0 || !norm.is_finite() {
            return norm;
        }
        logarithm += norm.ln() / f64::from(1 << squared);
        power /= norm;
        power = product(&power, &power);
    }
    logarithm.exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gauss::GaussStepper;
    use crate::run::OutputRequest;
    use crate::{Problem, Stepper, StepperOptions};
    use contact_examples::systems::DoublePendulum;
    use contact_geom::VelocityPoint;

    /// The mass matrix of the double pendulum depends on the difference of its angles. The fixed-point iteration of the guessed
    /// steps converges but for a few of them, where that of a quarter as many does not.
    #[test]
    fn guessed_steps_of_a_variable_mass_need_no_newton_iteration() {
        let double = DoublePendulum::default();
        let problem = Problem::new(&double, 0.0, VelocityPoint::new([1.0, 1.2], [0.0, 0.0], 0.0)).unwrap();
        let span = 20.0;
        let request = Request {
            problem: problem.of_system(),
            t_end: span,
            span,
            integrator: None,
            needs: OutputRequest::default(),
            scales: None,
            parts: None,
            ends_only: false,
        };
        let newton_steps = |count: usize| {
            let mut run = GaussStepper::new(&problem, 8, span / count as f64, StepperOptions::default()).unwrap();
            run.advance(count).map(|()| run.newton_steps() as f64 / count as f64)
        };
        let guess = first_guess(&request, 8, 1e-9);
        assert!(newton_steps(guess).is_ok_and(|part| part <= 0.25), "{guess}: {:?}", newton_steps(guess));
        assert!(!newton_steps(guess / 4).is_ok_and(|part| part <= 0.25), "{guess}: {:?}", newton_steps(guess / 4));
    }
}
