//! What happens to a motion at the zero of a switching function.

use crate::gauss::StepStart;
use crate::integration::{Passage, Reset};
use crate::switching::corner::{Corner, corner};
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::accumulation::{Accumulation, Resolution};
use crate::switching::surfaces::{Departure, TimedState};
use crate::{StepError, theory::legendre_inverse};
use contact_geom::{
    PhasePoint, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
    switching::Control,
};

/// The state after a zero, on the side where the motion continues, with the conformal factor of the passage.
pub(super) struct Passed<const N: usize> {
    pub to: TimedState<N>,
    pub factor: f64,
    pub passage: Passage,
}

impl<const N: usize> SwitchingStepper<'_, N> {
    /// The passage of a zero.
    pub(super) fn through(
        &mut self,
        at: TimedState<N>,
        index: usize,
        span: f64,
        spacing: f64,
    ) -> Result<Passed<N>, StepError> {
        let max_displacement = max_abs_or_nan(at.v.iter().map(|v| v * span));
        let lagrangian = self.problem.lagrangian;
        let to = match lagrangian.at_switch(index, at.t, &at.point(), self.surfaces.side(index) < 0.0) {
            Control::Replace(to) => Some((to, None)),
            Control::Conformal { to, factor } => Some((to, Some(factor))),
            _ => None,
        };
        if let Some((to, factor)) = to {
            let (to, passage) = self.reset(at, index, (to, factor), spacing)?;
            return Ok(Passed { to, factor: factor.unwrap_or(1.0), passage });
        }
        let (p, passage) = match corner(lagrangian, &mut self.surfaces, index, &at, max_displacement)? {
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
        let state = PhasePoint { p, ..at.state };
        let v = legendre_inverse(lagrangian, at.t, &state, &at.v)?.v;
        let to = TimedState { state, v, rests: StepStart { y: [0.0; N], ..at.rests }, ..at };
        Ok(Passed { to, factor: 1.0, passage })
    }

    /// The state after a reset.
    fn reset(
        &mut self,
        at: TimedState<N>,
        index: usize,
        (mut to, factor): (VelocityPoint<N>, Option<f64>),
        spacing: f64,
    ) -> Result<(TimedState<N>, Passage), StepError> {
        let (lagrangian, side, mut t) = (self.problem.lagrangian, self.surfaces.side(index), at.t);
        let from = at.point();
        let tolerance = self.surfaces.rounding(lagrangian, index, (t, &from), self.h);
        let mut departure = self.surfaces.departure(lagrangian, index, (t, &to), self.h, tolerance);
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
            match lagrangian.at_accumulation(index, limit, &to) {
                Control::Replace(rest) => {
                    (to, t) = (rest, limit);
                    departure = self.surfaces.departure(lagrangian, index, (t, &to), self.h, tolerance);
                }
                _ => return Err(StepError::Accumulation { t: limit }),
            }
            self.accumulation = Accumulation::default();
        }
        let p = lagrangian.gradient(t, &to).y;
        let state = PhasePoint { q: to.q, p, z: to.z };
        if state.check().is_err() || to.v.iter().any(|v| !v.is_finite()) {
            return Err(StepError::ResetUndefined { t });
        }
        let value = self.surfaces.value(lagrangian, index, (t, &to));
        if side * value < -max_or_nan(tolerance, self.surfaces.rounding(lagrangian, index, (t, &to), self.h)) {
            return Err(StepError::ResetBeyond { t });
        }
        self.surfaces.reset(lagrangian, (index, departure), t, [&from, &to], self.h);
        self.changed_energy |= factor.is_none();
        self.resets.push(Reset { t, index, before: at.state, after: state });
        Ok((TimedState { t, state, v: to.v, rests: StepStart::ZERO }, passage))
    }
}
