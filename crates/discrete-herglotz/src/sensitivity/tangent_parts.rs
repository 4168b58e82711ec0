//! The tangent of a step with parts.
//!
//! A part ends at a time that may itself depend on the variables, so that its tangent is taken to a fixed time first, with
//! the derivative in its length as one more column. At the zero of a switching function g the time has the derivative
//! `dt = -dg / g'`, where dg is the derivative of g for a fixed time and g' its rate in the length of the part: that of
//! the discrete motion. Then the reset follows, and the next part starts at this time. So it is at the time of a kink or a
//! jump, whose derivatives in the parameters are known.

use crate::StepError;
use crate::integration::{PartEnd, PartPoint, SolvedPart};
use crate::sensitivity::carried_columns::CarriedColumns;
use crate::sensitivity::columns::Column;
use crate::sensitivity::switch::Switch;
use crate::sensitivity::tangent::{SwitchTime, row};
use crate::sensitivity::time_jumps::TimeJump;
use crate::sensitivity::{MotionState, SensitivityError};
use contact_geom::numbers::max_or_nan;

impl CarriedColumns<'_, '_> {
    /// Carries the columns over the parts of a step, the k-th of the run; returns their largest component.
    pub(super) fn push_parts(&mut self, parts: &[SolvedPart], k: usize) -> Result<f64, SensitivityError> {
        // The derivatives of the time at the start of each part.
        let mut times: Vec<f64> = self.columns.iter().map(|column| column.time_after(k)).collect();
        let passed = self.jumps.passed(parts, k);
        let after = |i: Option<usize>| passed.iter().filter(move |(place, _)| *place == i).map(|(_, jump)| *jump);
        if let Some(first) = parts.first() {
            after(None).try_for_each(|jump| self.push_over(jump, &first.from, &times, k))?;
        }
        for (i, part) in parts.iter().enumerate() {
            // The part ends at the time of the jump, unless parts without a length follow.
            let at_end = after(Some(i)).next().filter(|_| part.end == PartEnd::Break);
            self.push_part((part, at_end), (k, i + 1 == parts.len()), &mut times)?;
            after(Some(i)).try_for_each(|jump| self.push_over(jump, &part.next, &times, k))?;
            if i + 1 < parts.len() {
                self.stretch(part, &mut times).map_err(|cause| SensitivityError::Step { step: k, cause })?;
            }
        }
        // Where something happens at the end of the step itself, the state after it is that at the time of the passage.
        if let Some(last) = parts.last().filter(|last| last.end != PartEnd::Step) {
            let rates = last.next.rates(self.jumps.before(last.next.t), self.steps);
            let rates = rates.map_err(|cause| SensitivityError::Step { step: k, cause })?;
            for (column, dt) in self.columns.iter_mut().zip(&times) {
                let dh = column.time_after(k + 1) - dt;
                column.set_state(column.state().plus(&rates.scale(dh)));
            }
        }
        Ok(self.columns.iter().fold(0.0, |m, column| max_or_nan(m, column.size())))
    }

    fn push_part(
        &mut self,
        (part, jump): (&SolvedPart, Option<TimeJump>),
        (k, is_last): (usize, bool),
        times: &mut [f64],
    ) -> Result<(), SensitivityError> {
        let failed = |cause| SensitivityError::Step { step: k, cause };
        let (steps, problem) = (self.steps, self.problem);
        if let Some(step) = &part.step {
            self.rows_within(step, part.to.t, Some(times), k)?;
        }
        let mut fixed: Vec<Column> =
            self.columns.iter().zip(&*times).map(|(column, dt)| column.to_fixed_time(*dt)).collect();
        fixed.push(Column::of_length(problem.dimension()));
        match part.step.as_ref().filter(|_| !self.jumps.is_at_once(part)) {
            Some(step) => self.row_engine.push(&mut self.engine, problem, step, &mut fixed).map_err(failed)?,
            None => {
                let rates = self.jumps.rates_at_once(part).map_err(failed)?;
                fixed.iter_mut().for_each(|column| column.push_at_once(&rates));
            }
        }
        let Some(along_length) = fixed.pop().map(|column| column.state()) else { return Ok(()) };
        let PartPoint { t, ref state, ref v } = part.to;
        if !is_last && self.times.next_at(t, false).is_some() {
            let state = MotionState::at(t, state, v);
            self.rows.push(row(problem, state, &fixed, |_| 0.0).map_err(failed)?);
        }
        let mut change = None;
        match part.end {
            PartEnd::Step => {
                times.iter_mut().zip(&self.columns).for_each(|(dt, column)| *dt = column.time_after(k + 1))
            }
            PartEnd::Break => match jump {
                None => times.fill(0.0),
                Some(jump) => {
                    let wanted: Vec<usize> = self.columns.iter().filter_map(|column| column.parameter).collect();
                    let of = self.jumps.derivatives(jump, &part.next, &wanted, false).map_err(failed)?;
                    for (dt, column) in times.iter_mut().zip(&fixed) {
                        *dt = of.time(column)?;
                    }
                }
            },
            PartEnd::Division { fraction } => times.iter_mut().zip(&self.columns).for_each(|(dt, column)| {
                *dt = (1.0 - fraction) * column.time_after(k) + fraction * column.time_after(k + 1);
            }),
            PartEnd::Switch { index, rising, passage } => {
                let switch = Switch { problem, index, rising, at: &part.to, step: k, h: steps.h };
                let gradient = switch.gradient()?;
                let rate = gradient.rate(gradient.state.dot(&along_length), t)?;
                for (dt, column) in times.iter_mut().zip(&fixed) {
                    let explicit = column.parameter.and_then(|k| gradient.parameters.get(k)).copied().unwrap_or(0.0);
                    *dt = -(gradient.state.dot(&column.state()) + explicit) / rate;
                }
                self.switches.push(SwitchTime { t, index, derivatives: times.to_vec() });
                change = switch.passage(passage, &part.next)?;
            }
        }
        for ((column, mut fixed), dt) in self.columns.iter_mut().zip(fixed).zip(&*times) {
            fixed.set_state(fixed.state().plus(&along_length.scale(*dt)));
            let state = change.as_ref().map_or_else(|| fixed.state(), |change| change.along(&fixed, *dt));
            column.set_state(state);
        }
        Ok(())
    }

    /// Makes the columns orthonormal at the end of a part, at its fixed time, if they are a frame; `times` are the
    /// derivatives of the time at which they are.
    fn stretch(&mut self, part: &SolvedPart, times: &mut [f64]) -> Result<(), StepError> {
        let Some(stretching) = &mut self.stretching else { return Ok(()) };
        let t = part.next.t;
        let rates = part.next.rates(t, self.steps)?;
        for (column, dt) in self.columns.iter_mut().zip(&*times) {
            column.set_state(column.state().minus(&rates.scale(*dt)));
        }
        stretching.orthonormalise(&mut self.columns, times)?;
        for (column, dt) in self.columns.iter_mut().zip(&*times) {
            column.set_state(column.state().plus(&rates.scale(*dt)));
        }
        stretching.note_within(t, self.steps.h < 0.0);
        Ok(())
    }
}
