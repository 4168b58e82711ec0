//! Columns that are carried along the steps of a run.

use crate::integration::{PartPoint, WholeStep};
use crate::run::discretization::Discretization;
use crate::sensitivity::columns::Column;
use crate::sensitivity::parametric_system::Differentiable;
use crate::sensitivity::row_times::RowTimes;
use crate::sensitivity::step_tangent::{RowTangent, StepTangent, TakenStep};
use crate::sensitivity::stretching::Stretching;
use crate::sensitivity::tangent::{SwitchTime, TangentRow, row};
use crate::sensitivity::time_jumps::{TimeJump, TimeJumps};
use crate::sensitivity::{MotionState, SensitivityError};

/// Columns, with the rows and the zeros of switching functions on their way.
pub(super) struct CarriedColumns<'r, 'p> {
    pub problem: &'r Differentiable<'p>,
    pub steps: &'r Discretization<'p>,
    pub engine: StepTangent<'p>,
    /// For shortened steps and parts of steps.
    pub row_engine: RowTangent<'p>,
    pub columns: Vec<Column>,
    pub jumps: TimeJumps<'r, 'p>,
    pub times: RowTimes,
    pub rows: Vec<TangentRow>,
    pub switches: Vec<SwitchTime>,
    /// The stretching of the columns as a frame, which is then made orthonormal after each part of a step too.
    pub stretching: Option<Stretching>,
}

impl<'r, 'p> CarriedColumns<'r, 'p> {
    pub fn new(
        problem: &'r Differentiable<'p>,
        steps: &'r Discretization<'p>,
        engine: StepTangent<'p>,
        columns: Vec<Column>,
        times: RowTimes,
    ) -> Self {
        let (rows, switches, jumps) = (Vec::new(), Vec::new(), TimeJumps::new(problem, steps));
        CarriedColumns {
            problem,
            steps,
            engine,
            row_engine: RowTangent::new(),
            columns,
            jumps,
            times,
            rows,
            switches,
            stretching: None,
        }
    }

    /// Carries the columns over a step, the k-th of the run, which ends at the time `end`; returns their largest component.
    pub fn push(&mut self, step: &TakenStep, end: f64, k: usize) -> Result<f64, SensitivityError> {
        match step {
            TakenStep::Whole(whole) => {
                if let (Some(jump), Some(at)) = (self.jumps.at_start(whole.start().0, k), step.start()) {
                    let times: Vec<f64> = self.columns.iter().map(|column| column.time_after(k)).collect();
                    self.push_over(jump, &at, &times, k)?;
                }
                self.rows_within(whole, end, None, k)?;
                let failed = |cause| SensitivityError::Step { step: k, cause };
                self.engine.push(whole, k, &mut self.columns).map_err(failed)
            }
            TakenStep::Parts(parts) => self.push_parts(parts, k),
        }
    }

    /// Carries the columns over a jump in time at a point, whose time has these derivatives.
    pub fn push_over(
        &mut self,
        jump: TimeJump,
        at: &PartPoint,
        times: &[f64],
        k: usize,
    ) -> Result<(), SensitivityError> {
        let wanted: Vec<usize> = self.columns.iter().filter_map(|column| column.parameter).collect();
        if wanted.is_empty() && times.iter().all(|dt| *dt == 0.0) {
            return Ok(());
        }
        let of = self.jumps.derivatives(jump, at, &wanted, true);
        let of = of.map_err(|cause| SensitivityError::Step { step: k, cause })?;
        self.columns.iter_mut().zip(times).try_for_each(|(column, dt)| of.push(column, *dt))
    }

    /// The rows before the end of a step or of a part of one, from its start by shortened steps; `starts` are the
    /// derivatives of the time of the start of a part.
    pub fn rows_within(
        &mut self,
        step: &WholeStep,
        end: f64,
        starts: Option<&[f64]>,
        k: usize,
    ) -> Result<(), SensitivityError> {
        let failed = |cause| SensitivityError::Step { step: k, cause };
        let (steps, problem) = (self.steps, self.problem);
        while let Some(t) = self.times.next_within((step.start().0, end)) {
            let (short, state, v) = steps.shortened(step, t).map_err(failed)?;
            let start = |i: usize, column: &Column| match starts {
                Some(starts) => starts[i],
                None => column.time_after(k),
            };
            let columns = self.columns.iter().enumerate();
            let mut columns: Vec<_> = columns.map(|(i, column)| column.to_fixed_time(start(i, column))).collect();
            self.row_engine.push(&mut self.engine, problem, &short, &mut columns).map_err(failed)?;
            let state = MotionState::at(t, &state, &v);
            self.rows.push(row(problem, state, &columns, |_| 0.0).map_err(failed)?);
        }
        Ok(())
    }
}
