//! The adjoint of a step with parts: the transpose of its tangent, from its last part to its first.
//!
//! A covector at the end of a part has, in addition to its derivatives in the state, one in the time of this end. It is
//! carried back for a fixed time of the end; its derivative in the length of the part and that in the time are together
//! the derivative in the time of the end, which is passed on: to the times of the run, or at the zero of a switching
//! function to the function, as a multiple of its own derivatives carried back over the same part.

use crate::integration::{PartEnd, PartPoint, SolvedPart};
use crate::run::discretization::Discretization;
use crate::sensitivity::SensitivityError;
use crate::sensitivity::columns::Covector;
use crate::sensitivity::gradient::RowCovectors;
use crate::sensitivity::parametric_system::Differentiable;
use crate::sensitivity::step_tangent::{RowTangent, StepTangent, TakenStep};
use crate::sensitivity::switch::Switch;
use crate::sensitivity::time_jumps::{TimeJump, TimeJumps};
use crate::{Components, StepError};
use contact_geom::numbers::max_or_nan;

/// Carries covectors over the parts of steps.
pub(super) struct PartCovectors<'r, 'p> {
    pub problem: &'r Differentiable<'p>,
    pub steps: &'r Discretization<'p>,
    pub jumps: &'r TimeJumps<'r, 'p>,
    pub tangent: RowTangent<'p>,
}

impl<'p> PartCovectors<'_, 'p> {
    /// Carries covectors from the end of a step, the k-th of the run, to its start, and adds those of its rows to the
    /// first of them; `engine` is the tangent of whole steps.
    pub fn pull(
        &mut self,
        engine: &mut StepTangent<'p>,
        (parts, k): (&[SolvedPart], usize),
        all: &mut [Covector],
        rows: &mut RowCovectors<'_, 'p>,
    ) -> Result<(), SensitivityError> {
        let failed = |cause| SensitivityError::Step { step: k, cause };
        // The derivatives in the time of the end of a part.
        let mut times = vec![0.0; all.len()];
        if let Some(last) = parts.last().filter(|last| last.end != PartEnd::Step) {
            let rates = last.next.rates(self.jumps.before(last.next.t), self.steps).map_err(failed)?;
            for (covector, time) in all.iter_mut().zip(&mut times) {
                let along = covector.state().dot(&rates);
                covector.add_time(along, k + 1);
                *time = -along;
            }
        }
        let passed = self.jumps.passed(parts, k);
        let after = |i: Option<usize>| passed.iter().filter(move |(place, _)| *place == i).map(|(_, jump)| *jump);
        for (i, part) in parts.iter().enumerate().rev() {
            for jump in after(Some(i)) {
                self.pull_over_jump(jump, &part.next, all, &mut times).map_err(failed)?;
            }
            let at_end = after(Some(i)).next().filter(|_| part.end == PartEnd::Break);
            // A row at the end of a part is one before the passage there, at a fixed time.
            let row = if i + 1 < parts.len() { rows.take_at(&part.to).map_err(failed)? } else { None };
            self.pull_part(engine, (part, at_end, k), all, &mut times)?;
            let (Some(first), Some(time)) = (all.first_mut(), times.first_mut()) else { continue };
            if let Some(mut row) = row {
                self.pull_over(engine, part, std::slice::from_mut(&mut row)).map_err(failed)?;
                let [of_start, of_length] = row.take_times();
                first.add_multiple(1.0, &row);
                *time += of_start - of_length;
            }
            if let Some(step) = &part.step {
                *time += rows.add_within(engine, step, first).map_err(failed)?;
            }
        }
        if let Some(first) = parts.first() {
            after(None).try_for_each(|jump| self.pull_over_jump(jump, &first.from, all, &mut times)).map_err(failed)?;
        }
        for (covector, time) in all.iter_mut().zip(&times) {
            covector.add_time(*time, k);
        }
        Ok(())
    }

    /// Carries covectors at the start of a step, the k-th of the run, over a jump in time there, unless the step has parts,
    /// and adds that of a row before it.
    pub fn pull_at_start(
        &self,
        step: &TakenStep,
        k: usize,
        all: &mut [Covector],
        rows: &mut RowCovectors<'_, 'p>,
    ) -> Result<(), StepError> {
        let Some(t) = step.start_time() else { return Ok(()) };
        let jump = self.jumps.at_start(t, k).filter(|_| matches!(step, TakenStep::Whole(_)));
        let Some(at) = step.start().filter(|_| jump.is_some() || rows.is_next(t)) else { return Ok(()) };
        if let Some(jump) = jump {
            let mut times = vec![0.0; all.len()];
            self.pull_over_jump(jump, &at, all, &mut times)?;
            all.iter_mut().zip(times).for_each(|(covector, time)| covector.add_time(time, k));
        }
        match all.first_mut() {
            Some(first) => rows.add_at_start(&at, k, first),
            None => Ok(()),
        }
    }

    /// Carries covectors back over a jump in time at a point; `times` are their derivatives in the time of this point.
    fn pull_over_jump(
        &self,
        jump: TimeJump,
        at: &PartPoint,
        all: &mut [Covector],
        times: &mut [f64],
    ) -> Result<(), StepError> {
        let of = self.jumps.derivatives(jump, at, &self.parameters(), true)?;
        all.iter_mut().zip(times).for_each(|(covector, time)| *time += of.pull(covector));
        Ok(())
    }

    /// The indices of all parameters.
    fn parameters(&self) -> Vec<usize> {
        (0..self.problem.of.parameters().len()).collect()
    }

    /// Carries covectors over a part; `times` are their derivatives in the time of its end, and then of its start.
    fn pull_part(
        &mut self,
        engine: &mut StepTangent<'p>,
        (part, jump, k): (&SolvedPart, Option<TimeJump>, usize),
        all: &mut [Covector],
        times: &mut [f64],
    ) -> Result<(), SensitivityError> {
        let failed = |cause| SensitivityError::Step { step: k, cause };
        let (problem, t, h) = (self.problem, part.to.t, self.steps.h);
        let mut gradient = None;
        let of_jump = jump.map(|jump| self.jumps.derivatives(jump, &part.next, &self.parameters(), false));
        let of_jump = of_jump.transpose().map_err(failed)?;
        if let PartEnd::Switch { index, rising, passage } = part.end {
            let switch = Switch { problem, index, rising, at: &part.to, step: k, h };
            if let Some(change) = switch.passage(passage, &part.next)? {
                for (covector, time) in all.iter_mut().zip(&mut *times) {
                    let (state, parameters, of_time) = change.pull(&covector.state());
                    covector.set_state(Components::zeros(problem.dimension()));
                    covector.add_state(&state, &parameters);
                    *time += of_time;
                }
            }
            gradient = Some(switch.gradient()?);
        }
        let of_run: Vec<[f64; 2]> = all.iter_mut().map(Covector::take_times).collect();
        self.pull_over(engine, part, all).map_err(failed)?;
        let mut of_function = None;
        if let Some(gradient) = gradient {
            let mut covector = Covector::new(gradient.state.clone(), gradient.parameters.clone());
            self.pull_over(engine, part, std::slice::from_mut(&mut covector)).map_err(failed)?;
            let [of_start, of_length] = covector.take_times();
            let rate = gradient.rate(of_length, t)?;
            of_function = Some((covector, of_start - of_length, rate));
        }
        for ((covector, time), of_run) in all.iter_mut().zip(times).zip(of_run) {
            let [of_start, of_length] = covector.take_times();
            [covector.time, covector.step] = of_run;
            let of_end = *time + of_length;
            *time = of_start - of_length;
            match part.end {
                PartEnd::Step => covector.add_time(of_end, k + 1),
                PartEnd::Break => {
                    if let Some(of) = &of_jump {
                        of.add_time(covector, of_end);
                    }
                }
                PartEnd::Division { fraction } => {
                    covector.add_time((1.0 - fraction) * of_end, k);
                    covector.add_time(fraction * of_end, k + 1);
                }
                PartEnd::Switch { .. } => {
                    if let Some((function, of_its_start, rate)) = &of_function {
                        let factor = -of_end / rate;
                        covector.add_multiple(factor, function);
                        *time += factor * of_its_start;
                    }
                }
            }
            covector.largest = max_or_nan(covector.largest, covector.size());
        }
        Ok(())
    }

    /// Carries covectors over a part for a fixed time of its end.
    fn pull_over(
        &mut self,
        engine: &mut StepTangent<'p>,
        part: &SolvedPart,
        all: &mut [Covector],
    ) -> Result<(), StepError> {
        match part.step.as_ref().filter(|_| !self.jumps.is_at_once(part)) {
            Some(step) => {
                // The rates of the step after it are those of another length.
                all.iter_mut().for_each(|covector| covector.set_state(covector.state()));
                self.tangent.pull(engine, self.problem, step, all)
            }
            None => {
                let rates = self.jumps.rates_at_once(part)?;
                all.iter_mut().for_each(|covector| covector.pull_at_once(&rates));
                Ok(())
            }
        }
    }
}
