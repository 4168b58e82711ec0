//! The sign changes of an event function within a step.

use crate::integration::PieceStart;
use crate::integration::motion::{Motion, NearbyVelocity};
use crate::run::observers::event::{Crossing, Event};
use crate::run::observers::event_roots::RELATIVE_ROUND_OFF;
use crate::run::observers::last_step::LastStep;
use crate::run::observers::output_request::RunInfo;
use crate::solve::chebyshev::{Chebyshev, Samples, node};
use crate::solve::sign_changes::opposite_signs;
use crate::solve::sign_changes::{Scale, Separation, Separator, has_no_zero, resolves, separate};
use crate::{State, StepError};

/// The value of an event function, relative to its size in the step, below which the function may be on its surface g =
/// 0, or may have different signs on the motion and on the interpolant.
const MAX_NEAR_VALUE: f64 = 0.01;

/// The assumed number of steps of a run whose number of steps is not known.
const DEFAULT_COUNT: f64 = 64.0;

/// The time scale of the round-off of times, in steps. It does not depend on the length of the run: of two consecutive
/// runs with the same steps, both decide alike whether the point between them is on a surface, so that its crossing is
/// counted in exactly one. For steps of a thousandth of the time scale of the motion the round-off of positions still is
/// that of times of half this scale.
const ROUND_OFF_IN_STEPS: f64 = 512.0;

/// The function of an event at the last point of evaluation.
#[derive(Clone)]
pub(crate) struct LastSign {
    pub value: f64,
    /// The last nonzero sign; 0 before the first one.
    pub sign: f64,
    /// The first zero since then.
    pub zero: Option<(f64, State)>,
    /// The later point at which the function has this sign, if the last point itself is on the surface.
    pub departure: Option<Departure>,
}

/// A point at which a function that starts on its surface has left it: the time, and the value there.
#[derive(Clone, Copy)]
pub(crate) struct Departure {
    pub t: f64,
    pub value: f64,
}

/// A sign change from one point to the next.
enum Change {
    /// No sign change that counts.
    None,
    /// A sign change at a known point.
    There(f64, State),
    /// A sign change between the two points, with these values.
    Between([f64; 2]),
}

/// The settings of the search along a step.
#[derive(Clone, Copy)]
struct Scan<'s> {
    /// The points that separate the sign changes.
    points: &'s [Separator],
    separation: Separation,
    /// Whether states of the motion are used at all points, or only where the function is smaller than `near`.
    on_motion: bool,
    near: f64,
    /// Where the function leaves its surface after the end of the step, if the end is on it.
    departure: Option<Departure>,
    /// The function along the interpolated step as a polynomial, if one resolves it.
    curve: Option<&'s Chebyshev>,
}

/// The time scales of a run, which decide whether a point is on a surface.
#[derive(Clone, Copy)]
pub(crate) struct TimeScales {
    /// The approximate step size, with the sign of the direction of the run.
    h: f64,
}

impl TimeScales {
    pub(crate) fn of(RunInfo { t0, t_end, h, count, .. }: &RunInfo) -> Self {
        let span = t_end - t0;
        TimeScales { h: h.unwrap_or(span / count.map_or(DEFAULT_COUNT, |count| count.max(1) as f64)) }
    }

    /// The round-off of a time.
    pub(crate) fn rounding(self, t: f64) -> f64 {
        RELATIVE_ROUND_OFF * (t.abs() + ROUND_OFF_IN_STEPS * self.h.abs())
    }
}

/// The motion of a run, with its time scales.
#[derive(Clone, Copy)]
pub(crate) struct ScaledMotion<'r> {
    pub motion: &'r dyn Motion,
    pub scales: TimeScales,
    pub near: NearbyVelocity<'r>,
}

impl Event<'_> {
    /// Finds the sign changes in a step, given interpolated states at its nodes. `points` is a workspace.
    pub(crate) fn in_step(
        &mut self,
        index: usize,
        (step, motion): (&mut LastStep<'_>, ScaledMotion<'_>),
        (interpolated, points): (&[State], &mut Vec<Separator>),
        last_sign: &mut LastSign,
        found: &mut Vec<Crossing>,
    ) -> Result<(), StepError> {
        let ((start, end), degree) = (step.ends(), interpolated.len() + 1);
        let value = self.value(end.0, &end.1);
        if last_sign.departure.is_some_and(|departure| (departure.t - end.0) * (end.0 - start.0) > 0.0) {
            // The function leaves its surface after this piece of a step.
            last_sign.value = value;
            return Ok(());
        }
        let mut samples = Samples::new(degree, |j| match interpolated.get(j.wrapping_sub(1)) {
            Some(x) => self.value(step.time(node(degree, j)), x),
            None if j == 0 => last_sign.value,
            None => value,
        });
        let size = samples.size();
        let near = MAX_NEAR_VALUE * size;
        // The end may be on the surface if the value is below a hundredth of its size in the step.
        let departure = match step.next() {
            _ if value.abs() >= near => None,
            Some((PieceStart::Reset, _)) => self.departure_without_reset(motion, end, value),
            Some((_, next)) => {
                let value = self.value(next.0, &next.1);
                self.departure_from(motion, next, value)
            }
            None => self.departure_from(motion, end, value),
        };
        // On the surface, the sign of the value is that of its round-off: a change to it does not count.
        let at_end = if departure.is_some() { 0.0 } else { value };
        samples.set_end(at_end);
        let keeps_sign = value * last_sign.sign > 0.0 && last_sign.zero.is_none() && departure.is_none();
        if keeps_sign && has_no_zero(&samples, near) {
            (last_sign.value, last_sign.departure) = (value, None);
            return Ok(());
        }
        let noise = self.noise((start.0, &start.1), last_sign.value).min(self.noise((end.0, &end.1), value));
        let scale = Scale { size, near, noise: noise + RELATIVE_ROUND_OFF * size };
        // Interpolated states may leave the domain of the function although the motion does not.
        let mut on_motion = !samples.is_finite();
        let separation = loop {
            if on_motion {
                samples = Samples::new(degree, |j| match j {
                    0 => last_sign.value,
                    _ if j == degree => at_end,
                    _ => self.on_motion(step, node(degree, j)),
                });
            }
            let along = |fraction: f64| match on_motion {
                _ if fraction == 1.0 => at_end,
                true => self.on_motion(step, fraction),
                false => self.on_interpolant(step, fraction).unwrap_or(f64::NAN),
            };
            match separate(&samples, scale, along, points) {
                Separation::Undefined if !on_motion => on_motion = true,
                separation => break separation,
            }
        };
        if keeps_sign && separation == Separation::Complete && points.is_empty() {
            (last_sign.value, last_sign.departure) = (value, None);
            return Ok(());
        }
        let (before, count) = (last_sign.clone(), found.len());
        let curve = samples.interpolant();
        let curve = (!on_motion && resolves(&curve, scale)).then_some(&curve);
        let scan = Scan { points, separation, on_motion, near, departure, curve };
        if !self.scan(index, step, scan, last_sign, found)? {
            *last_sign = before;
            found.truncate(count);
            self.scan(index, step, Scan { on_motion: true, curve: None, ..scan }, last_sign, found)?;
        }
        last_sign.departure = departure;
        Ok(())
    }

    /// The sign change at a point where the state jumps, to a value of the function there, if it counts.
    pub(crate) fn at_jump(
        &mut self,
        index: usize,
        last_sign: &mut LastSign,
        value: f64,
        (t, state): &(f64, State),
    ) -> Option<Crossing> {
        if last_sign.departure.is_some() {
            // It is on its surface, which it leaves to a known side.
            last_sign.value = value;
            return None;
        }
        match self.between(last_sign, [value, value], (*t, state)) {
            Change::None => None,
            Change::There(t, state) => Some(Crossing { t, event: index, state }),
            Change::Between(_) => Some(Crossing { t: *t, event: index, state: state.clone() }),
        }
    }

    /// Finds the sign changes between the points of a step; `false` if the interpolated states show one that the motion
    /// does not have.
    fn scan(
        &mut self,
        index: usize,
        step: &mut LastStep<'_>,
        Scan { points, separation, on_motion, near, departure, curve }: Scan<'_>,
        last_sign: &mut LastSign,
        found: &mut Vec<Crossing>,
    ) -> Result<bool, StepError> {
        let (start, end) = step.span();
        let unresolved = match separation {
            Separation::Unresolved(from) => Some(StepError::EventUnresolved { t: step.time(from) }),
            _ => None,
        };
        let mut from = 0.0;
        let at_end = unresolved.is_none().then_some((1.0, false));
        for (tau, is_touch) in points.iter().map(|point| (point.fraction, point.is_touch)).chain(at_end) {
            let is_end = tau == 1.0;
            let interpolated = match is_end || on_motion {
                true => None,
                false => Some((step.time(tau), step.interpolate(tau)?)),
            };
            let interpolated = interpolated.filter(|(t, x)| (near..=f64::MAX).contains(&self.value(*t, x).abs()));
            let (t, state) = match interpolated {
                _ if is_end => step.ends().1.clone(),
                Some(interpolated) => interpolated,
                None => (step.time(tau), step.at(step.time(tau))?),
            };
            let value = self.value(t, &state);
            if is_touch && value.abs() <= self.rounding(t, &state, value) {
                // It touches zero up to round-off.
                continue;
            }
            if let Some(Departure { t, value: there }) = last_sign.departure {
                let fraction = (t - start) / (end - start);
                if fraction >= tau {
                    // The function is still on its surface.
                    continue;
                }
                (from, last_sign.value, last_sign.departure) = (fraction, there, None);
            }
            let ends = [std::mem::replace(&mut from, tau), tau];
            if !value.is_finite() {
                let before = self.before_its_domain_ends(step, ends, last_sign)?;
                found.extend(before.map(|(t, state)| Crossing { t, event: index, state }));
                return Err(StepError::Event { t });
            }
            let side = if is_end { departure.map_or(value, |departure| departure.value) } else { value };
            match self.between(last_sign, [value, side], (t, &state)) {
                Change::None => {}
                Change::There(t, state) => found.push(Crossing { t, event: index, state }),
                Change::Between(values) => {
                    let root = match on_motion {
                        false => self.root_by_newton(step, ends, curve)?,
                        true => Some(self.root(step, ends, values)?),
                    };
                    let Some((t, state)) = root else { return Ok(false) };
                    found.push(Crossing { t, event: index, state });
                }
            }
        }
        unresolved.map_or(Ok(true), Err)
    }

    /// The value on the motion at a fraction of a step; NaN where the motion is not defined.
    fn on_motion(&mut self, step: &LastStep<'_>, fraction: f64) -> f64 {
        let t = step.time(fraction);
        step.at(t).map_or(f64::NAN, |x| self.value(t, &x))
    }

    /// The sign change that counts between the last point and a point at which the function is not defined, if there is
    /// one.
    fn before_its_domain_ends(
        &mut self,
        step: &LastStep<'_>,
        [mut from, mut to]: [f64; 2],
        last_sign: &mut LastSign,
    ) -> Result<Option<(f64, State)>, StepError> {
        let before = last_sign.sign;
        loop {
            let tau = 0.5 * (from + to);
            if tau <= from || tau >= to {
                return Ok(None);
            }
            let (t, state) = (step.time(tau), step.at(step.time(tau))?);
            let value = self.value(t, &state);
            if !value.is_finite() {
                to = tau;
                continue;
            }
            match self.between(last_sign, [value, value], (t, &state)) {
                Change::None if !opposite_signs(value, before) => from = tau,
                Change::None => return Ok(None),
                Change::There(t, state) => return Ok(Some((t, state))),
                Change::Between(values) => return self.root(step, [from, tau], values).map(Some),
            }
        }
    }

    /// The sign change that counts between the last point and the next one, if there is one. `value` is the value of
    /// the function at the next point, and `side` has the sign that the function takes there.
    fn between(&mut self, last_sign: &mut LastSign, [value, side]: [f64; 2], (t, state): (f64, &State)) -> Change {
        let before = std::mem::replace(&mut last_sign.value, value);
        if side == 0.0 {
            last_sign.zero.get_or_insert_with(|| (t, state.clone()));
            return Change::None;
        }
        let (old, zero) = (std::mem::replace(&mut last_sign.sign, side.signum()), last_sign.zero.take());
        if !self.counts(old, side) {
            return Change::None;
        }
        match zero {
            Some((t, state)) => Change::There(t, state),
            // The point is on the surface, and the function is about to leave it.
            None if !opposite_signs(value, before) => Change::There(t, state.clone()),
            None => Change::Between([before, value]),
        }
    }

    /// Where the function leaves its surface after a point that is on it up to round-off; `None` if the point is not on
    /// the surface, or if the function does not leave it within half a step.
    ///
    /// With g the value of the function, the point is on the surface if `|g|` is at most the change of g along the
    /// motion over the round-off of the time, plus the effect of the round-off of the state. The function has left the
    /// surface when its value exceeds twice this bound, so that its sign is not due to round-off.
    pub(crate) fn departure_from(
        &mut self,
        motion: ScaledMotion<'_>,
        from: &(f64, State),
        g: f64,
    ) -> Option<Departure> {
        self.departure_along(motion.scales, from, g, |there| {
            motion.motion.state_within_step(from, there, motion.near, None).ok().map(|(x, _)| x)
        })
    }

    /// Where the function would leave its surface after a point at which a reset follows: along the line of the motion
    /// that arrives there, so that an event on the surface of an impact is a sign change.
    fn departure_without_reset(
        &mut self,
        ScaledMotion { motion, scales, near }: ScaledMotion<'_>,
        from: &(f64, State),
        g: f64,
    ) -> Option<Departure> {
        let (t, state) = from;
        let rates = motion.rates(*t, state, near).ok()?;
        self.departure_along(scales, from, g, |there| {
            let ahead = there - t;
            Some(State { q: &state.q + &rates.q * ahead, p: &state.p + &rates.p * ahead, z: state.z + rates.z * ahead })
        })
    }

    /// The same along a curve of states after the point.
    fn departure_along(
        &mut self,
        scales: TimeScales,
        from: &(f64, State),
        g: f64,
        curve: impl Fn(f64) -> Option<State>,
    ) -> Option<Departure> {
        let (t, state) = (from.0, &from.1);
        let (rounding, state_rounding) = (scales.rounding(t), self.rounding(t, state, g));
        let shortest = (f64::powi(2.0, -20) * scales.h.abs()).max(64.0 * rounding);
        for ahead in (0..5).map(|k| shortest * f64::powi(16.0, k)).take_while(|ahead| *ahead <= 0.5 * scales.h.abs()) {
            let Some(departure) = self.after(&curve, t + ahead.copysign(scales.h)) else { continue };
            let window = state_rounding + (departure.value - g).abs() * (rounding / ahead);
            let on = g.abs() <= window
                // The function may jump across its surface.
                || opposite_signs(g, departure.value)
                    && self.after(&curve, t + rounding.copysign(scales.h)).is_some_and(|x| opposite_signs(g, x.value));
            if !on {
                return None;
            }
            if departure.value.abs() > 2.0 * window {
                return Some(departure);
            }
        }
        None
    }

    /// The function on a curve at a time; `None` if the curve or the function is not defined there.
    fn after(&mut self, curve: &impl Fn(f64) -> Option<State>, there: f64) -> Option<Departure> {
        let value = self.value(there, &curve(there)?);
        value.is_finite().then_some(Departure { t: there, value })
    }

    /// The effect of the round-off of the time and of the coordinates on the function, each rounded relative to itself.
    fn noise(&mut self, (t, state): (f64, &State), g: f64) -> f64 {
        let factor = 1.0 + RELATIVE_ROUND_OFF;
        let mut change =
            |t: f64, x: &State| Some((self.value(t, x) - g).abs()).filter(|d| d.is_finite()).unwrap_or(0.0);
        let mut rounded = state.clone();
        rounded.z *= factor;
        let mut sum = change(t * factor, state) + change(t, &rounded);
        rounded.z = state.z;
        for i in 0..state.q.len() {
            rounded.q[i] *= factor;
            sum += change(t, &rounded);
            rounded.q[i] = state.q[i];
            rounded.p[i] *= factor;
            sum += change(t, &rounded);
            rounded.p[i] = state.p[i];
        }
        sum
    }

    /// The effect of the round-off of a state on the function, with q, p and z each rounded relative to its own size.
    /// Perturbations for which the function is not defined contribute nothing.
    fn rounding(&mut self, t: f64, state: &State, g: f64) -> f64 {
        let [q, p, z] = [state.q.amax(), state.p.amax(), state.z.abs()].map(|size| RELATIVE_ROUND_OFF * size);
        let mut change = |x: &State| Some((self.value(t, x) - g).abs()).filter(|d| d.is_finite()).unwrap_or(0.0);
        let mut moved = state.clone();
        moved.z += z;
        let mut sum = change(&moved);
        moved.z = state.z;
        for i in 0..state.q.len() {
            moved.q[i] += q;
            sum += change(&moved);
            moved.q[i] = state.q[i];
            moved.p[i] += p;
            sum += change(&moved);
            moved.p[i] = state.p[i];
        }
        sum
    }
}
