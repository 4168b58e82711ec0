//! Damped Newton iteration for the stage equations of a step.

use crate::StepError;
use crate::gauss::limits::MAX_NEWTON_ITERATIONS;
use crate::gauss::stages::damping::{Damping, Verdict, chances};
use crate::solve::DenseLu;

/// Equations `F(x) = 0` for the unknowns x of the stages of a step.
pub(crate) trait StageUnknowns {
    /// Computes the residuals `-F(x)`.
    fn residuals(&mut self, x: &[f64], out: &mut [f64]);

    /// Factorises the Jacobian `F'(x)`, where [`residuals`](Self::residuals) was called last.
    ///
    /// # Errors
    /// [`StepError::Singular`].
    fn factorise(&mut self, x: &[f64], lu: &mut DenseLu) -> Result<(), StepError>;

    /// The size of a correction at x, where [`residuals`](Self::residuals) was called last: the largest component, each
    /// kind relative to the largest unknown of that kind.
    fn size(&mut self, x: &[f64], correction: &[f64]) -> f64;

    /// The size of a correction below which the solution is exact to round-off.
    fn exact(&mut self, _x: &[f64]) -> f64 {
        f64::EPSILON
    }

    /// The size of a correction that may be round-off of the residuals, if the corrections no longer decrease.
    fn round_off(&self, x: &[f64]) -> f64;
}

/// The workspace of the iteration; made once for a run, so that steps do not allocate.
pub(crate) struct DampedNewton {
    /// The guess, then the solution.
    pub x: Vec<f64>,
    trial: Vec<f64>,
    /// The factors of the Jacobian in use, at the last accepted iterate or at an earlier one.
    lu: DenseLu,
    residual: Vec<f64>,
    correction: Vec<f64>,
    next: Vec<f64>,
}

impl DampedNewton {
    /// The workspace for a number of unknowns.
    pub fn new(unknowns: usize) -> Self {
        let numbers = || vec![0.0; unknowns];
        DampedNewton {
            x: numbers(),
            trial: numbers(),
            lu: DenseLu::new(unknowns),
            residual: numbers(),
            correction: numbers(),
            next: numbers(),
        }
    }

    /// The number of corrections that may be taken although they fail the test of [`Damping`].
    pub fn chances(&self) -> u32 {
        chances(self.x.len())
    }

    /// Solves the equations from the guess `x`; the residuals are computed last at the solution. Returns the number of
    /// iterations.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve(&mut self, of: &mut dyn StageUnknowns, chances: u32) -> Result<u32, StepError> {
        let DampedNewton { x, trial, lu, residual, correction, next } = self;
        of.residuals(x, residual);
        if !residual.iter().all(|r| r.is_finite()) {
            return Err(StepError::NonFinite);
        }
        let (mut damping, mut change) = (Damping::new(chances), f64::INFINITY);
        for iterations in 1..=MAX_NEWTON_ITERATIONS {
            if damping.renews() {
                of.factorise(x, lu)?;
                correction.copy_from_slice(residual);
                lu.solve(correction)?;
            } else {
                std::mem::swap(correction, next);
            }
            let after = loop {
                for ((trial, x), correction) in trial.iter_mut().zip(x.iter()).zip(correction.iter()) {
                    *trial = x + correction * damping.part();
                }
                of.residuals(trial, residual);
                next.copy_from_slice(residual);
                let after = if lu.solve(next).is_ok() { of.size(trial, next) } else { f64::NAN };
                change = of.size(trial, correction);
                // No damping once half of the digits are correct.
                match damping.judge(change, after, f64::EPSILON.sqrt()) {
                    Verdict::Taken => break after,
                    Verdict::Again => {}
                    Verdict::GivenUp => return Err(StepError::NotConverged { residual: change, iterations }),
                }
            };
            std::mem::swap(x, trial);
            let exact = of.exact(x);
            if after <= exact || damping.ratio() >= 0.5 && after <= of.round_off(x) {
                return Ok(iterations);
            }
            if damping.ratio() * after <= exact {
                x.iter_mut().zip(next.iter()).for_each(|(x, next)| *x += next);
                of.residuals(x, residual);
                return Ok(iterations + 1);
            }
        }
        Err(StepError::NotConverged { residual: change, iterations: MAX_NEWTON_ITERATIONS })
    }
}
