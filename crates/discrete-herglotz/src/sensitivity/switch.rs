//! The derivatives of a switching function and of a reset at its zero.

use crate::integration::{PartPoint, Passage};
use crate::sensitivity::columns::Column;
use crate::sensitivity::corner_derivatives::CornerDerivatives;
use crate::sensitivity::end_state::{EndCovector, VelocityDependence};
use crate::sensitivity::parameter_derivatives::{ParameterDerivatives, Quantity};
use crate::sensitivity::{SensitivityError, ridders};
use crate::{Problem, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_or_nan;
use contact_geom::switching::Control;
use contact_geom::{ChartVector, Derivatives, Dual, Hessian, Parametric, VelocityPoint, herglotz_field};

/// The rate of a function along the motion below which its zero is a tangential one, relative to the size of its terms
/// and to a step: half of the digits, since the time of a tangential zero has half of them.
pub(crate) const MIN_RATE: f64 = 1.5e-8;

/// A number with its derivative along one direction.
type Along = Dual<f64, SVector<f64, 1>>;

fn moving(re: f64, d: f64) -> Along {
    Dual { re, d: SVector::<f64, 1>::from_element(d) }
}

/// An argument of a switching function or of a reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Argument {
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

/// A zero of a switching function at a point of the motion.
pub(crate) struct Switch<'s, 'p, L, const N: usize> {
    pub problem: &'s Problem<'p, L, N>,
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
pub(crate) struct SwitchGradient<const N: usize> {
    pub state: ChartVector<N>,
    pub parameters: Vec<f64>,
    time: f64,
    min_rate: f64,
}

impl<const N: usize> SwitchGradient<N> {
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

impl<L: Parametric<N>, const N: usize> Switch<'_, '_, L, N> {
    pub(super) fn failed(&self, cause: StepError) -> SensitivityError {
        SensitivityError::Step { step: self.step, cause }
    }

    fn unknown(&self, cause: &'static str) -> SensitivityError {
        SensitivityError::Passage { t: self.at.t, index: self.index, cause }
    }

    /// The point of the motion.
    pub(super) fn point(&self) -> VelocityPoint<N> {
        self.at.point().fixed()
    }

    /// The dependence of the velocity on the state there.
    fn velocity_dependence(&self) -> Result<VelocityDependence<N>, SensitivityError> {
        VelocityDependence::at(self.problem, self.at.t, &self.point(), &self.at.state.p.fixed())
            .map_err(|cause| self.failed(cause))
    }

    /// The parameters, the time and the point, moving along an argument.
    pub(super) fn moving(&self, along: Argument) -> (Vec<Along>, Along, VelocityPoint<N, Along>) {
        let unit = |is: bool| f64::from(u8::from(is));
        let x = self.point();
        let theta = self.problem.lagrangian.parameters().into_iter().enumerate();
        let theta = theta.map(|(k, value)| moving(value, unit(along == Argument::Parameter(k)))).collect();
        let q = SVector::from_fn(|i, _| moving(x.q[i], unit(along == Argument::Position(i))));
        let v = SVector::from_fn(|i, _| moving(x.v[i], unit(along == Argument::Velocity(i))));
        let z = moving(x.z, unit(along == Argument::Action));
        (theta, moving(self.at.t, unit(along == Argument::Time)), VelocityPoint { q, v, z })
    }

    /// The derivative of a function of the Lagrangian, the time and the point along an argument, by differences.
    pub(super) fn difference(
        &self,
        along: Argument,
        f: impl Fn(&L, f64, &VelocityPoint<N>) -> Option<Vec<f64>>,
    ) -> Result<Vec<f64>, SensitivityError> {
        let (lagrangian, x) = (self.problem.lagrangian, self.point());
        let found = difference(along, (lagrangian, self.at.t, &x), self.h, f);
        found.ok_or_else(|| self.unknown("it cannot be evaluated at nearby states, times and parameters"))
    }

    /// The derivative of the switching function along an argument.
    fn function_along(&self, along: Argument) -> Result<f64, SensitivityError> {
        let (theta, t, x) = self.moving(along);
        if let Some(g) = self.problem.lagrangian.switching_function_at(&theta, self.index, t, &x) {
            return Ok(g.d[0]);
        }
        let value = |lagrangian: &L, t: f64, x: &VelocityPoint<N>| {
            let mut values = Vec::new();
            lagrangian.switching_functions(t, x, &mut values);
            values.get(self.index).map(|g| vec![*g])
        };
        Ok(self.difference(along, value)?[0])
    }

    /// The derivatives of the switching function.
    pub fn gradient(&self) -> Result<SwitchGradient<N>, SensitivityError> {
        let (lagrangian, x, t) = (self.problem.lagrangian, self.point(), self.at.t);
        let (mut of, mut explicit) = (EndCovector::<N>::zero(), Vec::new());
        for along in arguments(N, lagrangian.parameter_count()) {
            let g = self.function_along(along)?;
            match along {
                Argument::Position(i) => of.q[i] = g,
                Argument::Velocity(i) => of.v[i] = g,
                Argument::Action => of.z = g,
                Argument::Time => of.t = g,
                Argument::Parameter(_) => explicit.push(g),
            }
        }
        let field = herglotz_field(lagrangian, t, &x).map_err(|_| self.failed(StepError::NonFinite))?;
        let (state, mut parameters, time) = self.velocity_dependence()?.pull(&of);
        parameters.iter_mut().zip(explicit).for_each(|(sum, explicit)| *sum += explicit);
        Ok(SwitchGradient {
            state,
            parameters,
            time,
            min_rate: MIN_RATE * terms(&of, (t, &x), &field, self.h) / self.h.abs(),
        })
    }

    /// The state after a reset, moving along an argument: `(q, v, z)`.
    fn state_along(&self, along: Argument) -> Result<ChartVector<N>, SensitivityError> {
        let (theta, t, x) = self.moving(along);
        if let Some(to) = self.problem.lagrangian.state_after_switch_at(&theta, self.index, t, &x) {
            return Ok(ChartVector { x: to.q.map(|x| x.d[0]), y: to.v.map(|x| x.d[0]), z: to.z.d[0] });
        }
        let state = |lagrangian: &L, t: f64, x: &VelocityPoint<N>| {
            let to = replaced(lagrangian.at_switch(self.index, t, x, self.rising))?;
            Some(to.q.iter().chain(&to.v).chain([&to.z]).copied().collect())
        };
        let of = self.difference(along, state)?;
        Ok(ChartVector { x: SVector::from_fn(|i, _| of[i]), y: SVector::from_fn(|i, _| of[N + i]), z: of[2 * N] })
    }

    /// The derivatives of the change of the state there, if it changes; `next` is the point after it.
    pub fn passage(
        &self,
        passage: Passage,
        next: &PartPoint,
    ) -> Result<Option<PassageDerivatives<N>>, SensitivityError> {
        match passage {
            Passage::Continuous => Ok(None),
            Passage::Reset => self.reset().map(|reset| Some(PassageDerivatives::Reset(reset))),
            Passage::Refraction => self.corner(next, true).map(|corner| Some(PassageDerivatives::Corner(corner))),
            Passage::Reflection => self.corner(next, false).map(|corner| Some(PassageDerivatives::Corner(corner))),
            Passage::Accumulation => Err(self.unknown("it is the limit of infinitely many resets")),
        }
    }

    /// The derivatives of the reset.
    fn reset(&self) -> Result<ResetDerivatives<N>, SensitivityError> {
        let (lagrangian, t) = (self.problem.lagrangian, self.at.t);
        let images = arguments(N, lagrangian.parameter_count()).map(|along| self.state_along(along));
        let images = images.collect::<Result<Vec<_>, _>>()?;
        let before = self.velocity_dependence()?;
        let to = replaced(lagrangian.at_switch(self.index, t, &self.point(), self.rising));
        let to = to.ok_or_else(|| self.unknown("the state is not replaced there"))?;
        let mut of = ParameterDerivatives::new(lagrangian);
        let parameters =
            (0..of.count()).map(|k| of.at(lagrangian, Quantity::Parameter(k), t, &to).gradient.y).collect();
        let time = of.at(lagrangian, Quantity::Time, t, &to).gradient.y;
        Ok(ResetDerivatives { images, before, hessian: lagrangian.hessian(t, &to), parameters, time })
    }
}

/// The derivative of a function of a Lagrangian, the time and the point along an argument, by differences, for a motion
/// with steps of length h.
pub(super) fn difference<L: Parametric<N>, const N: usize>(
    along: Argument,
    (lagrangian, t, x): (&L, f64, &VelocityPoint<N>),
    h: f64,
    f: impl Fn(&L, f64, &VelocityPoint<N>) -> Option<Vec<f64>>,
) -> Option<Vec<f64>> {
    let theta = lagrangian.parameters();
    let size = match along {
        Argument::Position(i) => max_or_nan(x.q[i].abs(), (x.v[i] * h).abs()),
        Argument::Velocity(i) => x.v[i].abs(),
        Argument::Action => x.z.abs(),
        Argument::Time => h.abs(),
        Argument::Parameter(k) => theta.get(k).map_or(0.0, |x| x.abs()),
    };
    ridders::derivative(if size > 0.0 { size } else { 1.0 }, |by| {
        let (mut t, mut x) = (t, *x);
        match along {
            Argument::Position(i) => x.q[i] += by,
            Argument::Velocity(i) => x.v[i] += by,
            Argument::Action => x.z += by,
            Argument::Time => t += by,
            Argument::Parameter(k) => {
                let mut theta = theta.clone();
                *theta.get_mut(k)? += by;
                return f(&lagrangian.with_parameters(&theta)?, t, &x);
            }
        }
        f(lagrangian, t, &x)
    })
}

/// The state with which a state is replaced, if it is.
fn replaced<const N: usize>(control: Control<N>) -> Option<VelocityPoint<N>> {
    match control {
        Control::Replace(to) | Control::Conformal { to, .. } => Some(to),
        _ => None,
    }
}

/// The size of the terms of a function with these derivatives, over a step of length h of a motion.
pub(crate) fn terms<const N: usize>(
    of: &EndCovector<N>,
    (t, x): (f64, &VelocityPoint<N>),
    field: &ChartVector<N>,
    h: f64,
) -> f64 {
    let max = |of: f64, x: f64, y: f64| of.abs() * max_or_nan(x.abs(), y.abs());
    let mut sum = max(of.t, t, h) + max(of.z, x.z, field.z * h);
    for i in 0..N {
        sum += max(of.q[i], max_or_nan(x.q[i].abs(), (x.v[i] * h).abs()), field.y[i] * h * h);
        sum += max(of.v[i], x.v[i], field.y[i] * h);
    }
    sum
}

/// The derivatives of a change of the state at a switch.
pub(crate) enum PassageDerivatives<const N: usize> {
    Reset(ResetDerivatives<N>),
    Corner(CornerDerivatives<N>),
}

impl<const N: usize> PassageDerivatives<N> {
    /// The tangent `(q, p, z)` after the change from that before it, whose time has the derivative `dt`.
    pub fn along(&self, column: &Column<N>, dt: f64) -> ChartVector<N> {
        match self {
            PassageDerivatives::Reset(reset) => reset.along(column, dt),
            PassageDerivatives::Corner(corner) => corner.along(column, dt),
        }
    }

    /// The derivatives in the state `(q, p, z)` before the change, in the parameters and in the time, of a number with these
    /// derivatives in the state after it.
    pub fn pull(&self, of: &ChartVector<N>) -> (ChartVector<N>, Vec<f64>, f64) {
        match self {
            PassageDerivatives::Reset(reset) => reset.pull(of),
            PassageDerivatives::Corner(corner) => corner.pull(of),
        }
    }
}

/// The derivatives of a reset.
pub(crate) struct ResetDerivatives<const N: usize> {
    /// Those of the `(q, v, z)` after it in each argument.
    images: Vec<ChartVector<N>>,
    before: VelocityDependence<N>,
    /// The second derivatives of L after it, with those of `L_v` in the parameters and in the time.
    hessian: Hessian<N>,
    parameters: Vec<SVector<f64, N>>,
    time: SVector<f64, N>,
}

impl<const N: usize> ResetDerivatives<N> {
    fn along(&self, column: &Column<N>, dt: f64) -> ChartVector<N> {
        let Column { q, p, z, parameter, .. } = column;
        let v = self.before.along(q, p, *z, *parameter, dt);
        let mut sum = ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 };
        for (along, image) in arguments(N, self.parameters.len()).zip(&self.images) {
            let factor = match along {
                Argument::Position(i) => q[i],
                Argument::Velocity(i) => v[i],
                Argument::Action => *z,
                Argument::Time => dt,
                Argument::Parameter(k) => f64::from(u8::from(*parameter == Some(k))),
            };
            sum = sum.plus(image.scale(factor));
        }
        let Hessian { qv, vv, vz, .. } = &self.hessian;
        let explicit = parameter.and_then(|k| self.parameters.get(k).copied()).unwrap_or_else(SVector::zeros);
        let p = qv.transpose() * sum.x + vv * sum.y + vz * sum.z + explicit + self.time * dt;
        ChartVector { y: p, ..sum }
    }

    fn pull(&self, of: &ChartVector<N>) -> (ChartVector<N>, Vec<f64>, f64) {
        let Hessian { qv, vv, vz, .. } = &self.hessian;
        let after = ChartVector { x: of.x + qv * of.y, y: vv * of.y, z: of.z + vz.dot(&of.y) };
        let (mut before, mut explicit) = (EndCovector::<N>::zero(), Vec::new());
        for (along, image) in arguments(N, self.parameters.len()).zip(&self.images) {
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
