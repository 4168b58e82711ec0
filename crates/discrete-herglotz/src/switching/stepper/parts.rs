//! The parts of a step that end on the zeros of switching functions, or whose defect is within a bound.

use crate::integration::{PartEnd, Piece, PieceStart, SolvedStages};
use crate::solve::roots::bracketed_root;
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::part_stepper::PartStepper;
use crate::switching::stepper::passage::Passed;
use crate::switching::stepper::solved_parts::EndOfPart;
use crate::switching::{
    step_curve::{StepCurve, TimedState},
    surfaces::SignChange,
};
use crate::{DenseStep, StepError};
use contact_geom::numbers::max_or_nan;

/// The largest number of parts of a step; a step with more fails with [`StepError::Switching`] or
/// [`StepError::Undivided`]. Each costs as much as a step, so that a failure takes a second at most.
const MAX_PARTS: usize = 4096;

/// The largest number of sign changes at one point, more than there are surfaces through a corner: a motion that is
/// pushed to a surface from both sides has infinitely many.
const MAX_CHANGES_AT_ONE_POINT: usize = 16;

/// The largest number of resets at one corner of a surface: as many as a wedge of one degree has, of which each turns a
/// motion by two.
const MAX_PASSAGES_OF_CORNER: usize = 180;

/// The length of the first part after a reset, in units of the time since the reset before it at the same surface:
/// longer than the flights of a bouncing motion, which decrease or stay the same.
const FLIGHTS_PER_PART: f64 = 4.0;

/// The largest number of Newton iterations for a zero before it is bracketed: they converge quadratically from a zero
/// of the curve of the step.
const MAX_NEWTON_ITERATIONS: usize = 8;

/// The largest number of zeros that are located one before the other; then the part is halved.
const MAX_EARLIER_ZEROS: usize = 16;

/// A distance in time that is round-off, near a time in steps of length h.
pub(crate) fn time_spacing(t: f64, h: f64) -> f64 {
    4.0 * f64::EPSILON * max_or_nan(t.abs(), h.abs())
}

/// The part that ends on the first zero.
struct Located<'a> {
    part: Part<'a>,
    /// The curve on which the zero was found, and its sign change there.
    curve: StepCurve,
    change: SignChange,
    /// The dense output of the part.
    dense: Option<DenseStep>,
}

/// A part of a step.
struct Part<'a> {
    stepper: Option<PartStepper<'a>>,
    to: TimedState,
}

impl<'a> SwitchingStepper<'a> {
    /// One part of a step, from a state to the time t.
    fn part(&mut self, at: &TimedState, t: f64) -> Result<(PartStepper<'a>, TimedState), StepError> {
        let mut stepper = self.stepper_at(at, t - at.t, true)?;
        let taken = stepper.stepper_mut().advance(1).map_err(|failure| failure.cause);
        self.spent += stepper.stepper().evaluations();
        taken?;
        let to = self.reached(&stepper, t, at)?;
        Ok((stepper, to))
    }

    /// A step in parts that end on zeros.
    pub(super) fn in_parts(&mut self, from: &TimedState, t_end: f64) -> Result<(TimedState, f64), StepError> {
        let (mut at, mut sigma, mut changes_at_point) = (from.clone(), 1.0, 0);
        let span = t_end - from.t;
        let spacing = 4.0 * f64::EPSILON * max_or_nan(max_or_nan(from.t.abs(), t_end.abs()), span.abs());
        let (mut longest, mut too_long, mut switches) = (span.abs(), false, false);
        let mut start = PieceStart::Regular;
        for _ in 0..MAX_PARTS {
            if (t_end - at.t) * span <= 0.0 {
                // The state after the end of the last part is that of the next step.
                if start > PieceStart::Zero {
                    self.add_piece([&at, &at], [sigma; 2], None, start);
                }
                return Ok((at, sigma));
            }
            let until = self.next_end(at.t, t_end);
            let plain_end = |t: f64| match t {
                _ if t != until => PartEnd::Division { fraction: (t - from.t) / span },
                _ if until == t_end => PartEnd::Step,
                _ => PartEnd::Break,
            };
            let t = if (until - at.t).abs() <= longest { until } else { at.t + longest.copysign(span) };
            if longest <= spacing {
                return Err(if too_long { StepError::Undivided { t: at.t } } else { StepError::Switching { t: at.t } });
            }
            let (stepper, to) = match self.part(&at, t) {
                Ok(part) => part,
                Err(cause) if (t - at.t).abs() <= 2.0 * spacing => return Err(cause),
                Err(_) => {
                    longest = 0.5 * (t - at.t).abs();
                    continue;
                }
            };
            let system = self.problem.system.clone();
            let curve = StepCurve::new(&*system, [at.clone(), to], stepper.stepper().dense());
            let change = match self.surfaces.first_change(&*system, &curve) {
                Ok(change) => change,
                Err(cause) if (t - at.t).abs() <= 2.0 * spacing => return Err(cause),
                Err(_) => {
                    longest = 0.5 * (t - at.t).abs();
                    continue;
                }
            };
            too_long = change.is_none() && self.is_too_long(&stepper);
            if too_long {
                longest = 0.5 * (t - at.t).abs();
                continue;
            }
            let Some(change) = change else {
                let before = sigma;
                sigma *= stepper.stepper().sigma();
                let stages = self.keep(stepper);
                let StepCurve { to, dense, .. } = curve;
                let started = std::mem::replace(&mut start, PieceStart::Regular);
                self.add_piece([&at, &to], [before, sigma], dense, started);
                let (next, end) = (to.clone(), plain_end(t));
                self.ends.push(EndOfPart { from: at, to: to.clone(), next, has_stepper: true, stages, end });
                (at, longest, changes_at_point) = (to, max_or_nan(2.0 * longest, f64::MIN_POSITIVE).min(span.abs()), 0);
                continue;
            };
            let Some(Located { part: Part { stepper, to }, curve, change, dense }) =
                self.first_zero(curve, change, spacing)
            else {
                // The curve crosses the surface, but the motion does not; the curve of a shorter part is more accurate.
                longest = 0.5 * (t - at.t).abs();
                continue;
            };
            let (mut has_stepper, mut stages) = (stepper.is_some(), None);
            match stepper {
                Some(stepper) if self.is_too_long(&stepper) => {
                    too_long = true;
                    longest = 0.5 * (to.t - at.t).abs();
                    continue;
                }
                Some(stepper) => {
                    let before = sigma;
                    sigma *= stepper.stepper().sigma();
                    let started = std::mem::replace(&mut start, PieceStart::Zero);
                    self.add_piece([&at, &to], [before, sigma], dense, started);
                    stages = self.keep(stepper);
                    changes_at_point = 0;
                }
                None => changes_at_point += 1,
            }
            if changes_at_point > MAX_CHANGES_AT_ONE_POINT {
                return Err(StepError::Switching { t: at.t });
            }
            let together = self.surfaces.simultaneous(&*system, &curve, &change, &to, self.h);
            let mut from_there = std::mem::replace(&mut at, to);
            for index in std::iter::once(change.index).chain(together) {
                // A reset may have moved the motion away from another surface.
                let there = at.argument(&*system);
                if index != change.index && !self.surfaces.is_on(&*system, index, (at.t, &there), self.h) {
                    continue;
                }
                let mut at_corner = false;
                for passages in 1.. {
                    let rising = self.surfaces.side(index) < 0.0;
                    let passed = self.through(at.clone(), index, span, spacing, at_corner)?;
                    let Passed { to: next, factor, passage, enters_corner } = passed;
                    let end = PartEnd::Switch { index, rising, passage };
                    // Further passages at the same point are ends of parts of length zero.
                    let (has_stepper, stages) = (std::mem::take(&mut has_stepper), stages.take());
                    let (from, to, after) = (from_there, at.clone(), next.clone());
                    self.ends.push(EndOfPart { from, to, next: after, has_stepper, stages, end });
                    start = start.max(passage.into());
                    (at, from_there, sigma) = (next.clone(), next, sigma * factor);
                    if !enters_corner {
                        break;
                    }
                    if passages == MAX_PASSAGES_OF_CORNER {
                        return Err(StepError::Contact { t: at.t });
                    }
                    at_corner = true;
                }
            }
            // The curve of a part that is much longer than the next flight would round it away.
            longest = span.abs().min(FLIGHTS_PER_PART * self.accumulation.last_interval());
            switches = true;
        }
        let divides = self.max_defect < f64::INFINITY && !switches;
        Err(if divides { StepError::Undivided { t: at.t } } else { StepError::Switching { t: at.t } })
    }

    /// The part that ends on the first zero. Beyond a kink or a jump the curve is not that of the motion, and before it
    /// neither, as far as it is one polynomial: the curve of the part up to a zero may have an earlier one. `None` where
    /// the motion does not cross the surface.
    fn first_zero(&mut self, mut curve: StepCurve, mut change: SignChange, spacing: f64) -> Option<Located<'a>> {
        let system = self.problem.system.clone();
        for _ in 0..MAX_EARLIER_ZEROS {
            let part = self.locate(&curve, &change, spacing)?;
            let Some(stepper) = &part.stepper else { return Some(Located { part, curve, change, dense: None }) };
            let dense = stepper.stepper().dense();
            let shorter = StepCurve::new(&*system, [curve.from.clone(), part.to.clone()], dense);
            match self.surfaces.earlier_change(&*system, &shorter, self.h) {
                Ok(None) => return Some(Located { part, curve, change, dense: shorter.dense }),
                Ok(Some(earlier)) => (curve, change) = (shorter, earlier),
                Err(_) => return None,
            }
        }
        None
    }

    /// Keeps the stepper of a part, if such are kept; otherwise returns its stages, if these are.
    fn keep(&mut self, stepper: PartStepper<'a>) -> Option<SolvedStages> {
        match &mut self.parts {
            Some(parts) => {
                parts.push(stepper);
                None
            }
            None if self.keeps_stages => stepper.stepper().solved_stages(),
            None => None,
        }
    }

    /// Adds a part, which may have the length zero, to the pieces of the step: its ends, the conformal factors from the start
    /// of the step to them, its dense output, and what happens at its start.
    fn add_piece(&mut self, ends: [&TimedState; 2], sigma: [f64; 2], dense: Option<DenseStep>, start: PieceStart) {
        let [from, to] = ends.map(|at| (at.t, at.state.clone()));
        self.pieces.push(Piece { from, to, log_factors: sigma.map(f64::ln), dense, start });
    }

    /// The part that ends on a zero, to within `spacing` in time; it has no stepper where the zero is the start itself.
    /// `None` where the motion does not cross the surface.
    fn locate(&mut self, curve: &StepCurve, change: &SignChange, spacing: f64) -> Option<Part<'a>> {
        let SignChange { index, ends, estimate, slope } = *change;
        let (system, from, span) = (self.problem.system.clone(), &curve.from, curve.span());
        let at_start = || Part { stepper: None, to: from.clone() };
        let mut slope = slope;
        let mut length = estimate * span;
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..MAX_NEWTON_ITERATIONS {
            if length.abs() <= spacing {
                return Some(at_start());
            }
            let (stepper, to) = self.part(from, from.t + length).ok()?;
            let value = self.surfaces.value(&*system, index, (to.t, &to.argument(&*system)));
            if let Some((l, g)) = last
                && l != length
                && (value - g) / (length - l) * slope > 0.0
            {
                slope = (value - g) / (length - l);
            }
            let change = value / slope;
            if !change.is_finite() {
                break;
            }
            if change.abs() <= spacing {
                return Some(Part { stepper: Some(stepper), to });
            }
            last = Some((length, value));
            length -= change;
            if length * span < 0.0 || length.abs() > 1.5 * ends[1] * span.abs() {
                break;
            }
        }
        // The zero is bracketed between two times at which the function has different signs along the motion itself.
        let side = self.surfaces.side(index);
        let mut toward = |fraction: f64| -> Result<f64, StepError> {
            if fraction * span.abs() <= spacing {
                return Ok(f64::MIN_POSITIVE);
            }
            let (_, to) = self.part(from, from.t + fraction * span)?;
            Ok(side * self.surfaces.value(&*system, index, (to.t, &to.argument(&*system))))
        };
        let [before, after] = [toward(ends[0]).ok()?, toward(ends[1]).ok()?];
        if before.is_nan() || after.is_nan() || before <= 0.0 || after >= 0.0 {
            return None;
        }
        let root = bracketed_root(ends, [before, after], toward).ok()?;
        if root * span.abs() <= spacing {
            return Some(at_start());
        }
        let (stepper, to) = self.part(from, from.t + root * span).ok()?;
        Some(Part { stepper: Some(stepper), to })
    }
}
