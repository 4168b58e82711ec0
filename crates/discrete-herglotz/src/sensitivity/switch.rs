//! The derivatives of a switching function and of a reset at its zero.

use crate::integration::{PartPoint, Passage};
use crate::sensitivity::columns::Column;
use crate::sensitivity::corner_derivatives::CornerDerivatives;
use crate::sensitivity::parametric_system::{Differentiable, Quantity};
use crate::sensitivity::velocity_dependence::VelocityDependence;
use crate::sensitivity::{EndCovector, SensitivityError};
use crate::switching::{phase_point, rates_along_motion};
use crate::system::products::times;
use crate::system::ridders;
use crate::{AtSwitch, Components, Point, SecondDerivatives, StepError, System, Vector};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_or_nan;
use contact_geom::{Dual, VelocityPoint};

/// The rate of a function along the motion below which its zero is a tangential one, relative to the size of its terms
/// and to a step: half of the digits, since the time of a tangential zero has half of them.
pub(crate) const MIN_RATE: f64 = 1.5e-8;

/// The distance, relative to a coordinate, within which a passage is at a corner of its surface: some hundred thousand
/// roundings.
const CORNER_DISTANCE: f64 = 1e-10;

/// The largest number of halvings of the distances of differences beside a corner of a surface: the derivative keeps seven
/// digits.
const MAX_HALVINGS: i32 = 20;

/// The part of the changes of a function by which they differ from those of a smooth one at a kink.
const MIN_KINK: f64 = 1e-2;

/// The number of roundings of the terms of a function that is no kink.
const MAX_ROUNDINGS: f64 = 64.0;

/// The part of all positions by which they are changed to find the size of the terms of a function.
const SIZE_DISTANCE: f64 = 1e-3;

/// Why a passage at a corner has no derivative.
const AT_CORNER: &str = "it is at a corner of the surface, where motions on its two sides differ; differentiate a run that \
                         ends before, or with another start";

/// A number with its derivative along one direction.
pub(super) type Along = Dual<f64, SVector<f64, 1>>;

fn moving(re: f64, d: f64) -> Along {
    Dual { re, d: SVector::<f64, 1>::from_element(d) }
}

/// An argument of a switching function or of a reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Argument {
    Position(usize),
    Velocity(usize),
    Action,
    Time,
    Parameter(usize),
}

/// All of them, in the order q, v, z, t, parameters.
fn arguments(n: usize, parameters: usize) -> impl Iterator<Item = Argument> {
    let state = (0..n).map(Argument::Position).chain((0..n).map(Argument::Velocity));
    state.chain([Argument::Action, Argument::Time]).chain((0..parameters).map(Argument::Parameter))
}

/// Parameters, a time and a point, moving along an argument.
pub(super) fn moving_point<const N: usize>(
    along: Argument,
    parameters: &[f64],
    t: f64,
    x: &Point,
) -> (Vec<Along>, Along, VelocityPoint<N, Along>) {
    let unit = |is: bool| f64::from(u8::from(is));
    let x = x.fixed::<N>();
    let theta = parameters.iter().enumerate();
    let theta = theta.map(|(k, value)| moving(*value, unit(along == Argument::Parameter(k)))).collect();
    let q = SVector::from_fn(|i, _| moving(x.q[i], unit(along == Argument::Position(i))));
    let v = SVector::from_fn(|i, _| moving(x.v[i], unit(along == Argument::Velocity(i))));
    let z = moving(x.z, unit(along == Argument::Action));
    (theta, moving(t, unit(along == Argument::Time)), VelocityPoint { q, v, z })
}

/// A zero of a switching function at a point of the motion.
pub(crate) struct Switch<'s, 'p> {
    pub problem: &'s Differentiable<'p>,
    pub index: usize,
    pub rising: bool,
    pub at: &'s PartPoint,
    /// The number of the step.
    pub step: usize,
    /// The step size.
    pub h: f64,
}

/// The derivatives of a switching function g: in the state `(q, p, z)` and in the parameters, for a fixed time, and in the
/// time.
pub(crate) struct SwitchGradient {
    pub state: Components,
    pub parameters: Vec<f64>,
    time: f64,
    min_rate: f64,
}

impl SwitchGradient {
    /// The rate of g along the motion; `along_state` is that for a fixed time.
    ///
    /// # Errors
    /// [`SensitivityError::Grazing`] if it is round-off.
    pub fn rate(&self, along_state: f64, t: f64) -> Result<f64, SensitivityError> {
        let rate = self.time + along_state;
        // Written so that a NaN is refused.
        if rate.abs() > self.min_rate { Ok(rate) } else { Err(SensitivityError::Grazing { t, rate }) }
    }
}

impl Switch<'_, '_> {
    pub(super) fn failed(&self, cause: StepError) -> SensitivityError {
        SensitivityError::Step { step: self.step, cause }
    }

    fn unknown(&self, cause: &'static str) -> SensitivityError {
        SensitivityError::Passage { t: self.at.t, index: self.index, cause }
    }

    /// The point of the motion at which switching functions are evaluated, with the momentum in the place of the velocity
    /// for a contact Hamiltonian.
    pub(super) fn point(&self) -> Point {
        if self.problem.is_hamiltonian() { phase_point(&self.at.state) } else { self.at.point() }
    }

    /// The arguments.
    fn arguments(&self) -> impl Iterator<Item = Argument> {
        arguments(self.problem.dimension(), self.problem.of.parameters().len())
    }

    /// The dependence of the velocity on the state there.
    fn velocity_dependence(&self) -> Result<VelocityDependence, SensitivityError> {
        VelocityDependence::at(self.problem, self.at.t, &self.at.point(), &self.at.state.p)
            .map_err(|cause| self.failed(cause))
    }

    /// The derivative of a function of the system, the time and the point along an argument, by differences.
    pub(super) fn difference(
        &self,
        along: Argument,
        f: impl Fn(&dyn System, f64, &Point) -> Option<Vec<f64>>,
    ) -> Result<Vec<f64>, SensitivityError> {
        let (problem, t, x, part) = (self.problem, self.at.t, self.point(), self.smooth_part(along)?);
        let found = match along {
            Argument::Parameter(k) => difference_in_parameter(problem, k, part, &mut |system| f(system, t, &x)),
            _ => difference(along, (t, &x), self.h, part, &|t, x| f(problem.system(), t, x)),
        };
        found.ok_or_else(|| self.unknown("it cannot be evaluated at nearby states, times and parameters"))
    }

    /// The part of the distances of differences along an argument within which the surface has no corner.
    fn smooth_part(&self, along: Argument) -> Result<f64, SensitivityError> {
        let mut parts = (0..=MAX_HALVINGS).map(|k| f64::powi(0.5, k));
        let part = parts.find(|part| !self.is_kinked(along, ridders::FIRST_DISTANCE * part));
        part.ok_or_else(|| self.unknown(AT_CORNER))
    }

    /// Whether the switching function has a kink within a distance along an argument, relative to its size: its changes
    /// over this distance and over half of it are not those of a smooth function, up to third order.
    fn is_kinked(&self, along: Argument, distance: f64) -> bool {
        let (problem, x, t) = (self.problem, self.point(), self.at.t);
        let value = |system: &dyn System, t: f64, x: &Point| self.function(system, t, x).map_or(f64::NAN, |g| g[0]);
        let here = value(problem.system(), t, &x);
        let moved = |part: f64| match along {
            Argument::Parameter(k) => {
                let mut theta = problem.of.parameters();
                if let Some(theta) = theta.get_mut(k) {
                    *theta += part * distance * scale(theta.abs());
                }
                let mut of = |system: &dyn System| self.function(system, t, &x);
                problem.of.with_parameters(&theta, &mut of).map_or(f64::NAN, |g| g[0]) - here
            }
            _ => {
                let (t, x) = moved(along, (t, &x), part * distance * scale(size(along, &x, self.h)));
                value(problem.system(), t, &x) - here
            }
        };
        let [after, before, near_after, near_before] = [1.0, -1.0, 0.5, -0.5].map(moved);
        let of_even = (after + before - 4.0 * (near_after + near_before)).abs();
        let of_odd = (after - before - 2.0 * (near_after - near_before)).abs();
        // The size of the terms of the function: its change with all positions.
        let grown = Point { q: &x.q * (1.0 + SIZE_DISTANCE) + &x.v * (SIZE_DISTANCE * self.h), ..x.clone() };
        let terms = (value(problem.system(), t, &grown) - here).abs() / SIZE_DISTANCE;
        max_or_nan(of_even, of_odd) > MIN_KINK * (after.abs() + before.abs()) + MAX_ROUNDINGS * f64::EPSILON * terms
    }

    /// The value of the switching function at a point.
    pub(super) fn function(&self, system: &dyn System, t: f64, x: &Point) -> Option<Vec<f64>> {
        let mut values = Vec::new();
        system.switching_functions(t, x, &mut values);
        values.get(self.index).map(|g| vec![*g])
    }

    /// The derivative of the switching function along an argument.
    fn function_along(&self, along: Argument) -> Result<f64, SensitivityError> {
        if let Some(g) = self.problem.of.switching_function_along(along, self.index, self.at.t, &self.point()) {
            return Ok(g);
        }
        Ok(self.difference(along, |system, t, x| self.function(system, t, x))?[0])
    }

    /// The derivatives of the switching function.
    pub fn gradient(&self) -> Result<SwitchGradient, SensitivityError> {
        let (problem, x, t) = (self.problem, self.point(), self.at.t);
        let (mut of, mut explicit) = (EndCovector::zero(problem.dimension()), Vec::new());
        for along in self.arguments() {
            let g = self.function_along(along)?;
            match along {
                Argument::Position(i) => of.q[i] = g,
                Argument::Velocity(i) => of.v[i] = g,
                Argument::Action => of.z = g,
                Argument::Time => of.t = g,
                Argument::Parameter(_) => explicit.push(g),
            }
        }
        let field = rates_along_motion(problem.system(), t, &x).ok_or_else(|| self.failed(StepError::NonFinite))?;
        let min_rate = MIN_RATE * terms(&of, (t, &x), &field, self.h) / self.h.abs();
        if problem.is_hamiltonian() {
            // The function depends on the momentum itself.
            let state = Components { x: of.q, y: of.v, z: of.z };
            return Ok(SwitchGradient { state, parameters: explicit, time: of.t, min_rate });
        }
        let (state, mut parameters, time) = self.velocity_dependence()?.pull(&of);
        parameters.iter_mut().zip(explicit).for_each(|(sum, explicit)| *sum += explicit);
        Ok(SwitchGradient { state, parameters, time, min_rate })
    }

    /// The state after a reset, moving along an argument: `(q, v, z)`.
    fn state_along(&self, along: Argument) -> Result<Components, SensitivityError> {
        if let Some(to) = self.problem.of.state_after_switch_along(along, self.index, self.at.t, &self.point()) {
            return Ok(to);
        }
        let state = |system: &dyn System, t: f64, x: &Point| {
            let to = replaced(system.at_switch(self.index, t, x, self.rising))?;
            Some(to.q.iter().chain(&to.v).chain([&to.z]).copied().collect())
        };
        let (of, n) = (self.difference(along, state)?, self.problem.dimension());
        Ok(Components { x: of[..n].into(), y: of[n..2 * n].into(), z: of[2 * n] })
    }

    /// The derivatives of the change of the state there, if it changes; `next` is the point after it.
    pub fn passage(&self, passage: Passage, next: &PartPoint) -> Result<Option<PassageDerivatives>, SensitivityError> {
        match passage {
            Passage::Continuous => Ok(None),
            Passage::Reset => Ok(Some(PassageDerivatives::Reset(Box::new(self.reset()?)))),
            Passage::Refraction => Ok(Some(PassageDerivatives::Corner(Box::new(self.corner(next, true)?)))),
            Passage::Reflection => Ok(Some(PassageDerivatives::Corner(Box::new(self.corner(next, false)?)))),
            Passage::Corner => Err(self.unknown(AT_CORNER)),
            Passage::Accumulation => Err(self.unknown("it is the limit of infinitely many resets")),
        }
    }

    /// The derivatives of the reset.
    fn reset(&self) -> Result<ResetDerivatives, SensitivityError> {
        let at_corner = |i: usize| self.is_kinked(Argument::Position(i), CORNER_DISTANCE);
        if (0..self.problem.dimension()).any(at_corner) {
            return Err(self.unknown(AT_CORNER));
        }
        let (problem, t) = (self.problem, self.at.t);
        let images = self.arguments().map(|along| self.state_along(along)).collect::<Result<Vec<_>, _>>()?;
        let before = self.velocity_dependence()?;
        let to = replaced(problem.system().at_switch(self.index, t, &self.point(), self.rising));
        let to = to.ok_or_else(|| self.unknown("the state is not replaced there"))?;
        let mut of = problem.stages.quantities();
        let parameters = (0..of.count()).map(|k| of.at(Quantity::Parameter(k), t, &to).gradient.y).collect();
        let time = of.at(Quantity::Time, t, &to).gradient.y;
        Ok(ResetDerivatives { images, before, hessian: problem.system().hessian(t, &to), parameters, time })
    }
}

/// The size of an argument at a point of a motion with steps of length h; that of a parameter is not known.
fn size(along: Argument, x: &Point, h: f64) -> f64 {
    match along {
        Argument::Position(i) => max_or_nan(x.q[i].abs(), (x.v[i] * h).abs()),
        Argument::Velocity(i) => x.v[i].abs(),
        Argument::Action => x.z.abs(),
        Argument::Time => h.abs(),
        Argument::Parameter(_) => f64::NAN,
    }
}

/// A time and a point, of which one argument is moved.
fn moved(along: Argument, (mut t, x): (f64, &Point), by: f64) -> (f64, Point) {
    let mut x = x.clone();
    match along {
        Argument::Position(i) => x.q[i] += by,
        Argument::Velocity(i) => x.v[i] += by,
        Argument::Action => x.z += by,
        Argument::Time => t += by,
        Argument::Parameter(_) => {}
    }
    (t, x)
}

/// The derivative of a function of the time and the point along one of them, by differences over this part of their
/// distances, for a motion with steps of length h; `None` along a parameter.
pub(super) fn difference(
    along: Argument,
    (t, x): (f64, &Point),
    h: f64,
    part: f64,
    f: &dyn Fn(f64, &Point) -> Option<Vec<f64>>,
) -> Option<Vec<f64>> {
    if matches!(along, Argument::Parameter(_)) {
        return None;
    }
    ridders::derivative(part * scale(size(along, x, h)), |by| {
        let (t, x) = moved(along, (t, x), by);
        f(t, &x)
    })
}

/// The derivative of a function of the system in a parameter, by differences over this part of their distances.
pub(super) fn difference_in_parameter(
    problem: &Differentiable<'_>,
    k: usize,
    part: f64,
    f: &mut dyn FnMut(&dyn System) -> Option<Vec<f64>>,
) -> Option<Vec<f64>> {
    let theta = problem.of.parameters();
    ridders::derivative(part * scale(theta.get(k)?.abs()), |by| {
        let mut theta = theta.clone();
        *theta.get_mut(k)? += by;
        problem.of.with_parameters(&theta, f)
    })
}

/// The scale of the distances of differences, for an argument of this size.
fn scale(size: f64) -> f64 {
    if size > 0.0 { size } else { 1.0 }
}

/// The state with which a state is replaced, if it is.
fn replaced(at: AtSwitch) -> Option<Point> {
    match at {
        AtSwitch::Replace { to, .. } => Some(to),
        AtSwitch::Continue => None,
    }
}

/// The size of the terms of a function with these derivatives, over a step of length h of a motion.
pub(crate) fn terms(of: &EndCovector, (t, x): (f64, &Point), field: &Components, h: f64) -> f64 {
    let max = |of: f64, x: f64, y: f64| of.abs() * max_or_nan(x.abs(), y.abs());
    let mut sum = max(of.t, t, h) + max(of.z, x.z, field.z * h);
    for i in 0..x.q.len() {
        sum += max(of.q[i], max_or_nan(x.q[i].abs(), (field.x[i] * h).abs()), field.y[i] * h * h);
        sum += max(of.v[i], x.v[i], field.y[i] * h);
    }
    sum
}

/// The derivatives of a change of the state at a switch.
pub(crate) enum PassageDerivatives {
    Reset(Box<ResetDerivatives>),
    Corner(Box<CornerDerivatives>),
}

impl PassageDerivatives {
    /// The tangent `(q, p, z)` after the change from that before it, whose time has the derivative `dt`.
    pub fn along(&self, column: &Column, dt: f64) -> Components {
        match self {
            PassageDerivatives::Reset(reset) => reset.along(column, dt),
            PassageDerivatives::Corner(corner) => corner.along(column, dt),
        }
    }

    /// The derivatives in the state `(q, p, z)` before the change, in the parameters and in the time, of a number with these
    /// derivatives in the state after it.
    pub fn pull(&self, of: &Components) -> (Components, Vec<f64>, f64) {
        match self {
            PassageDerivatives::Reset(reset) => reset.pull(of),
            PassageDerivatives::Corner(corner) => corner.pull(of),
        }
    }
}

/// The derivatives of a reset.
pub(crate) struct ResetDerivatives {
    /// Those of the `(q, v, z)` after it in each argument.
    images: Vec<Components>,
    before: VelocityDependence,
    /// The second derivatives of L after it, with those of `L_v` in the parameters and in the time.
    hessian: SecondDerivatives,
    parameters: Vec<Vector>,
    time: Vector,
}

impl ResetDerivatives {
    fn along(&self, column: &Column, dt: f64) -> Components {
        let Column { q, p, z, parameter, .. } = column;
        let v = self.before.along(q, p, *z, *parameter, dt);
        let mut sum = Components::zeros(q.len());
        for (along, image) in arguments(q.len(), self.parameters.len()).zip(&self.images) {
            let factor = match along {
                Argument::Position(i) => q[i],
                Argument::Velocity(i) => v[i],
                Argument::Action => *z,
                Argument::Time => dt,
                Argument::Parameter(k) => f64::from(u8::from(*parameter == Some(k))),
            };
            sum = sum.plus(&image.scale(factor));
        }
        let SecondDerivatives { qv, vv, vz, .. } = &self.hessian;
        let mut p = times(&qv.transpose(), &sum.x) + times(vv, &sum.y) + vz * sum.z;
        if let Some(explicit) = parameter.and_then(|k| self.parameters.get(k)) {
            p += explicit;
        }
        Components { y: p + &self.time * dt, ..sum }
    }

    fn pull(&self, of: &Components) -> (Components, Vec<f64>, f64) {
        let SecondDerivatives { qv, vv, vz, .. } = &self.hessian;
        let after = Components { x: &of.x + times(qv, &of.y), y: times(vv, &of.y), z: of.z + vz.dot(&of.y) };
        let (n, mut explicit) = (of.x.len(), Vec::new());
        let mut before = EndCovector::zero(n);
        for (along, image) in arguments(n, self.parameters.len()).zip(&self.images) {
            let factor = after.dot(image);
            match along {
                Argument::Position(i) => before.q[i] = factor,
                Argument::Velocity(i) => before.v[i] = factor,
                Argument::Action => before.z = factor,
                Argument::Time => before.t = factor + self.time.dot(&of.y),
                Argument::Parameter(k) => explicit.push(factor + self.parameters[k].dot(&of.y)),
            }
        }
        let (state, mut parameters, time) = self.before.pull(&before);
        parameters.iter_mut().zip(explicit).for_each(|(sum, explicit)| *sum += explicit);
        (state, parameters, time)
    }
}
