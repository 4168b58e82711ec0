//! The motion along a step, as switching functions see it.

use crate::gauss::StepStart;
use crate::integration::{hermite, state_at};
use crate::switching::local_motion::{phase_point, rates_along_motion};
use crate::switching::stepper::parts::time_spacing;
use crate::{DenseStep, Point, State, System, Vector};

/// The number of equal parts in which a curve without dense output is searched for jumps.
const DEFAULT_PARTS: usize = 8;

/// The degree of interpolation of a function along a step without dense output: nearly twice that of a search for
/// events, since a sign change that is missed spoils the step.
const DEFAULT_DEGREE: usize = 7;

/// The largest number of stages with which the cubic Hermite polynomial, of order 4, is used in place of the
/// collocation polynomial, whose order between the ends of the step is the number of stages.
const MAX_HERMITE_STAGES: usize = 2;

/// The length of a step, in units of the round-off of its time, up to which the nodes of an interpolant may have the same
/// rounded times.
const SHORT: f64 = 16.0;

/// A time and a state of the motion, with its velocity.
#[derive(Clone, Debug)]
pub(super) struct TimedState {
    pub t: f64,
    pub state: State,
    pub v: Vector,
    /// The compensation terms of the sums of the stepper, beyond the last digits of the state.
    pub rests: StepStart,
}

impl TimedState {
    /// The point `(q, v, z)`.
    pub fn point(&self) -> Point {
        Point { q: self.state.q.clone(), v: self.v.clone(), z: self.state.z }
    }

    /// The motion at a point at which switching functions are evaluated; 0 in the place of a velocity that is not defined.
    pub fn of_argument(system: &dyn System, t: f64, x: &Point) -> Self {
        let n = x.q.len();
        let (state, v) = match system.hints().hamiltonian {
            true => {
                let v = rates_along_motion(system, t, x).map_or_else(|| Vector::zeros(n), |rates| rates.x);
                (State { q: x.q.clone(), p: x.v.clone(), z: x.z }, v)
            }
            false => (state_at(system, t, x), x.v.clone()),
        };
        TimedState { t, state, v, rests: StepStart::zeros(n) }
    }

    /// The point at which switching functions are evaluated: `(q, v, z)`, or `(q, p, z)` with the momentum in the place of
    /// the velocity for a system that is given by a contact Hamiltonian.
    pub fn argument(&self, system: &dyn System) -> Point {
        if system.hints().hamiltonian { phase_point(&self.state) } else { self.point() }
    }
}

/// The curve of a step: its collocation polynomial, or the cubic Hermite polynomial through both ends with their
/// velocities.
pub(super) struct StepCurve {
    pub from: TimedState,
    pub to: TimedState,
    pub dense: Option<DenseStep>,
    /// For a system that is given by a contact Hamiltonian the derivatives of the momenta at both ends, where they are
    /// interpolated, and otherwise nothing.
    forces: Option<[Vector; 2]>,
    is_hamiltonian: bool,
}

impl StepCurve {
    /// The curve of a step of a system, with its dense output if it has one.
    pub fn new(system: &dyn System, [from, to]: [TimedState; 2], dense: Option<DenseStep>) -> Self {
        let is_hamiltonian = system.hints().hamiltonian;
        let forces = (is_hamiltonian && dense.is_none()).then(|| {
            [&from, &to].map(|at| {
                let field = rates_along_motion(system, at.t, &phase_point(&at.state));
                field.map_or_else(|| Vector::zeros(at.v.len()), |field| field.y)
            })
        });
        StepCurve { from, to, dense, forces, is_hamiltonian }
    }

    pub(super) fn parts(&self) -> usize {
        DEFAULT_PARTS
    }

    /// The degree with which a function is interpolated first: with its value at the start, it is evaluated `s + 2`
    /// times on a step with s stages.
    pub fn sampling_degree(&self) -> usize {
        self.collocation().map_or(DEFAULT_DEGREE, |dense| dense.sampling_degree() - 1)
    }

    /// The collocation polynomial, if it is the more accurate curve. It always is for a contact Hamiltonian, whose
    /// velocities may jump at the ends of a step.
    fn collocation(&self) -> Option<&DenseStep> {
        self.dense.as_ref().filter(|dense| dense.stages() > MAX_HERMITE_STAGES || self.is_hamiltonian)
    }

    /// The interpolant through both ends, extrapolated outside of the step.
    pub fn between_ends(&self, fraction: f64) -> Point {
        let (span, [from, to]) = (self.span(), [&self.from, &self.to]);
        let x = hermite(&from.point(), &to.point(), span, fraction * span);
        let Some([at_start, at_end]) = &self.forces else { return x };
        let momenta = |at: &TimedState, rate: &Vector| Point { q: at.state.p.clone(), v: rate.clone(), z: at.state.z };
        let p = hermite(&momenta(from, at_start), &momenta(to, at_end), span, fraction * span).q;
        Point { v: p, ..x }
    }

    pub fn span(&self) -> f64 {
        self.to.t - self.from.t
    }

    /// The fraction of the time at a fraction of the step, which is rounded. A surface that moves is where it is at this time,
    /// and so must be the point: otherwise a function changes its sign by the rounding of a time. On a step of few rounded
    /// times the motion is round-off, and the fraction is kept.
    pub(super) fn rounded(&self, fraction: f64) -> f64 {
        let t = self.from.t + fraction * self.span();
        let is_short = self.span().abs() <= SHORT * time_spacing(self.to.t, self.span());
        if is_short { fraction } else { (t - self.from.t) / self.span() }
    }

    /// The time and the point, for switching functions, at a fraction of the step.
    pub(super) fn at(&self, fraction: f64) -> (f64, Point) {
        let fraction = self.rounded(fraction);
        if fraction == 1.0 {
            return (self.to.t, if self.is_hamiltonian { phase_point(&self.to.state) } else { self.to.point() });
        }
        let t = self.from.t + fraction * self.span();
        let x = match self.collocation() {
            Some(dense) if self.is_hamiltonian => phase_point(&dense.at_fraction(fraction)),
            Some(dense) => {
                let x = dense.at_fraction(fraction);
                Point { q: x.q, v: dense.velocity(t), z: x.z }
            }
            None => self.between_ends(fraction),
        };
        (t, x)
    }
}
