//! Kinks and jumps at times, as derivatives of runs pass them.
//!
//! Where the rates of the state jump from F to G at a time T, the state at a later time t is that at T, carried on with G:
//! if T has the derivative dT in a variable and t the derivative dt, the tangent that ends with `F dt` lacks
//! `(G - F) (dt - dT)`. A part of a step that ends at T itself is carried to the time that moves with dT, and nothing is
//! lacking. Where several kinks and jumps are at one time and move with different derivatives `r_1, ..., r_m`, in the order
//! in which the motion passes them for a larger parameter, it has between them the rates `F_1, ..., F_(m-1)` for the times
//! `r_2 - r_1, ...`, and `(F_i - G) (r_(i+1) - r_i)` is added for each; dT is `r_1`.

use crate::integration::{PartEnd, PartPoint, SolvedPart};
use crate::run::discretization::Discretization;
use crate::sensitivity::SensitivityError;
use crate::sensitivity::columns::{Column, Covector};
use crate::sensitivity::parametric_system::Differentiable;
use crate::sensitivity::switch::difference_in_parameter;
use crate::switching::stepper::parts::time_spacing;
use crate::switching::{phase_point, rates_along_motion};
use crate::system::AtState;
use crate::{Components, Point, State, StepError, System};
use contact_geom::numbers::max_or_nan;
use contact_geom::switching::BreakRate;

/// The distance from a jump at which the rates before and after it are evaluated, in units of the round-off of its time.
const SIDE_DISTANCE: f64 = 4.0;

/// Two derivatives of times that differ by less, relative to the larger one, are one: they may be found by differences.
const SAME_RATE: f64 = 1e-9;

/// The time between two kinks or jumps that come apart, for the rates between them, in units of a step: so short that
/// three such rates are extrapolated to the time 0 to round-off.
const APART: f64 = 1e-6;

/// The distance in time of the first of three points from which rates are extrapolated to a surface, in units of a step:
/// the motion between them is straight to round-off.
const SHORTLY: f64 = 1e-7;

/// The smallest change of a parameter for this, relative to its value: a multiple of its round-off.
const LEAST_CHANGE: f64 = 1e-11;

/// The weights of the extrapolation from the distances 1, 2, 3 to 0.
const WEIGHTS: [f64; 3] = [3.0, -3.0, 1.0];

/// The kinks and jumps of a run at times.
pub(super) struct TimeJumps<'r, 'p> {
    problem: &'r Differentiable<'p>,
    steps: &'r Discretization<'p>,
    /// The times with their derivatives in each parameter; `None` where they are not known.
    rates: Vec<Option<Vec<BreakRate>>>,
}

/// Kinks and jumps at one time, up to round-off.
#[derive(Clone, Copy, Debug)]
pub(super) struct TimeJump {
    /// Their times, in the order of the run.
    first: f64,
    last: f64,
}

/// Their derivatives in a parameter.
struct OfParameter {
    /// That of the time of the first one.
    first: f64,
    /// What is added to the tangent if they come apart.
    apart: Option<Components>,
}

/// The derivatives of kinks and jumps at one time.
pub(super) struct TimeJumpDerivatives {
    t: f64,
    /// The change of the rates.
    change: Option<Components>,
    /// In each parameter; `None` where they are not known or not wanted.
    parameters: Vec<Option<OfParameter>>,
}

impl<'r, 'p> TimeJumps<'r, 'p> {
    pub fn new(problem: &'r Differentiable<'p>, steps: &'r Discretization<'p>) -> Self {
        let count = if problem.system().breaks().is_empty() { 0 } else { problem.of.parameters().len() };
        TimeJumps { problem, steps, rates: (0..count).map(|k| rates(problem, k)).collect() }
    }

    fn is_backward(&self) -> bool {
        self.steps.h < 0.0
    }

    /// A length of time in the direction of the run.
    fn ahead(&self, length: f64) -> f64 {
        length.copysign(self.steps.h)
    }

    fn spacing(&self, t: f64) -> f64 {
        time_spacing(t, self.steps.h)
    }

    /// Those at times for which a condition holds, between two times.
    fn within(&self, [a, b]: [f64; 2], holds: impl Fn(f64) -> bool) -> Option<TimeJump> {
        let times = self.problem.system().breaks();
        let after = &times[times.partition_point(|t| *t < a.min(b))..];
        let mut found = after.iter().copied().take_while(|t| *t <= a.max(b)).filter(|t| holds(*t));
        let first = found.next()?;
        let last = found.last().unwrap_or(first);
        Some(if self.is_backward() { TimeJump { first: last, last: first } } else { TimeJump { first, last } })
    }

    /// Those at the start of a step, the k-th of the run, at this time. The start of the run is not passed.
    pub fn at_start(&self, t: f64, k: usize) -> Option<TimeJump> {
        let spacing = self.spacing(t);
        if k == 0 { None } else { self.within([t - spacing, t + spacing], |_| true) }
    }

    /// Those at the ends of the parts of a step, the k-th of the run, without those at its start and at its end.
    fn in_parts(&self, parts: &[SolvedPart], k: usize) -> Vec<Option<TimeJump>> {
        let Some(start) = parts.first().map(|part| part.from.t).filter(|_| !self.problem.system().breaks().is_empty())
        else {
            return parts.iter().map(|_| None).collect();
        };
        let (direction, end) = (self.ahead(1.0), self.steps.problem.t0 + (k + 1) as f64 * self.steps.h);
        let most = direction * end - self.spacing(end);
        let mut reached = start + self.ahead(self.spacing(start));
        let of_end = |part: &SolvedPart| {
            if part.end == PartEnd::Step {
                return None;
            }
            let (from, to) = (reached, part.to.t + self.ahead(self.spacing(part.to.t)));
            if (to - from) * direction <= 0.0 {
                return None;
            }
            reached = to;
            self.within([from, to], |t| t != from && direction * t < most)
        };
        parts.iter().map(of_end).collect()
    }

    /// The time at which the rates at the end of a step are evaluated: before a jump there.
    pub fn before(&self, t: f64) -> f64 {
        self.at_start(t, 1).map_or(t, |jump| jump.first - self.ahead(SIDE_DISTANCE * self.spacing(t)))
    }

    /// The jumps in the parts of a step, the k-th of the run, each with the number of the part after whose end it is passed;
    /// `None` for one at the start, before all parts. Where parts without a length follow, it is passed after them.
    pub fn passed(&self, parts: &[SolvedPart], k: usize) -> Vec<(Option<usize>, TimeJump)> {
        let ends = self.in_parts(parts, k).into_iter().enumerate().map(|(i, jump)| (Some(i), jump));
        let start = parts.first().and_then(|first| self.at_start(first.from.t, k));
        let all = [(None, start)].into_iter().chain(ends).filter_map(|(place, jump)| Some((place, jump?)));
        let delayed = |place: Option<usize>| {
            let next = place.map_or(0, |i| i + 1);
            let at_once = parts.iter().skip(next).take_while(|part| self.is_at_once(part)).count();
            (next + at_once).checked_sub(1)
        };
        all.map(|(place, jump)| (delayed(place), jump)).collect()
    }

    /// Whether a part has the length zero, or one that is round-off: its tangent is that of the rates at its start.
    pub fn is_at_once(&self, part: &SolvedPart) -> bool {
        let longest = self.spacing(part.from.t).max(self.spacing(part.to.t));
        part.step.is_none() || (part.to.t - part.from.t).abs() <= 2.0 * longest
    }

    /// The rates over such a part, on the side of the surfaces through its point on which the motion is: before one that it
    /// passes at its end, otherwise after those that it has passed, or that the change of the state there makes it pass. A
    /// jump in time there is passed after such parts.
    pub fn rates_at_once(&self, part: &SolvedPart) -> Result<Components, StepError> {
        let at = &part.from;
        let direction = match part.end {
            PartEnd::Switch { index, rising, .. } if !self.is_crossed_by_change(at, index, rising) => -1.0,
            _ if self.at_start(at.t, 1).is_some() => return at.rates(self.before(at.t), self.steps),
            _ => 1.0,
        };
        let here = at.rates(at.t, self.steps)?;
        let mut sum = Components::zeros(self.problem.dimension());
        for (weight, times) in WEIGHTS.into_iter().zip([1.0, 2.0, 3.0]) {
            let by = direction * times * SHORTLY * self.steps.h;
            let State { q, p, z } = &at.state;
            let state = State { q: q + &here.x * by, p: p + &here.y * by, z: z + here.z * by };
            let moved = PartPoint { t: at.t + by, state, v: at.v.clone() };
            sum = sum.plus(&moved.rates(moved.t, self.steps)?.scale(weight));
        }
        Ok(sum)
    }

    /// Whether a switching function has the sign that it has after its zero also on the motion shortly before a point at
    /// which the state has changed: a reflection, for example, changes the sign of the velocity.
    fn is_crossed_by_change(&self, at: &PartPoint, index: usize, rising: bool) -> bool {
        let system = self.problem.system();
        let x = if self.problem.is_hamiltonian() { phase_point(&at.state) } else { at.point() };
        let Some(field) = rates_along_motion(system, at.t, &x) else { return false };
        let by = -SHORTLY * self.steps.h;
        let before = Point { q: x.q + field.x * by, v: x.v + field.y * by, z: x.z + field.z * by };
        let mut values = Vec::new();
        system.switching_functions(at.t + by, &before, &mut values);
        values.get(index).is_some_and(|g| if rising { *g > 0.0 } else { *g < 0.0 })
    }

    /// Their derivatives in some parameters at a point of the motion, with the change of the rates where it is wanted.
    pub fn derivatives(
        &self,
        jump: TimeJump,
        at: &PartPoint,
        wanted: &[usize],
        with_change: bool,
    ) -> Result<TimeJumpDerivatives, StepError> {
        let distance = self.ahead(SIDE_DISTANCE * self.spacing(jump.last));
        let rates = |t: f64| at.rates(t, self.steps);
        let after = rates(jump.last + distance)?;
        let change = if with_change { Some(after.clone().minus(&rates(jump.first - distance)?)) } else { None };
        let mut parameters: Vec<Option<OfParameter>> = self.rates.iter().map(|_| None).collect();
        for k in wanted.iter().copied() {
            let Some(rates) = self.distinct(jump, k) else { continue };
            let apart = self.apart((jump, &rates), k, at, &after)?;
            let first = rates.first().copied().unwrap_or(0.0);
            if let Some(of) = parameters.get_mut(k) {
                *of = Some(OfParameter { first, apart });
            }
        }
        Ok(TimeJumpDerivatives { t: jump.first, change, parameters })
    }

    /// The different derivatives of their times in a parameter, in the order in which the motion passes them for a larger
    /// one.
    fn distinct(&self, jump: TimeJump, parameter: usize) -> Option<Vec<f64>> {
        let (from, to) = (jump.first.min(jump.last), jump.first.max(jump.last));
        let all = self.rates.get(parameter)?.as_ref()?.iter();
        let mut rates: Vec<f64> = all.filter(|of| (from..=to).contains(&of.time)).map(|of| of.rate).collect();
        if rates.iter().any(|rate| !rate.is_finite()) {
            return None;
        }
        rates.sort_by(|a, b| if self.is_backward() { b.total_cmp(a) } else { a.total_cmp(b) });
        rates.dedup_by(|a, b| (*a - *b).abs() <= SAME_RATE * a.abs().max(b.abs()));
        Some(rates)
    }

    /// What is added to the tangent if kinks and jumps at one time come apart.
    fn apart(
        &self,
        (jump, rates): (TimeJump, &[f64]),
        parameter: usize,
        at: &PartPoint,
        after: &Components,
    ) -> Result<Option<Components>, StepError> {
        if rates.len() < 2 {
            return Ok(None);
        }
        let theta = self.problem.of.parameters();
        let value = theta.get(parameter).copied().unwrap_or(f64::NAN);
        let fastest = rates.iter().fold(0.0, |m, rate| max_or_nan(m, rate.abs()));
        let change = max_or_nan((APART * self.steps.h).abs() / fastest, LEAST_CHANGE * value.abs());
        let n = self.problem.dimension();
        let mut sum = Components::zeros(n);
        for pair in rates.windows(2) {
            let (middle, apart) = (0.5 * (pair[0] + pair[1]), pair[1] - pair[0]);
            for (weight, times) in WEIGHTS.into_iter().zip([1.0, 2.0, 3.0]) {
                let mut theta = theta.clone();
                let by = times * change;
                if let Some(value) = theta.get_mut(parameter) {
                    *value += by;
                }
                let t = jump.first + middle * by;
                let found = self.problem.of.with_parameters(&theta, &mut |system| rates_of(system, t, at));
                let found = found.filter(|found| found.len() == 2 * n + 1).ok_or(StepError::NonFinite)?;
                let between = Components { x: found[..n].into(), y: found[n..2 * n].into(), z: found[2 * n] };
                sum = sum.plus(&between.minus(after).scale(weight * apart));
            }
        }
        Ok(Some(sum))
    }
}

impl TimeJumpDerivatives {
    /// The derivative of the time along a column.
    ///
    /// # Errors
    /// [`SensitivityError::TimeJump`] where it is not known.
    pub fn time(&self, column: &Column) -> Result<f64, SensitivityError> {
        self.of(column).map(|of| of.map_or(0.0, |of| of.first))
    }

    fn of(&self, column: &Column) -> Result<Option<&OfParameter>, SensitivityError> {
        let Some(parameter) = column.parameter else { return Ok(None) };
        let of = self.parameters.get(parameter).and_then(Option::as_ref);
        of.map(Some).ok_or(SensitivityError::TimeJump { t: self.t, parameter })
    }

    /// Carries a column over the jump, where the time at which it is has the derivative `dt`.
    ///
    /// # Errors
    /// Those of [`time`](Self::time).
    pub fn push(&self, column: &mut Column, dt: f64) -> Result<(), SensitivityError> {
        let of = self.of(column)?;
        let dt = dt - of.map_or(0.0, |of| of.first);
        let change = self.change.as_ref().filter(|_| dt != 0.0).map(|change| change.scale(dt));
        let apart = of.and_then(|of| of.apart.clone());
        for add in [change, apart].into_iter().flatten() {
            column.set_state(column.state().plus(&add));
        }
        Ok(())
    }

    /// Carries a covector back over the jump; returns its derivative in the time at which it is. The derivative in a
    /// parameter is NaN where it is not known.
    pub fn pull(&self, covector: &mut Covector) -> f64 {
        let state = covector.state();
        let of_time = self.change.as_ref().map_or(0.0, |change| state.dot(change));
        for (sum, of) in covector.parameters.iter_mut().zip(&self.parameters) {
            *sum += match of {
                None => f64::NAN,
                Some(of) => of.apart.as_ref().map_or(0.0, |apart| state.dot(apart)) - of_time * of.first,
            };
        }
        of_time
    }

    /// Adds a derivative in the time of the jump to those in the parameters.
    pub fn add_time(&self, covector: &mut Covector, of_time: f64) {
        for (sum, of) in covector.parameters.iter_mut().zip(&self.parameters) {
            *sum += of_time * of.as_ref().map_or(f64::NAN, |of| of.first);
        }
    }
}

/// The times of kinks and jumps with their derivatives in a parameter. Those of a system that does not state them, and has
/// no other values of its parameters, are fixed.
fn rates(problem: &Differentiable<'_>, parameter: usize) -> Option<Vec<BreakRate>> {
    let known = problem.of.break_rates(parameter);
    known.or_else(|| {
        let times = problem.system().breaks();
        let with_rates = |rates: Vec<f64>| {
            times.iter().zip(rates).map(|(time, rate)| BreakRate { time: *time, rate }).collect::<Vec<_>>()
        };
        let theta = problem.of.parameters();
        if problem.of.with_parameters(&theta, &mut |_| Some(Vec::new())).is_none() {
            return Some(with_rates(vec![0.0; times.len()]));
        }
        let mut moved = |system: &dyn System| {
            let moved = system.breaks();
            (moved.len() == times.len()).then(|| moved.to_vec())
        };
        difference_in_parameter(problem, parameter, 1.0, &mut moved).map(with_rates)
    })
}

/// The rates of a state of a system, in the order q, p, z.
fn rates_of(system: &dyn System, t: f64, at: &PartPoint) -> Option<Vec<f64>> {
    let State { p, .. } = &at.state;
    let AtState { x, l, force, rate } = system.at_state(t, &at.state, &at.v).ok()?;
    Some(x.v.iter().chain(&(force + p * rate)).chain([&l]).copied().collect())
}
