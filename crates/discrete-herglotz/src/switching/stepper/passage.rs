//! What happens to a motion at the zero of a switching function.

use crate::gauss::StepStart;
use crate::integration::{Passage, Reset, state_at};
use crate::switching::corner::{Corner, corner};
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::accumulation::{Accumulation, Resolution};
use crate::switching::{departure::Departure, step_curve::TimedState};
use crate::system::AtSwitch;
use crate::{Point, State, StepError, System, Vector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};

/// The state after a zero, on the side where the motion continues, with the conformal factor of the passage.
pub(super) struct Passed {
    pub to: TimedState,
    pub factor: f64,
    pub passage: Passage,
    /// Whether the motion goes on through the part of the surface beyond a corner, so that the law of the reset applies
    /// there at the same instant.
    pub enters_corner: bool,
}

/// The time for which a motion that is pushed onto a surface is followed beyond it, as a fraction of a step.
const PUSHED_TIME: f64 = 1e-3;

/// The relative change of the energy above which it is none by round-off.
const MAX_ENERGY_CHANGE: f64 = 1e-12;

/// The energy `v . L_v - L` at a point, and the size of its terms.
fn energy(system: &dyn System, t: f64, x: &Point) -> (f64, f64) {
    let (product, l) = (x.v.dot(&system.gradient(t, x).y), system.value(t, x));
    (product - l, product.abs() + l.abs())
}

impl SwitchingStepper<'_> {
    /// Whether a reset holds a motion back that is pushed onto its surface: the motion that arrives a little later, with a
    /// velocity, does not go on through the surface after the reset. A kick, which changes something else, does not.
    fn holds_back(&mut self, index: usize, (t, x): (f64, &Point)) -> bool {
        let (system, side) = (self.problem.system.clone(), self.surfaces.side(index));
        let Ok((field, _)) = system.rates(t, x) else { return true };
        let dt = PUSHED_TIME * self.h;
        let later =
            Point { q: &x.q + (&x.v + &field.y * (0.5 * dt)) * dt, v: &x.v + &field.y * dt, z: x.z + field.z * dt };
        let AtSwitch::Replace { to, .. } = system.at_switch(index, t + dt, &later, side < 0.0) else { return true };
        let after = self.surfaces.departure(&*system, index, (t + dt, &to), self.h, f64::INFINITY);
        after.is_none_or(|after| !after.with_rate || after.side * side >= 0.0 || after.is_turned(side))
    }

    /// The reset at a point of a surface, if it has one; with the normal of the part of the surface through which the motion
    /// goes, if it is known that the point is a corner.
    fn law(&mut self, at: &TimedState, index: usize, at_corner: bool) -> AtSwitch {
        let (system, x) = (self.problem.system.clone(), at.argument(&*self.problem.system));
        let rising = self.surfaces.side(index) < 0.0;
        let beyond = if at_corner { self.surfaces.beyond(&*system, index, (at.t, &x), self.h) } else { None };
        let Some((t, Point { q: beyond, .. })) = beyond else { return system.at_switch(index, at.t, &x, rising) };
        let mut control = system.at_switch(index, t, &Point { q: beyond.clone(), ..x.clone() }, rising);
        if let AtSwitch::Replace { to, .. } = &mut control {
            for ((to, beyond), here) in to.q.iter_mut().zip(&beyond).zip(&x.q) {
                if *to == *beyond {
                    *to = *here;
                }
            }
        }
        control
    }

    /// The passage of a zero; `at_corner` is whether it follows another one of the same function at a corner of its surface.
    pub(super) fn through(
        &mut self,
        at: TimedState,
        index: usize,
        span: f64,
        spacing: f64,
        at_corner: bool,
    ) -> Result<Passed, StepError> {
        let max_displacement = max_abs_or_nan(at.v.iter().map(|v| v * span));
        let system = self.problem.system.clone();
        if let AtSwitch::Replace { to, factor } = self.law(&at, index, at_corner) {
            return self.reset(at, index, (to, factor), spacing, at_corner);
        }
        let (p, passage) = match corner(&*system, &mut self.surfaces, index, &at, max_displacement)? {
            Corner::Continuous => {
                self.surfaces.cross(index);
                return Ok(Passed { to: at, factor: 1.0, passage: Passage::Continuous, enters_corner: false });
            }
            Corner::Refracted(p) => {
                self.surfaces.cross(index);
                (p, Passage::Refraction)
            }
            Corner::Reflected(p) => (p, Passage::Reflection),
        };
        let state = State { p, ..at.state };
        let v = system.legendre_inverse(at.t, &state, &at.v)?.v;
        let rests = StepStart { y: Vector::zeros(v.len()), ..at.rests };
        let to = TimedState { t: at.t, state, v, rests };
        Ok(Passed { to, factor: 1.0, passage, enters_corner: false })
    }

    /// The state after a reset.
    fn reset(
        &mut self,
        at: TimedState,
        index: usize,
        (mut to, factor): (Point, Option<f64>),
        spacing: f64,
        mut at_corner: bool,
    ) -> Result<Passed, StepError> {
        let (system, side, mut t) = (self.problem.system.clone(), self.surfaces.side(index), at.t);
        let from = at.point();
        let tolerance = self.surfaces.rounding(&*system, index, (t, &from), self.h);
        let is_pushed = |departure: Option<Departure>| {
            departure.is_some_and(|Departure { side: next, with_rate, .. }| !with_rate && next * side < 0.0)
        };
        let mut has_rate = || {
            let arrival = self.surfaces.departure(&*system, index, (t, &from), self.h, tolerance);
            arrival.is_some_and(|arrival| arrival.with_rate)
        };
        if to.v.iter().any(|v| !v.is_finite()) && !has_rate() {
            // A law of impact has no state for a motion that arrives without velocity: nothing changes.
            to = from.clone();
        }
        let mut departure = self.surfaces.departure(&*system, index, (t, &to), self.h, tolerance);
        let goes_beyond = |of: Departure| of.with_rate && of.side * side < 0.0;
        // At a corner, the law for the part of the surface that the motion meets. A kick goes on through a corner as it came.
        let mut meets_corner = || match departure {
            Some(departure) if goes_beyond(departure) && !departure.is_turned(side) => {
                let arrival = self.surfaces.departure(&*system, index, (t, &from), self.h, tolerance);
                arrival.is_some_and(|arrival| arrival.is_turned(side))
            }
            _ => departure.is_some_and(|departure| departure.at_corner),
        };
        if !at_corner
            && meets_corner()
            && let AtSwitch::Replace { to: by_part, .. } = self.law(&at, index, true)
        {
            (to, at_corner) = (by_part, true);
            departure = self.surfaces.departure(&*system, index, (t, &to), self.h, tolerance);
        }
        let enters_corner = at_corner && departure.is_some_and(goes_beyond);
        let rate = departure.map_or(0.0, |departure| departure.rate);
        let resolution = Resolution { h: self.h, spacing, rate, rounding: tolerance };
        // Several resets at a corner, and a short flight beside it before a long one, are no flights that decrease.
        let limit = if enters_corner { None } else { self.accumulation.add(index, t, &resolution) };
        let mut limit = limit.filter(|limit| !self.surfaces.flies_longer(&*system, index, (t, &to), self.h, limit - t));
        // A state that is stopped on the surface and pushed through it is the limit of impacts too.
        let is_limit = limit.is_some();
        if is_pushed(departure) && self.holds_back(index, (t, &to)) {
            limit = Some(t);
        }
        let mut stays = false;
        let mut passage = if at_corner { Passage::Corner } else { Passage::Reset };
        if let Some(limit) = limit {
            passage = Passage::Accumulation;
            match system.at_accumulation(index, limit, &to) {
                AtSwitch::Replace { to: rest, factor: None } => {
                    (to, t) = (rest, limit);
                    departure = self.surfaces.departure(&*system, index, (t, &to), self.h, tolerance);
                    if is_pushed(departure) {
                        return Err(StepError::Contact { t });
                    }
                    // A state that stays on a surface with one side remains on that side.
                    stays = self.surfaces.rounding(&*system, index, (t, &to), self.h) > 0.0
                        && matches!(system.at_switch(index, t, &to, side > 0.0), AtSwitch::Continue);
                }
                _ if is_limit => return Err(StepError::Accumulation { t: limit }),
                _ => return Err(StepError::Contact { t }),
            }
            self.accumulation = Accumulation::default();
        }
        let state = state_at(&*system, t, &to);
        if state.check().is_err() || to.v.iter().any(|v| !v.is_finite()) {
            return Err(StepError::ResetUndefined { t });
        }
        let value = self.surfaces.value(&*system, index, (t, &to));
        if side * value < -max_or_nan(tolerance, self.surfaces.rounding(&*system, index, (t, &to), self.h)) {
            return Err(StepError::ResetBeyond { t });
        }
        let next = match departure {
            Some(departure) if !enters_corner => Some(departure.side),
            _ => (stays || enters_corner).then_some(side),
        };
        self.surfaces.reset(&*system, (index, next), t, [&from, &to], self.h);
        // On a surface that moves, or by a conformal factor, a contact transformation changes the energy too.
        let [(before, size), (after, size_after)] = [&from, &to].map(|x| energy(&*system, t, x));
        let keeps = (after - before).abs() <= MAX_ENERGY_CHANGE * (size + size_after);
        self.changed_energy |= factor.is_none() || !keeps;
        self.resets.push(Reset { t, index, before: at.state, after: state.clone() });
        let rests = StepStart::zeros(to.v.len());
        let to = TimedState { t, state, v: to.v, rests };
        Ok(Passed { to, factor: factor.unwrap_or(1.0), passage, enters_corner })
    }
}
