//! The sign changes of an event function within a step.

use crate::StepError;
use crate::run::motion::{Motion, NearbyVelocity};
use crate::run::observers::event::{Crossing, Event};
use crate::run::observers::last_step::LastStep;
use crate::run::observers::last_step::TaylorPolynomial;
use crate::run::observers::output_request::RunInfo;
use crate::solve::roots::{bracketed_root, bracketed_root_within};
use contact_geom::PhasePoint;

/// The relative round-off of a time and of a state, from the sums of a step, the iteration that solves it, and the root
/// search.
const RELATIVE_ROUND_OFF: f64 = 16.0 * f64::EPSILON;

/// The value of an event function, relative to its size in the step, below which the function may be on its surface g =
/// 0, or may have different signs on the motion and on the interpolant.
const MAX_NEAR_VALUE: f64 = 0.01;

/// The tolerance of the root of the interpolant between two points, as a fraction of their distance: smaller than the
/// error of the interpolant, so that the first state of the motion is computed as near to the root as it can be.
const ROOT_TOLERANCE: f64 = 1e-9;

/// The distance over which the slope of the interpolant is computed, as a fraction of the distance of the two points.
const SLOPE_DISTANCE: f64 = 1e-3;

/// The smallest distance of two iterates, in units of [`SLOPE_DISTANCE`], whose secant replaces the slope of the
/// interpolant: below it the round-off of the function dominates the secant.
const MIN_SECANT_DISTANCE: f64 = 0.1;

/// The largest distance of two iterates, in units of [`SLOPE_DISTANCE`], that may be due to round-off, if the function
/// does not decrease by more than [`MIN_DECREASE`].
const MAX_ROUND_OFF_DISTANCE: f64 = 0.01;

/// The ratio of two values of the function above which it does not decrease.
const MIN_DECREASE: f64 = 0.25;

/// The assumed number of steps of a run whose number of steps is not known.
const DEFAULT_COUNT: f64 = 64.0;

/// The largest time scale of the round-off of times, in steps: for long runs it stays far below a step.
const MAX_SPAN_IN_STEPS: f64 = 4096.0;

/// The largest number of corrections of a root; after these the root is bracketed on the motion itself.
const MAX_CORRECTIONS: usize = 6;

/// The function of an event at the last point of evaluation.
#[derive(Clone, Copy)]
pub(crate) struct LastSign<const N: usize> {
    pub value: f64,
    /// The last nonzero sign; 0 before the first one.
    pub sign: f64,
    /// The first zero since then.
    pub zero: Option<(f64, PhasePoint<N>)>,
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
enum Change<const N: usize> {
    /// No sign change that counts.
    None,
    /// A sign change at a known point.
    There(f64, PhasePoint<N>),
    /// A sign change between the two points, with these values.
    Between([f64; 2]),
}

/// The settings of the search over the parts of a step.
#[derive(Clone, Copy)]
struct Scan<'s, const N: usize> {
    /// Interpolated states between the parts. States of the motion are used if there are none, or where the function is
    /// smaller than `near`.
    interpolated: Option<&'s [PhasePoint<N>]>,
    parts: usize,
    near: f64,
    /// Where the function leaves its surface after the end of the step, if the end is on it.
    departure: Option<Departure>,
}

/// The time scales of a run, which decide whether a point is on a surface.
#[derive(Clone, Copy)]
pub(crate) struct TimeScales {
    /// The approximate step size, with the sign of the direction of the run.
    h: f64,
    /// The time scale of the round-off of times, in addition to the time itself.
    span: f64,
}

impl TimeScales {
    pub(crate) fn of(RunInfo { t0, t_end, h, count }: &RunInfo) -> Self {
        let span = t_end - t0;
        let h = h.unwrap_or(span / count.map_or(DEFAULT_COUNT, |count| count.max(1) as f64));
        TimeScales { h, span: span.abs().min(MAX_SPAN_IN_STEPS * h.abs()) }
    }

    /// The round-off of a time.
    pub(crate) fn rounding(self, t: f64) -> f64 {
        RELATIVE_ROUND_OFF * (t.abs() + self.span)
    }
}

/// The motion of a run, with its time scales.
#[derive(Clone, Copy)]
pub(crate) struct ScaledMotion<'r, const N: usize> {
    pub motion: &'r dyn Motion<N>,
    pub scales: TimeScales,
    pub near: NearbyVelocity<N>,
}

impl<const N: usize> Event<'_, N> {
    /// Finds the sign changes in a step, given interpolated states in it.
    pub(crate) fn in_step(
        &mut self,
        index: usize,
        (step, motion): (&mut LastStep<'_, N>, ScaledMotion<'_, N>),
        interpolated: &[PhasePoint<N>],
        last_sign: &mut LastSign<N>,
        found: &mut Vec<Crossing<N>>,
    ) -> Result<(), StepError> {
        let ((_, end), parts) = (step.ends(), interpolated.len() + 1);
        let value = self.value(end.0, &end.1);
        let (mut quiet, mut size) = (value * last_sign.sign > 0.0, last_sign.value.abs());
        for (k, x) in (1..parts).zip(interpolated) {
            // Interpolated states may leave the domain of the function although the motion does not.
            let there = self.value(step.time(k as f64 / parts as f64), x);
            quiet &= there * last_sign.sign > 0.0;
            size = size.max(there.abs());
        }
        // The end may be on the surface if the value is below a hundredth of its size in the step.
        let departure = if value.abs() < MAX_NEAR_VALUE * size {
            self.departure_from(motion, (end.0, &end.1), value)
        } else {
            None
        };
        if quiet && last_sign.zero.is_none() && departure.is_none() {
            (last_sign.value, last_sign.departure) = (value, None);
            return Ok(());
        }
        let (before, count) = (*last_sign, found.len());
        let scan = Scan { interpolated: Some(interpolated), parts, near: MAX_NEAR_VALUE * size, departure };
        if !self.scan(index, step, scan, last_sign, found)? {
            (*last_sign, _) = (before, found.truncate(count));
            self.scan(index, step, Scan { interpolated: None, ..scan }, last_sign, found)?;
        }
        last_sign.departure = departure;
        Ok(())
    }

    /// Finds the sign changes between the parts of a step; `false` if the interpolated states show one that the motion
    /// does not have.
    fn scan(
        &mut self,
        index: usize,
        step: &mut LastStep<'_, N>,
        Scan { interpolated, parts, near, departure }: Scan<'_, N>,
        last_sign: &mut LastSign<N>,
        found: &mut Vec<Crossing<N>>,
    ) -> Result<bool, StepError> {
        let (start, end) = step.ends();
        for k in 1..=parts {
            let tau = k as f64 / parts as f64;
            let interpolated_point =
                interpolated.and_then(|interpolated| interpolated.get(k - 1)).map(|x| (step.time(tau), *x));
            let interpolated_point =
                interpolated_point.filter(|(t, x)| (near..=f64::MAX).contains(&self.value(*t, x).abs()));
            let (t, state) = match interpolated_point {
                _ if k == parts => end,
                Some(interpolated_point) => interpolated_point,
                None => (step.time(tau), step.at(step.time(tau))?),
            };
            let value = self.value(t, &state);
            let mut from = (k - 1) as f64 / parts as f64;
            if let Some(Departure { t, value: there }) = last_sign.departure {
                let fraction = (t - start.0) / (end.0 - start.0);
                if fraction >= tau {
                    // The function is still on its surface.
                    continue;
                }
                (from, last_sign.value, last_sign.departure) = (fraction, there, None);
            }
            if !value.is_finite() {
                found.extend(self.before_its_domain_ends(step, [from, tau], last_sign)?.map(|(t, state)| Crossing {
                    t,
                    event: index,
                    state,
                }));
                return Err(StepError::Event { t });
            }
            let side = if k == parts { departure.map_or(value, |departure| departure.value) } else { value };
            match self.between(last_sign, [value, side], (t, &state)) {
                Change::None => {}
                Change::There(t, state) => found.push(Crossing { t, event: index, state }),
                Change::Between(values) => {
                    let root = match interpolated {
                        Some(_) => self.root_by_newton(step, [from, tau])?,
                        None => Some(self.root(step, [from, tau], values)?),
                    };
                    let Some((t, state)) = root else { return Ok(false) };
                    found.push(Crossing { t, event: index, state });
                }
            }
        }
        Ok(true)
    }

    /// The root between two points of a step at which the function has opposite signs, to round-off.
    fn root(
        &mut self,
        step: &LastStep<'_, N>,
        ends: [f64; 2],
        values: [f64; 2],
    ) -> Result<(f64, PhasePoint<N>), StepError> {
        let tau = bracketed_root(ends, values, |tau| self.at(step.time(tau), &step.at(step.time(tau))?))?;
        Ok((step.time(tau), step.at(step.time(tau))?))
    }

    /// The same root by Newton's method, which starts from the root of the interpolant and uses its slope: two states
    /// of the motion are enough if the step resolves the motion. `None` if the iteration does not converge, as when the
    /// function jumps.
    fn root_by_newton(
        &mut self,
        step: &mut LastStep<'_, N>,
        [a, b]: [f64; 2],
    ) -> Result<Option<(f64, PhasePoint<N>)>, StepError> {
        let mut interpolant = |tau: f64| step.interpolate(tau).map(|x| self.value(step.time(tau), &x));
        let ends = [interpolant(a)?, interpolant(b)?];
        // Written so that a NaN is not a sign change.
        let brackets = ends[0] * ends[1] < 0.0;
        if !brackets {
            return Ok(None);
        }
        let mut tau = bracketed_root_within(ROOT_TOLERANCE * (b - a), [a, b], ends, &mut interpolant)?;
        let distance = SLOPE_DISTANCE * (b - a);
        let (lower, upper) = ((tau - distance).max(0.0), (tau + distance).min(1.0));
        let mut slope = (interpolant(upper)? - interpolant(lower)?) / (upper - lower);
        let mut last: Option<(f64, f64, (f64, PhasePoint<N>))> = None;
        for _ in 0..MAX_CORRECTIONS {
            let at = (step.time(tau), step.at(step.time(tau))?);
            let g = self.value(at.0, &at.1);
            if let Some((before, g_before, _)) = last
                && (tau - before).abs() > MIN_SECANT_DISTANCE * distance
            {
                slope = (g - g_before) / (tau - before);
            }
            let change = g / slope;
            // With a slope that overflows any point would pass as a root.
            if !(slope.is_finite() && change.is_finite()) {
                return Ok(None);
            }
            if change.abs() <= 0.5 * RELATIVE_ROUND_OFF {
                return Ok(Some(at));
            }
            if change.abs() <= TaylorPolynomial::<N>::MAX_DISTANCE
                && let Some(found) = self.root_by_taylor(step, (tau, &at.1), slope, change)?
            {
                return Ok(Some(found));
            }
            // This close to two states the motion is linear to round-off, and the line through them replaces another
            // correction.
            if let Some((before, _, (_, from))) = last
                && let gap = tau - before
                && (change * gap).abs() <= f64::EPSILON / 16.0
                && change * change < 0.5 * RELATIVE_ROUND_OFF * gap.abs()
            {
                let part = -change / gap;
                let (q, p) = (at.1.q + (at.1.q - from.q) * part, at.1.p + (at.1.p - from.p) * part);
                let state = PhasePoint { q, p, z: at.1.z + (at.1.z - from.z) * part };
                return Ok(Some((step.time(tau - change), state)));
            }
            // If two iterates differ by round-off only, the one with the smaller value is taken.
            if let Some((_, g_before, before)) = last
                && g.abs() > MIN_DECREASE * g_before.abs()
                && change.abs() <= MAX_ROUND_OFF_DISTANCE * distance
            {
                return Ok(Some(if g.abs() < g_before.abs() { at } else { before }));
            }
            last = Some((tau, g, at));
            tau -= change;
            if !(a - distance..=b + distance).contains(&tau) || !(0.0..=1.0).contains(&tau) {
                return Ok(None);
            }
        }
        Ok(None)
    }

    /// The root near a state of the motion, by the Taylor polynomial about that state, if the correction is so small
    /// that no second state is needed.
    fn root_by_taylor(
        &mut self,
        step: &mut LastStep<'_, N>,
        (tau, state): (f64, &PhasePoint<N>),
        slope: f64,
        mut ahead: f64,
    ) -> Result<Option<(f64, PhasePoint<N>)>, StepError> {
        let Some(polynomial) = step.taylor_polynomial(tau, state)? else { return Ok(None) };
        ahead = -ahead;
        for _ in 0..MAX_CORRECTIONS {
            let (t, there) = (step.time(tau + ahead), polynomial.at(ahead));
            let change = self.value(t, &there) / slope;
            if change.abs() <= 0.5 * RELATIVE_ROUND_OFF {
                return Ok(Some((t, there)));
            }
            ahead -= change;
            // Written so that a NaN is out of range.
            let within =
                ahead.abs() <= 2.0 * TaylorPolynomial::<N>::MAX_DISTANCE && (0.0..=1.0).contains(&(tau + ahead));
            if !within {
                return Ok(None);
            }
        }
        Ok(None)
    }

    /// The sign change that counts between the last point and a point at which the function is not defined, if there is
    /// one.
    fn before_its_domain_ends(
        &mut self,
        step: &LastStep<'_, N>,
        [mut from, mut to]: [f64; 2],
        last_sign: &mut LastSign<N>,
    ) -> Result<Option<(f64, PhasePoint<N>)>, StepError> {
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
                Change::None if value * before >= 0.0 => from = tau,
                Change::None => return Ok(None),
                Change::There(t, state) => return Ok(Some((t, state))),
                Change::Between(values) => return self.root(step, [from, tau], values).map(Some),
            }
        }
    }

    /// The sign change that counts between the last point and the next one, if there is one. `value` is the value of
    /// the function at the next point, and `side` has the sign that the function takes there.
    fn between(
        &mut self,
        last_sign: &mut LastSign<N>,
        [value, side]: [f64; 2],
        (t, state): (f64, &PhasePoint<N>),
    ) -> Change<N> {
        let before = std::mem::replace(&mut last_sign.value, value);
        if side == 0.0 {
            last_sign.zero = last_sign.zero.or(Some((t, *state)));
            return Change::None;
        }
        let (old, zero) = (std::mem::replace(&mut last_sign.sign, side.signum()), last_sign.zero.take());
        if !self.counts(old, side) {
            return Change::None;
        }
        match zero {
            Some((t, state)) => Change::There(t, state),
            // The point is on the surface, and the function is about to leave it.
            None if value * before >= 0.0 => Change::There(t, *state),
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
        ScaledMotion { motion, scales, near }: ScaledMotion<'_, N>,
        (t, state): (f64, &PhasePoint<N>),
        g: f64,
    ) -> Option<Departure> {
        let (rounding, state_rounding) = (scales.rounding(t), self.rounding(t, state, g));
        let shortest = (f64::powi(2.0, -20) * scales.h.abs()).max(64.0 * rounding);
        for ahead in (0..5).map(|k| shortest * f64::powi(16.0, k)).take_while(|ahead| *ahead <= 0.5 * scales.h.abs()) {
            let Some(departure) = self.after((motion, near), (t, state), ahead.copysign(scales.h)) else { continue };
            let window = state_rounding + (departure.value - g).abs() * (rounding / ahead);
            let on = g.abs() <= window
                // The function may jump across its surface.
                || g * departure.value < 0.0
                    && self.after((motion, near), (t, state), rounding.copysign(scales.h)).is_some_and(|x| g * x.value < 0.0);
            if !on {
                return None;
            }
            if departure.value.abs() > 2.0 * window {
                return Some(departure);
            }
        }
        None
    }

    /// The function on the motion at a time after a point; `None` if the motion or the function is not defined there.
    fn after(
        &mut self,
        (motion, near): (&dyn Motion<N>, NearbyVelocity<N>),
        (t, state): (f64, &PhasePoint<N>),
        ahead: f64,
    ) -> Option<Departure> {
        let there = t + ahead;
        let (x, _) = motion.state_within_step(&(t, *state), there, near, None).ok()?;
        let value = self.value(there, &x);
        value.is_finite().then_some(Departure { t: there, value })
    }

    /// The effect of the round-off of a state on the function, with q, p and z each rounded relative to its own size.
    /// Perturbations for which the function is not defined contribute nothing.
    fn rounding(&mut self, t: f64, state: &PhasePoint<N>, g: f64) -> f64 {
        let [q, p, z] = [state.q.amax(), state.p.amax(), state.z.abs()].map(|size| RELATIVE_ROUND_OFF * size);
        let mut change =
            |x: PhasePoint<N>| Some((self.value(t, &x) - g).abs()).filter(|d| d.is_finite()).unwrap_or(0.0);
        let mut sum = change(PhasePoint { z: state.z + z, ..*state });
        for i in 0..N {
            let mut distance = *state;
            distance.q[i] += q;
            sum += change(distance);
            distance = *state;
            distance.p[i] += p;
            sum += change(distance);
        }
        sum
    }
}
