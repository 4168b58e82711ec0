//! The roots of an event function within a step.

use crate::run::observers::event::Event;
use crate::run::observers::last_step::{LastStep, TaylorPolynomial};
use crate::solve::chebyshev::Chebyshev;
use crate::solve::roots::{bracketed_root, bracketed_root_within};
use crate::solve::sign_changes::opposite_signs;
use crate::{State, StepError};

/// The relative round-off of a time and of a state, from the sums of a step, the iteration that solves it, and the root
/// search.
pub(super) const RELATIVE_ROUND_OFF: f64 = 16.0 * f64::EPSILON;

/// The largest distance of two points, as a fraction of the step, that is the scale of the search for a root between
/// them: a function may vary over less than a whole step.
const MAX_ROOT_SCALE: f64 = 0.1;

/// The tolerance of the root of the interpolant between two points, as a fraction of this scale: smaller than the
/// error of the interpolant, so that the first state of the motion is computed as near to the root as it can be.
const ROOT_TOLERANCE: f64 = 1e-9;

/// The distance over which the slope of the interpolant is computed, as a fraction of the same scale.
const SLOPE_DISTANCE: f64 = 1e-3;

/// The smallest distance of two iterates, in units of [`SLOPE_DISTANCE`], whose secant replaces the slope of the
/// interpolant: below it the round-off of the function dominates the secant.
const MIN_SECANT_DISTANCE: f64 = 0.1;

/// The largest distance of two iterates, in units of [`SLOPE_DISTANCE`], that may be due to round-off, if the function
/// does not decrease by more than [`MIN_DECREASE`].
const MAX_ROUND_OFF_DISTANCE: f64 = 0.01;

/// The ratio of two values of the function above which it does not decrease.
const MIN_DECREASE: f64 = 0.25;

/// The largest number of corrections of a root; after these the root is bracketed on the motion itself.
const MAX_CORRECTIONS: usize = 6;

impl Event<'_> {
    /// The value on the interpolant at a fraction of a step.
    pub(super) fn on_interpolant(&mut self, step: &mut LastStep<'_>, fraction: f64) -> Result<f64, StepError> {
        step.interpolate(fraction).map(|x| self.value(step.time(fraction), &x))
    }

    /// The root between two points of a step at which the function has opposite signs, to round-off.
    pub(super) fn root(
        &mut self,
        step: &LastStep<'_>,
        ends: [f64; 2],
        values: [f64; 2],
    ) -> Result<(f64, State), StepError> {
        let tau = bracketed_root(ends, values, |tau| self.at(step.time(tau), &step.at(step.time(tau))?))?;
        Ok((step.time(tau), step.at(step.time(tau))?))
    }

    /// The same root by Newton's method, which starts from the root of the interpolant, or of the polynomial of the function
    /// along it, and uses its slope: two states of the motion are enough if the step resolves the motion. `None` if the
    /// iteration does not converge, as when the function jumps.
    pub(super) fn root_by_newton(
        &mut self,
        step: &mut LastStep<'_>,
        [a, b]: [f64; 2],
        curve: Option<&Chebyshev>,
    ) -> Result<Option<(f64, State)>, StepError> {
        let mut interpolant = |tau: f64| match curve {
            Some(curve) => Ok(curve.at(tau)),
            None => self.on_interpolant(step, tau),
        };
        let ends = [interpolant(a)?, interpolant(b)?];
        // Written so that a NaN is not a sign change.
        let brackets = opposite_signs(ends[0], ends[1]);
        if !brackets {
            return Ok(None);
        }
        let width = (b - a).min(MAX_ROOT_SCALE);
        let mut tau = bracketed_root_within(ROOT_TOLERANCE * width, [a, b], ends, &mut interpolant)?;
        let distance = SLOPE_DISTANCE * width;
        let (lower, upper) = ((tau - distance).max(0.0), (tau + distance).min(1.0));
        let mut slope = (interpolant(upper)? - interpolant(lower)?) / (upper - lower);
        let mut last: Option<(f64, f64, (f64, State))> = None;
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
            if change.abs() <= TaylorPolynomial::MAX_DISTANCE
                && !step.is_resolved()
                && let Some(found) = self.root_by_taylor(step, (tau, &at.1), slope, change)?
            {
                return Ok(Some(found));
            }
            // This close to two states the motion is linear to round-off, and the line through them replaces another
            // correction.
            if let Some((before, _, (_, from))) = &last
                && let gap = tau - before
                && (change * gap).abs() <= f64::EPSILON / 16.0
                && change * change < 0.5 * RELATIVE_ROUND_OFF * gap.abs()
            {
                let part = -change / gap;
                let state = State {
                    q: &at.1.q + (&at.1.q - &from.q) * part,
                    p: &at.1.p + (&at.1.p - &from.p) * part,
                    z: at.1.z + (at.1.z - from.z) * part,
                };
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
            // Beyond the two points another root may be near.
            if !(a - RELATIVE_ROUND_OFF..=b + RELATIVE_ROUND_OFF).contains(&tau) || !(0.0..=1.0).contains(&tau) {
                return Ok(None);
            }
        }
        Ok(None)
    }

    /// The root near a state of the motion, by the Taylor polynomial about that state, if the correction is so small
    /// that no second state is needed.
    fn root_by_taylor(
        &mut self,
        step: &mut LastStep<'_>,
        (tau, state): (f64, &State),
        slope: f64,
        mut ahead: f64,
    ) -> Result<Option<(f64, State)>, StepError> {
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
            let within = ahead.abs() <= 2.0 * TaylorPolynomial::MAX_DISTANCE && (0.0..=1.0).contains(&(tau + ahead));
            if !within {
                return Ok(None);
            }
        }
        Ok(None)
    }
}
