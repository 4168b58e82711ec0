//! The velocities of a motion at some times, and its largest speed.

use crate::Problem;
use crate::integration::SystemProblem;
use crate::integration::motion::NearbyVelocity;
use crate::run::accuracy::equilibrium_round_off::accumulated_roundings;
use crate::run::accuracy::track::{in_units, norm};
use crate::run::request::Request;
use crate::solve::mass_matrix::inverted;
use crate::{InputError, SelectionFailure, theory::legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, numbers::max_or_nan};

/// The velocities of one run, and the speed to which their errors are relative.
pub(crate) struct Velocities<'r, 'p, const N: usize> {
    problem: &'r SystemProblem<'p, N>,
    scales: Option<SVector<f64, N>>,
    /// The largest speed so far, and the largest position.
    speed: f64,
    largest_position: f64,
    /// The last time and position.
    before: (f64, SVector<f64, N>),
}

impl<'r, 'p, const N: usize> Velocities<'r, 'p, N> {
    /// The velocities of a run at its start, with the scales of the coordinates, if they are given.
    pub fn new(problem: &'r SystemProblem<'p, N>, scales: Option<SVector<f64, N>>) -> Self {
        let size = |x: &SVector<f64, N>| norm(&[in_units(x, scales.as_ref())]);
        let (speed, largest_position) = (size(&problem.start.v), size(&problem.start.q));
        Velocities { problem, scales, speed, largest_position, before: (problem.t0, problem.start.q) }
    }

    /// Updates the largest speed at the end of a step, by the mean velocity of the step.
    pub fn record_position(&mut self, t: f64, q: &SVector<f64, N>) {
        let (t_before, q_before) = std::mem::replace(&mut self.before, (t, *q));
        self.largest_position = max_or_nan(self.largest_position, norm(&[in_units(q, self.scales.as_ref())]));
        if t != t_before {
            self.record_velocity(&((q - q_before) / (t - t_before)));
        }
    }

    /// The velocity at a state; if there are several, the one close to `near`. 0 if none is found: a run that needs the
    /// velocity fails by itself.
    pub fn at(&mut self, t: f64, state: &PhasePoint<N>, near: NearbyVelocity<N>) -> SVector<f64, N> {
        self.record_position(t, &state.q);
        let near = near.unwrap_or(self.problem.start.v);
        let v = legendre_inverse(self.problem.lagrangian, t, state, &near).map_or(SVector::zeros(), |x| x.v);
        self.record_velocity(&v);
        v
    }

    fn record_velocity(&mut self, v: &SVector<f64, N>) {
        self.speed = max_or_nan(self.speed, norm(&[in_units(v, self.scales.as_ref())]));
    }

    /// The largest speed of a run with this number of steps; infinite if the motion moves by no more than the round-off
    /// of its positions, so that its velocity is undetermined.
    pub fn speed(&self, steps: usize) -> f64 {
        let moved = self.speed * (self.before.0 - self.problem.t0).abs();
        if moved <= accumulated_roundings(steps) * f64::EPSILON * self.largest_position {
            f64::INFINITY
        } else {
            self.speed
        }
    }
}

impl<const N: usize> Request<'_, N> {
    /// Changes the cause of a refused accuracy to the round-off of the velocity, if that alone exceeds the requested
    /// error: a momentum `p = v + A(q)` determines v up to the round-off of A.
    pub(crate) fn by_rounding_of_velocity(&self, refused: InputError) -> InputError {
        let Problem { lagrangian, start, state, t0, .. } = &self.problem;
        let InputError::Accuracy { wanted, .. } = refused else { return refused };
        if lagrangian.hints().hamiltonian {
            return refused; // The velocity is a function of the momentum.
        }
        let rounding = inverted(&lagrangian.hessian(*t0, start).vv)
            .map_or(0.0, |inverse| (inverse.abs() * state.p.abs()).norm() * f64::EPSILON / start.v.norm());
        if rounding > wanted && rounding.is_finite() {
            return InputError::Accuracy { wanted, reached: rounding, cause: SelectionFailure::RoundOff };
        }
        refused
    }
}
