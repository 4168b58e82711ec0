//! The switching functions of a Lagrangian along a step.

use crate::solve::chebyshev::{Samples, node};
use crate::solve::roots::bracketed_root;
use crate::solve::sign_changes::{Scale, Separation, has_no_zero, separate};
use crate::switching::departure::{DEPARTURE, Departure};
use crate::switching::local_motion::rates_along_motion;
use crate::switching::step_curve::{StepCurve, TimedState};
use crate::system::AtSwitch;
use crate::{InputError, Point, StepError, System, Vector};
use std::convert::Infallible;

/// The round-off of a switching function, relative to its size on a step: that of the sums of the curve.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

/// The largest number of halvings of the part after a zero, in the search for a point where the function still has its
/// old sign: down to the round-off of the time.
const MAX_HALVINGS: i32 = 52;

/// The distance over which the slope of a function at its zero is computed, as a fraction of the interval in which the
/// zero lies: an error of 1e-8, by the central difference, is enough for Newton's method.
const SLOPE_DISTANCE: f64 = 1e-4;

/// The relative round-off of the numbers of a point: the sums of a step and the root search.
const POINT_ROUND_OFF: f64 = 16.0 * f64::EPSILON;

/// The number of changes of a function, over [`DEPARTURE`] and by round-off, beyond which it is far from zero.
const FAR: f64 = 64.0;

/// Whether a Lagrangian has switching functions or breaks.
///
/// # Errors
/// [`InputError::SwitchingUnstated`] where it has some that its `HINTS` do not state.
pub(crate) fn has_switching_functions(system: &dyn System, t: f64, x: &Point) -> Result<bool, InputError> {
    let mut values = Vec::new();
    system.switching_functions(t, x, &mut values);
    match values.is_empty() && system.breaks().is_empty() {
        true => Ok(false),
        false if system.hints().switching_functions => Ok(true),
        false => Err(InputError::SwitchingUnstated),
    }
}

/// Whether the state is replaced where a function crosses zero in this direction.
fn has_reset(system: &dyn System, index: usize, (t, x): (f64, &Point), rising: bool) -> bool {
    matches!(system.at_switch(index, t, x, rising), AtSwitch::Replace { .. })
}

/// A sign change on the curve of a step: the index of the function, the fractions of the step between which it lies,
/// and the approximate fraction `estimate`.
#[derive(Clone, Copy, Debug)]
pub(super) struct SignChange {
    pub index: usize,
    pub ends: [f64; 2],
    pub estimate: f64,
    /// The time derivative of the function there.
    pub slope: f64,
}

/// The switching functions of a Lagrangian, with the side of each surface on which the motion is.
#[derive(Clone, Debug)]
pub(super) struct Surfaces {
    /// The signs of the functions; 0 for one that has only been zero so far.
    pub sides: Vec<f64>,
    values: Vec<f64>,
}

impl Surfaces {
    /// The sides of a point from which a motion starts with a time step h. A function that is zero up to round-off has
    /// the sign that it takes next along the motion; if the motion has a reset there, in the direction of this change, it
    /// has the other sign, so that the reset is the first thing that happens.
    pub fn at(system: &dyn System, t: f64, x: &Point, h: f64) -> Self {
        let mut values = Vec::new();
        system.switching_functions(t, x, &mut values);
        let sides = values.iter().map(|g| sign(*g)).collect();
        let mut surfaces = Surfaces { sides, values };
        surfaces.leave(system, t, x, h);
        surfaces
    }

    /// The sides after a reset from one point to another at the surface `index`, which the motion leaves to a given side.
    /// The motion stays on its side of every other surface on which the reset leaves it.
    pub fn reset(
        &mut self,
        system: &dyn System,
        (index, departure): (usize, Option<f64>),
        t: f64,
        [from, to]: [&Point; 2],
        h: f64,
    ) {
        let old = self.clone();
        *self = Surfaces::at(system, t, to, h);
        for i in 0..self.sides.len() {
            let side = if i == index { departure } else { None };
            let stays =
                i != index && old.side(i) != 0.0 && [from, to].into_iter().all(|x| self.is_on(system, i, (t, x), h));
            if let Some(of) = self.sides.get_mut(i) {
                *of = side.unwrap_or(if stays { old.side(i) } else { *of });
            }
        }
    }

    /// The round-off of a function at a point that is reached by steps of length h: its change when each number of the
    /// point, and the time along the motion, change by their round-off.
    pub fn rounding(&mut self, system: &dyn System, index: usize, (t, x): (f64, &Point), h: f64) -> f64 {
        let (here, n) = (self.value(system, index, (t, x)), x.q.len());
        let mut change = |t: f64, x: &Point| {
            let there = self.value(system, index, (t, x));
            if there.is_finite() { (there - here).abs() } else { 0.0 }
        };
        let rates = rates_along_motion(system, t, x);
        let acceleration = rates.as_ref().map_or_else(|| Vector::zeros(n), |rates| rates.y.clone());
        let velocity = rates.map_or_else(|| x.v.clone(), |rates| rates.x);
        let dt = POINT_ROUND_OFF * t.abs().max(h.abs());
        let v = POINT_ROUND_OFF * x.v.amax().max((&acceleration * h).amax());
        let q = POINT_ROUND_OFF * x.q.amax().max((&velocity * h).amax());
        let mut moved = Point { z: x.z * (1.0 + POINT_ROUND_OFF), ..x.clone() };
        let mut sum =
            change(t + dt, &Point { q: &x.q + velocity * dt, v: &x.v + acceleration * dt, z: x.z }) + change(t, &moved);
        moved.z = x.z;
        for i in 0..n {
            moved.q[i] = x.q[i] + q;
            sum += change(t, &moved);
            moved.q[i] = x.q[i];
            moved.v[i] = x.v[i] + v;
            sum += change(t, &moved);
            moved.v[i] = x.v[i];
        }
        sum
    }

    /// Gives each function that is zero up to round-off the sign that it takes next along the motion. Two evaluations of
    /// all functions show which of them are far from zero; the others are examined one by one.
    fn leave(&mut self, system: &dyn System, t: f64, x: &Point, h: f64) {
        if self.sides.is_empty() {
            return;
        }
        let here = self.values.clone();
        let dt = DEPARTURE * h;
        let grown = 1.0 + POINT_ROUND_OFF;
        let velocity =
            if system.hints().hamiltonian { rates_along_motion(system, t, x).map(|rates| rates.x) } else { None };
        let points = [
            (t + dt, Point { q: &x.q + velocity.as_ref().unwrap_or(&x.v) * dt, ..x.clone() }),
            (t, Point { q: &x.q * grown, v: &x.v * grown, z: x.z * grown }),
        ];
        let mut changes = vec![0.0; here.len()];
        for (t, x) in points {
            self.values.clear();
            system.switching_functions(t, &x, &mut self.values);
            for ((change, before), after) in changes.iter_mut().zip(&here).zip(&self.values) {
                *change += (after - before).abs();
            }
        }
        for (index, (value, change)) in here.iter().zip(changes).enumerate() {
            // Written so that a NaN is examined.
            if value.abs() > FAR * change {
                continue;
            }
            let tolerance = self.rounding(system, index, (t, x), h);
            let Some(Departure { side, .. }) = self.departure(system, index, (t, x), h, tolerance) else { continue };
            let AtSwitch::Replace { to, .. } = system.at_switch(index, t, x, side > 0.0) else {
                self.set_side(index, side);
                continue;
            };
            // A run that ended here has made the reset only if its end was beyond the surface by more than the round-off
            // of its own numbers; a reset that turns the motion back it has not made, since the motion goes on.
            let turns_back = |after: Departure| after.side * side < 0.0;
            let resets = side * value < 0.0
                || self.is_on_without_motion(system, index, (t, x))
                || self.departure(system, index, (t, &to), h, tolerance).is_some_and(turns_back);
            self.set_side(index, if resets { -side } else { side });
        }
    }

    /// Whether a point is on a surface up to the round-off of its own numbers, whatever step it is reached by or the
    /// motion goes on with: so a step leaves a reset at its end to the next one exactly if a motion that starts there
    /// has the reset at its start.
    pub fn is_on_without_motion(&mut self, system: &dyn System, index: usize, at: (f64, &Point)) -> bool {
        self.is_on(system, index, at, 0.0)
    }

    /// Whether a point is on a surface up to round-off.
    pub fn is_on(&mut self, system: &dyn System, index: usize, (t, x): (f64, &Point), h: f64) -> bool {
        let rounding = self.rounding(system, index, (t, x), h);
        self.value(system, index, (t, x)).abs() <= rounding
    }

    /// The other surfaces that the curve of a step crosses at the same point, which is the zero of one function. They
    /// are crossed together: crossing one alone may lead to a region that no motion enters.
    pub fn simultaneous(
        &mut self,
        system: &dyn System,
        curve: &StepCurve,
        change: &SignChange,
        at: &TimedState,
        h: f64,
    ) -> Vec<usize> {
        // Where the function of the zero has its new sign.
        let (t, end) = curve.at(change.ends[1]);
        let others = (0..self.sides.len()).filter(|i| *i != change.index);
        let changed = |surfaces: &mut Self, i: usize| {
            let beyond = -surfaces.side(i) * surfaces.value(system, i, (t, &end));
            beyond > 0.0 && beyond > surfaces.rounding(system, i, (t, &end), 0.0)
        };
        others.filter(|i| changed(self, *i) && self.is_on(system, *i, (at.t, &at.argument(system)), h)).collect()
    }

    /// The value of a function; NaN for an index without a function.
    pub fn value(&mut self, system: &dyn System, index: usize, (t, x): (f64, &Point)) -> f64 {
        self.values.clear();
        system.switching_functions(t, x, &mut self.values);
        self.values.get(index).copied().unwrap_or(f64::NAN)
    }

    pub fn side(&self, index: usize) -> f64 {
        self.sides.get(index).copied().unwrap_or(0.0)
    }

    fn set_side(&mut self, index: usize, side: f64) {
        if let Some(of) = self.sides.get_mut(index) {
            *of = side;
        }
    }

    /// Sets the motion on the other side of a surface.
    pub fn cross(&mut self, index: usize) {
        if let Some(side) = self.sides.get_mut(index) {
            *side = -*side;
        }
    }

    /// Whether a surface lies within the fraction `extension` of a step before its start or after its end, where the
    /// curve is extrapolated. An integrator that evaluates L there, or at the ends, may evaluate it on the other side.
    pub fn are_near(&mut self, system: &dyn System, curve: &StepCurve, extension: f64) -> bool {
        [-extension, 1.0 + extension].into_iter().any(|fraction| {
            let x = curve.between_ends(fraction);
            self.values.clear();
            system.switching_functions(curve.from.t + fraction * curve.span(), &x, &mut self.values);
            // A surface on which the motion starts counts as near.
            self.sides.iter().zip(&self.values).any(|(side, value)| *side == 0.0 || side * sign(*value) < 0.0)
        })
    }

    /// The first sign change along the curve of a step. A function without a side takes the sign of its first nonzero
    /// value.
    ///
    /// # Errors
    /// [`StepError::Event`] where the function of a reset is not defined on the curve, before any sign change.
    pub fn first_change(&mut self, system: &dyn System, curve: &StepCurve) -> Result<Option<SignChange>, StepError> {
        self.first_change_before(system, curve, None)
    }

    /// The first sign change along the curve of a part that ends on zeros: these are not among them.
    ///
    /// # Errors
    /// Those of [`first_change`](Self::first_change).
    pub fn earlier_change(
        &mut self,
        system: &dyn System,
        curve: &StepCurve,
        h: f64,
    ) -> Result<Option<SignChange>, StepError> {
        self.first_change_before(system, curve, Some(h))
    }

    /// With the length of a step, the surfaces on which the curve ends do not count at its end.
    fn first_change_before(
        &mut self,
        system: &dyn System,
        curve: &StepCurve,
        ends_on_zeros: Option<f64>,
    ) -> Result<Option<SignChange>, StepError> {
        let (count, degree) = (self.sides.len(), curve.sampling_degree());
        if count == 0 {
            return Ok(None);
        }
        self.values.clear();
        for j in 0..=degree {
            let (t, x) = curve.at(node(degree, j));
            system.switching_functions(t, &x, &mut self.values);
        }
        // The functions are evaluated anew below, and the values of this step are kept.
        let values = std::mem::take(&mut self.values);
        let samples_of =
            |index: usize| Samples::new(degree, |j| values.get(j * count + index).copied().unwrap_or(f64::NAN));
        let (mut first, mut without_side) = (None::<SignChange>, Vec::new());
        let mut undefined: Option<f64> = None;
        for index in 0..count {
            let mut samples = samples_of(index);
            let (side, end) = (self.side(index), sign(samples.ends()[1]));
            if side * end > 0.0 && has_no_zero(&samples, 0.0) {
                continue;
            }
            if side * samples.ends()[0] < 0.0 {
                // The motion starts on the surface, beyond it by round-off.
                samples.set_start(0.0);
            }
            if let Some(h) = ends_on_zeros
                && self.is_on(system, index, (curve.to.t, &curve.to.argument(system)), h)
            {
                samples.set_end(0.0);
            }
            if let Some(j) = samples.values().iter().position(|value| value.is_nan())
                && [true, false]
                    .into_iter()
                    .any(|rising| has_reset(system, index, (curve.from.t, &curve.from.argument(system)), rising))
            {
                let from = node(degree, j.saturating_sub(1));
                undefined = Some(undefined.map_or(from, |other| other.min(from)));
            }
            let (place, ends) = self.change_of_side(system, curve, index, &samples);
            if let Some((own, from)) = place {
                if side == 0.0 {
                    without_side.push((index, from));
                }
                if let Some(slot) = self.sides.get_mut(index) {
                    *slot = own;
                }
            }
            let ends = ends.filter(|_| !self.is_left_to_next(system, curve, index, &samples));
            let change = ends.map(|ends| self.change(system, curve, index, ends));
            first = [first, change].into_iter().flatten().min_by(|a, b| a.estimate.total_cmp(&b.estimate));
        }
        self.values = values;
        if let Some(change) = first {
            // A side that is taken only after the first sign change, the motion may never reach.
            for (index, _) in without_side.into_iter().filter(|(_, from)| *from > change.estimate) {
                if let Some(slot) = self.sides.get_mut(index) {
                    *slot = 0.0;
                }
            }
        }
        match undefined {
            Some(from) if first.is_none_or(|change| change.ends[0] >= from) => {
                Err(StepError::Event { t: curve.from.t + from * curve.span() })
            }
            _ => Ok(first),
        }
    }

    /// Whether the function of a reset goes beyond its surface only up to the round-off of the end of a curve. Then the
    /// motion is on the surface, and the reset is left to what follows: the next part or step, or the run that continues
    /// this one.
    fn is_left_to_next(&mut self, system: &dyn System, curve: &StepCurve, index: usize, samples: &Samples) -> bool {
        let (side, to) = (self.side(index), (curve.to.t, &curve.to.argument(system)));
        let rounding = self.rounding(system, index, to, 0.0);
        // Written so that a NaN is beyond. A curve with both ends off the surface may go beyond it between the samples.
        let within = samples.values().iter().all(|value| side * value >= -rounding);
        let starts_or_ends_on = samples.ends().iter().any(|value| value.abs() <= rounding);
        within && starts_or_ends_on && has_reset(system, index, to, side < 0.0)
    }

    /// The side of a function with the fraction of the step from which it has one, and the fractions between which it
    /// first changes.
    fn change_of_side(
        &mut self,
        system: &dyn System,
        curve: &StepCurve,
        index: usize,
        samples: &Samples,
    ) -> (Option<(f64, f64)>, Option<[f64; 2]>) {
        let size = samples.size();
        let (mut points, scale) = (Vec::new(), Scale { size, near: 0.0, noise: ROUND_OFF * size });
        let along = |fraction: f64| {
            if fraction == 1.0 {
                return samples.ends()[1];
            }
            let (t, x) = curve.at(fraction);
            self.value(system, index, (t, &x))
        };
        let reached = match separate(samples, scale, along, &mut points) {
            Separation::Complete => 1.0,
            Separation::Unresolved(fraction) => fraction,
            Separation::Undefined => points.last().map_or(0.0, |point| point.fraction),
        };
        // Beyond, or if there is nothing to separate, the values at the nodes decide.
        let nodes = (1..samples.degree()).map(|j| (node(samples.degree(), j), j)).filter(|(x, _)| *x > reached);
        let nodes = nodes.map(|(x, j)| (x, samples.values()[j])).chain([(1.0, samples.ends()[1])]);
        let (mut side, mut from, mut since) = (self.side(index), 0.0, 0.0);
        for (fraction, value) in points.iter().map(|point| (point.fraction, point.value)).chain(nodes) {
            if side == 0.0 {
                (side, since) = (sign(value), fraction);
            }
            if side * sign(value) < 0.0 {
                return (Some((side, since)), Some([from, fraction]));
            }
            from = fraction;
        }
        ((side != 0.0).then_some((side, since)), None)
    }

    /// The zero of a function between two fractions of a step, where the second one is on the other side.
    pub(super) fn change(
        &mut self,
        system: &dyn System,
        curve: &StepCurve,
        index: usize,
        [mut from, to]: [f64; 2],
    ) -> SignChange {
        let side = self.side(index);
        let toward = |surfaces: &mut Self, fraction: f64| {
            let (t, x) = curve.at(fraction);
            side * surfaces.value(system, index, (t, &x))
        };
        let (mut before, after) = (toward(self, from), toward(self, to));
        if before.is_nan() || before <= 0.0 {
            // The part begins at a zero: find a point where the function still has the sign of its side, and not by
            // round-off.
            let (t, x) = curve.at(from);
            let rounding = self.rounding(system, index, (t, &x), 0.0);
            let inside = (1..=MAX_HALVINGS).map(|k| from + (to - from) * f64::powi(2.0, -k));
            match inside.map(|x| (x, toward(self, x))).find(|(_, value)| *value > rounding) {
                Some(place) => (from, before) = place,
                None => return SignChange { index, ends: [from, to], estimate: from, slope: 0.0 },
            }
        }
        let found = bracketed_root([from, to], [before, after], |x| Ok::<_, Infallible>(toward(self, x)));
        let estimate = found.unwrap_or(from);
        let distance = SLOPE_DISTANCE * (to - from);
        let [left, right] = [estimate - distance, estimate + distance].map(|fraction| curve.rounded(fraction));
        let slope = (toward(self, right) - toward(self, left)) / ((right - left) * curve.span());
        SignChange { index, ends: [from, to], estimate, slope: side * slope }
    }
}

/// The sign of a number as 1 or -1, and 0 for 0 and NaN.
pub(super) fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}
