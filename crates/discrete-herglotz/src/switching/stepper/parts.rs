//! The parts of a step that end on the zeros of switching functions, or whose defect is within a bound.

use crate::StepError;
use crate::gauss::StepStart;
use crate::solve::roots::bracketed_root;
use crate::switching::corner::{Corner, corner};
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::as_stepper::AsStepper;
use crate::switching::surfaces::{SignChange, StepCurve, TimedState};
use crate::{InputError, Problem, theory::legendre_inverse};
use contact_geom::{
    Lagrangian, PhasePoint,
    numbers::{max_abs_or_nan, max_or_nan},
};

/// The largest number of parts of a step; a step with more fails with [`StepError::Switching`] or
/// [`StepError::Undivided`]. Each costs as much as a step, so that a failure takes a second at most.
const MAX_PARTS: usize = 4096;

/// The largest number of sign changes at one point, more than there are surfaces through a corner: a motion that is
/// pushed to a surface from both sides has infinitely many.
const MAX_CHANGES_AT_ONE_POINT: usize = 16;

/// The largest number of Newton iterations for a zero before it is bracketed: they converge quadratically from a zero
/// of the curve of the step.
const MAX_NEWTON_ITERATIONS: usize = 8;

/// A part of a step.
struct Part<S, const N: usize> {
    stepper: Option<S>,
    to: TimedState<N>,
}

impl<'a, L, S, M, const N: usize> SwitchingStepper<'a, L, S, M, N>
where
    L: Lagrangian<N>,
    S: AsStepper<N>,
    M: Fn(&Problem<'a, L, N>, f64, bool) -> Result<S, InputError>,
{
    /// One part of a step, from a state to the time t.
    fn part(&mut self, at: &TimedState<N>, t: f64) -> Result<(S, TimedState<N>), StepError> {
        let mut stepper = self.stepper_at(at, t - at.t, true)?;
        let taken = stepper.stepper_mut().advance(1).map_err(|failure| failure.cause);
        self.spent += stepper.stepper().evaluations();
        taken?;
        let to = self.reached(&stepper, t, at)?;
        Ok((stepper, to))
    }

    /// A step in parts that end on zeros.
    pub(super) fn in_parts(&mut self, from: TimedState<N>, t_end: f64) -> Result<(TimedState<N>, f64), StepError> {
        let (mut at, mut sigma, mut changes_at_point) = (from, 1.0, 0);
        let span = t_end - from.t;
        let spacing = 4.0 * f64::EPSILON * max_or_nan(max_or_nan(from.t.abs(), t_end.abs()), span.abs());
        let (mut longest, mut too_long, mut switches) = (span.abs(), false, false);
        for _ in 0..MAX_PARTS {
            let rest = t_end - at.t;
            if rest * span <= 0.0 {
                return Ok((at, sigma));
            }
            let t = if rest.abs() <= longest { t_end } else { at.t + longest.copysign(span) };
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
            let curve = StepCurve { from: at, to, dense: stepper.stepper().dense() };
            let change = self.surfaces.first_change(self.problem.lagrangian, &curve);
            too_long = change.is_none() && self.is_too_long(&stepper);
            if too_long {
                longest = 0.5 * (t - at.t).abs();
                continue;
            }
            let Some(change) = change else {
                sigma *= stepper.stepper().sigma();
                self.keep(stepper);
                (at, longest, changes_at_point) = (to, max_or_nan(2.0 * longest, f64::MIN_POSITIVE).min(span.abs()), 0);
                continue;
            };
            let Some(Part { stepper, to }) = self.locate(&curve, &change, spacing) else {
                // The curve crosses the surface, but the motion does not; the curve of a shorter part is more accurate.
                longest = 0.5 * (t - at.t).abs();
                continue;
            };
            match stepper {
                Some(stepper) if self.is_too_long(&stepper) => {
                    too_long = true;
                    longest = 0.5 * (to.t - at.t).abs();
                    continue;
                }
                Some(stepper) => {
                    sigma *= stepper.stepper().sigma();
                    self.keep(stepper);
                    changes_at_point = 0;
                }
                None => changes_at_point += 1,
            }
            if changes_at_point > MAX_CHANGES_AT_ONE_POINT {
                return Err(StepError::Switching { t: at.t });
            }
            at = self.through(to, change.index, span)?;
            (longest, switches) = (span.abs(), true);
        }
        let divides = self.max_defect < f64::INFINITY && !switches;
        Err(if divides { StepError::Undivided { t: at.t } } else { StepError::Switching { t: at.t } })
    }

    fn keep(&mut self, stepper: S) {
        if let Some(parts) = &mut self.parts {
            parts.push(stepper);
        }
    }

    /// The state at a zero, on the side where the motion continues.
    fn through(&mut self, at: TimedState<N>, index: usize, span: f64) -> Result<TimedState<N>, StepError> {
        let max_displacement = max_abs_or_nan(at.v.iter().map(|v| v * span));
        let lagrangian = self.problem.lagrangian;
        let p = match corner(lagrangian, &mut self.surfaces, index, &at, max_displacement)? {
            Corner::Continuous => {
                self.surfaces.cross(index);
                return Ok(at);
            }
            Corner::Refracted(p) => {
                self.surfaces.cross(index);
                p
            }
            Corner::Reflected(p) => p,
        };
        let state = PhasePoint { p, ..at.state };
        let v = legendre_inverse(lagrangian, at.t, &state, &at.v)?.v;
        Ok(TimedState { state, v, rests: StepStart { y: [0.0; N], ..at.rests }, ..at })
    }

    /// The part that ends on a zero, to within `spacing` in time; it has no stepper where the zero is the start itself.
    /// `None` where the motion does not cross the surface.
    fn locate(&mut self, curve: &StepCurve<N>, change: &SignChange, spacing: f64) -> Option<Part<S, N>> {
        let SignChange { index, ends, estimate, slope } = *change;
        let (lagrangian, from, span) = (self.problem.lagrangian, curve.from, curve.span());
        let at_start = Part { stepper: None, to: from };
        let mut slope = slope;
        let mut length = estimate * span;
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..MAX_NEWTON_ITERATIONS {
            if length.abs() <= spacing {
                return Some(at_start);
            }
            let (stepper, to) = self.part(&from, from.t + length).ok()?;
            let value = self.surfaces.value(lagrangian, index, (to.t, &to.point()));
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
            let (_, to) = self.part(&from, from.t + fraction * span)?;
            Ok(side * self.surfaces.value(lagrangian, index, (to.t, &to.point())))
        };
        let [before, after] = [toward(ends[0]).ok()?, toward(ends[1]).ok()?];
        if before.is_nan() || after.is_nan() || before <= 0.0 || after >= 0.0 {
            return None;
        }
        let root = bracketed_root(ends, [before, after], toward).ok()?;
        if root * span.abs() <= spacing {
            return Some(at_start);
        }
        let (stepper, to) = self.part(&from, from.t + root * span).ok()?;
        Some(Part { stepper: Some(stepper), to })
    }
}
