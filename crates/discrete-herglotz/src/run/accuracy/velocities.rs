//! The velocities of a motion at some times, and its largest speed.

use crate::gauss::stages::product::product_of_sizes;
use crate::integration::SystemProblem;
use crate::integration::motion::NearbyVelocity;
use crate::run::accuracy::equilibrium_round_off::accumulated_roundings;
use crate::run::accuracy::track::norm_in_units;
use crate::run::request::Request;
use crate::system::mass_matrix::inverse;
use crate::{InputError, SelectionFailure, State, Vector};
use contact_geom::numbers::max_or_nan;

/// The velocities of one run, and the speed to which their errors are relative.
pub(crate) struct Velocities<'r, 'p> {
    problem: &'r SystemProblem<'p>,
    scales: Option<&'r Vector>,
    /// The largest speed so far, and the largest position.
    speed: f64,
    largest_position: f64,
    /// The last time and position.
    before: (f64, Vector),
}

impl<'r, 'p> Velocities<'r, 'p> {
    /// The velocities of a run at its start, with the scales of the coordinates, if they are given.
    pub fn new(problem: &'r SystemProblem<'p>, scales: Option<&'r Vector>) -> Self {
        let size = |x: &Vector| norm_in_units(x, scales);
        let (speed, largest_position) = (size(&problem.start.v), size(&problem.start.q));
        Velocities { problem, scales, speed, largest_position, before: (problem.t0, problem.start.q.clone()) }
    }

    /// Updates the largest speed at the end of a step, by the mean velocity of the step.
    pub fn record_position(&mut self, t: f64, q: &Vector) {
        let (t_before, q_before) = std::mem::replace(&mut self.before, (t, q.clone()));
        self.largest_position = max_or_nan(self.largest_position, norm_in_units(q, self.scales));
        if t != t_before {
            self.record_velocity(&((q - q_before) / (t - t_before)));
        }
    }

    /// The velocity at a state; if there are several, the one close to `near`. 0 if none is found: a run that needs the
    /// velocity fails by itself.
    pub fn at(&mut self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Vector {
        self.record_position(t, &state.q);
        let SystemProblem { system, start, .. } = self.problem;
        let found = system.legendre_inverse(t, state, near.unwrap_or(&start.v));
        let v = found.map_or_else(|_| Vector::zeros(system.dimension()), |x| x.v);
        self.record_velocity(&v);
        v
    }

    fn record_velocity(&mut self, v: &Vector) {
        self.speed = max_or_nan(self.speed, norm_in_units(v, self.scales));
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

impl Request<'_> {
    /// Changes the cause of a refused accuracy to the round-off of the velocity, if that alone exceeds the requested
    /// error: a momentum `p = v + A(q)` determines v up to the round-off of A.
    pub(crate) fn by_rounding_of_velocity(&self, refused: InputError) -> InputError {
        let SystemProblem { system, start, state, t0, .. } = &self.problem;
        let InputError::Accuracy { wanted, .. } = refused else { return refused };
        if system.hints().hamiltonian {
            return refused; // The velocity is a function of the momentum.
        }
        let rounding = inverse(&system.hessian(*t0, start).vv).map_or(0.0, |inverse| {
            let mut v = Vector::zeros(system.dimension());
            product_of_sizes(&inverse, &state.p.map(f64::abs), &mut v);
            v.norm() * f64::EPSILON / start.v.norm()
        });
        if rounding > wanted && rounding.is_finite() {
            return InputError::Accuracy { wanted, reached: rounding, cause: SelectionFailure::RoundOff };
        }
        refused
    }
}
