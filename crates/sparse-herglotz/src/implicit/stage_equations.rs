//! The stage equations of contact Gauss collocation on a large system, and their solution by Newton's method.

use super::border::{Border, BorderVector};
use super::gauss_table::{GaussTable, MAX_STAGES};
use super::lu::LuFactors;
use super::max_norm::max_norm;
use super::newton_convergence::{NewtonConvergence, NewtonDecision};
use super::stage_jacobian::StageJacobian;
use crate::derivatives::{EvaluationPoint, FirstDerivatives};
use crate::system::{LagrangianValue, SparseSystem};
use discrete_herglotz::{StepError, solve::ITERATION_LIMIT};

/// The state at the start of a step.
#[derive(Clone, Copy)]
pub(super) struct StepStart<'a> {
    pub t: f64,
    /// The positions, padded.
    pub q: &'a [f64],
    pub p: &'a [f64],
    pub z: f64,
}

/// The unknowns of the stages, their equations, and the workspace for solving them.
pub(super) struct StageEquations<'a> {
    pub system: &'a SparseSystem,
    pub table: GaussTable,
    pub jacobian: StageJacobian,
    pub factors: LuFactors,
    /// Present only with general terms.
    pub border: Option<Border>,
    pub h: f64,
    pub factorisations: u64,
    pub iterations: u64,
    /// The stage velocities of the next step, grouped by unknown: the initial guess, and then the solution.
    pub v: Vec<f64>,
    pub correction: Vec<f64>,
    pub residual: Vec<f64>,
    /// `Z_i - z0` and rho of the stages.
    pub actions: [f64; MAX_STAGES],
    pub rho: [f64; MAX_STAGES],
    pub derivatives: Vec<FirstDerivatives>,
    /// The position and velocity of a stage, padded.
    pub stage_q: Vec<f64>,
    pub stage_v: Vec<f64>,
}

impl StageEquations<'_> {
    /// Computes the position and the velocity of a stage, and returns its time.
    fn set_stage(&mut self, start: StepStart, j: usize) -> f64 {
        let GaussTable { s, a, c, .. } = self.table;
        let row = a[j];
        let components = self.stage_q.iter_mut().zip(&mut self.stage_v).zip(start.q).skip(1);
        for (((q, v), q0), stages) in components.zip(self.v.chunks_exact(s)) {
            *q = q0 + stages.iter().zip(row).map(|(v, a)| a * v).sum::<f64>();
            *v = stages[j];
        }
        start.t + c[j]
    }

    /// Evaluates L and its first derivatives at the stages.
    pub fn evaluate(&mut self, start: StepStart, value: LagrangianValue) {
        for j in 0..self.table.s {
            let t = self.set_stage(start, j);
            let at = EvaluationPoint { t, q: &self.stage_q, v: &self.stage_v, z: start.z + self.actions[j] };
            self.system.first_derivatives(at, value, &mut self.derivatives[j]);
        }
        if self.border.is_none() {
            // Without general terms z enters L only as gamma z, so that rho follows from the rates.
            let mut rates = [0.0; MAX_STAGES];
            rates.iter_mut().zip(&self.derivatives).for_each(|(rate, l)| *rate = l.z);
            self.rho = self.table.factors(rates);
        }
    }

    /// Solves for the stage velocities; `v` holds the initial guess, and then the solution.
    pub fn solve(&mut self, start: StepStart) -> Result<(), StepError> {
        let GaussTable { s, a, .. } = self.table;
        // A correction below this times the machine epsilon does not change the position.
        let resolution = max_norm(start.q) / self.h.abs();
        let mut convergence = NewtonConvergence::new();
        let mut residual_size = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            self.evaluate(start, LagrangianValue::NotNeeded);
            for (i, residual) in self.residual.chunks_exact_mut(s).enumerate() {
                for (k, residual) in residual.iter_mut().enumerate() {
                    let force: f64 = (0..s).map(|j| a[k][j] * self.rho[j] * self.derivatives[j].q[i]).sum();
                    *residual = self.rho[k] * self.derivatives[k].v[i] - start.p[i] - force;
                }
            }
            residual_size = max_norm(&self.residual);
            if !residual_size.is_finite() {
                return Err(StepError::NonFinite);
            }
            let is_new = !self.factors.is_current();
            if is_new {
                self.factorise(start)?;
                convergence.restart();
            }
            self.correction.copy_from_slice(&self.residual);
            self.factors.solve(&mut self.correction)?;
            if is_new {
                self.factors.check(&self.correction, &self.residual)?;
            }
            let border_correction = self.correct_border(start)?;
            self.v.iter_mut().zip(&self.correction).for_each(|(v, correction)| *v -= correction);
            self.iterations += 1;
            let (velocity_correction, speed) = (max_norm(&self.correction), max_norm(&self.v));
            let scale = speed + resolution;
            let correction =
                if scale > 0.0 { (velocity_correction / scale).max(border_correction) } else { border_correction };
            if !correction.is_finite() {
                return Err(StepError::NonFinite);
            }
            match convergence.decide(correction, f64::EPSILON) {
                NewtonDecision::Converged => return Ok(()),
                NewtonDecision::Continue => {}
                NewtonDecision::Refactorise => self.factors.discard(),
            }
        }
        self.factors.discard();
        Err(StepError::NotConverged { residual: residual_size, iterations: ITERATION_LIMIT })
    }

    /// Corrects Z and rho, and adapts the correction of the velocities to these changes. Returns the largest change of
    /// Z and rho relative to their sizes.
    fn correct_border(&mut self, start: StepStart) -> Result<f64, StepError> {
        let Some(border) = &self.border else { return Ok(0.0) };
        let GaussTable { s, a, .. } = self.table;
        let mut r = BorderVector::zeros();
        let mut size = start.z.abs();
        for i in 0..s {
            let sum = |of: &dyn Fn(usize) -> f64| (0..s).map(|j| a[i][j] * of(j)).sum::<f64>();
            r[i] = self.actions[i] - sum(&|j| self.derivatives[j].l);
            r[MAX_STAGES + i] = self.rho[i] - 1.0 + sum(&|j| self.rho[j] * self.derivatives[j].z);
            size += (self.h * self.derivatives[i].l).abs();
        }
        let w = border.solve(&mut self.correction, &r);
        let mut largest = 0.0f64;
        for i in 0..s {
            self.actions[i] -= w[i];
            self.rho[i] -= w[MAX_STAGES + i];
            let relative = if w[i] == 0.0 { 0.0 } else { w[i].abs() / size };
            // `f64::max` would ignore a NaN.
            for relative in [relative, (w[MAX_STAGES + i] / self.rho[i]).abs()] {
                if relative.is_nan() {
                    return Err(StepError::NonFinite);
                }
                largest = largest.max(relative);
            }
        }
        Ok(largest)
    }

    /// Factorises the Jacobian at the present stages.
    fn factorise(&mut self, start: StepStart) -> Result<(), StepError> {
        self.factors.entries.fill(0.0);
        if let Some(border) = &mut self.border {
            border.clear();
        }
        for j in 0..self.table.s {
            let t = self.set_stage(start, j);
            let at = EvaluationPoint { t, q: &self.stage_q, v: &self.stage_v, z: start.z + self.actions[j] };
            let StageEquations { system, table, jacobian, factors, border, rho, derivatives, .. } = self;
            jacobian.add_stage(system, table, at, j, rho[j], &derivatives[j], &mut factors.entries, border.as_mut());
        }
        self.factors.factorise()?;
        self.factorisations += 1;
        match &mut self.border {
            Some(border) => border.reduce(self.table.s, &mut self.factors),
            None => Ok(()),
        }
    }
}
