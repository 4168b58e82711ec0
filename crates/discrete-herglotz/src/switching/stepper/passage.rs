//! What happens to a motion at the zero of a switching function.

use crate::gauss::StepStart;
use crate::integration::{Passage, Reset, state_at};
use crate::switching::corner::{Corner, corner};
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::accumulation::{Accumulation, Resolution};
use crate::switching::surfaces::{Departure, TimedState};
use crate::system::AtSwitch;
use crate::{Point, State, StepError, Vector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};

/// The state after a zero, on the side where the motion continues, with the conformal factor of the passage.
pub(super) struct Passed {
    pub to: TimedState,
    pub factor: f64,
    pub passage: Passage,
}

impl SwitchingStepper<'_> {
    /// The passage of a zero.
    pub(super) fn through(
        &mut self,
        at: TimedState,
        index: usize,
        span: f64,
        spacing: f64,
    ) -> Result<Passed, StepError> {
        let max_displacement = max_abs_or_nan(at.v.iter().map(|v| v * span));
        let system = self.problem.system.clone();
        let rising = self.surfaces.side(index) < 0.0;
        if let AtSwitch::Replace { to, factor } = system.at_switch(index, at.t, &at.argument(&*system), rising) {
            let (to, passage) = self.reset(at, index, (to, factor), spacing)?;
            return Ok(Passed { to, factor: factor.unwrap_or(1.0), passage });
        }
        let (p, passage) = match corner(&*system, &mut self.surfaces, index, &at, max_displacement)? {
            Corner::Continuous => {
                self.surfaces.cross(index);
                return Ok(Passed { to: at, factor: 1.0, passage: Passage::Continuous });
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
        Ok(Passed { to, factor: 1.0, passage })
    }

    /// The state after a reset.
    fn reset(
        &mut self,
        at: TimedState,
        index: usize,
        (mut to, factor): (Point, Option<f64>),
        spacing: f64,
    ) -> Result<(TimedState, Passage), StepError> {
        let (system, side, mut t) = (self.problem.system.clone(), self.surfaces.side(index), at.t);
        let from = at.point();
        let tolerance = self.surfaces.rounding(&*system, index, (t, &from), self.h);
        let mut departure = self.surfaces.departure(&*system, index, (t, &to), self.h, tolerance);
        let rate = departure.map_or(0.0, |departure| departure.rate);
        let resolution = Resolution { h: self.h, spacing, rate, rounding: tolerance };
        let mut limit = self.accumulation.add(index, t, &resolution);
        // A state that is stopped on the surface and pushed through it is the limit of impacts too.
        if departure.is_some_and(|Departure { side: next, with_rate, .. }| !with_rate && next * side < 0.0) {
            limit = Some(t);
        }
        let mut passage = Passage::Reset;
        if let Some(limit) = limit {
            passage = Passage::Accumulation;
            match system.at_accumulation(index, limit, &to) {
                AtSwitch::Replace { to: rest, factor: None } => {
                    (to, t) = (rest, limit);
                    departure = self.surfaces.departure(&*system, index, (t, &to), self.h, tolerance);
                }
                _ => return Err(StepError::Accumulation { t: limit }),
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
        self.surfaces.reset(&*system, (index, departure), t, [&from, &to], self.h);
        self.changed_energy |= factor.is_none();
        self.resets.push(Reset { t, index, before: at.state, after: state.clone() });
        let rests = StepStart::zeros(to.v.len());
        Ok((TimedState { t, state, v: to.v, rests }, passage))
    }
}
