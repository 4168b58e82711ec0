//! Damped Newton iteration for the stages of a step, with the derivatives of H at each stage.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::limits::MAX_NEWTON_ITERATIONS;
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::simplified_newton::SimplifiedNewton;
use crate::gauss::routes::hamiltonian::stage::{Evaluation, Stage};
use crate::gauss::stages::damping::{Damping, Verdict, chances};
use crate::gauss::system::SystemAtPoints;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::CompensatedSum;
use crate::solve::DenseLu;
use contact_geom::numbers::max_or_nan;

/// The workspace of Newton's method with the derivatives at each stage.
pub(super) struct FullNewton {
    lu: DenseLu,
    /// The right-hand sides, multiplied by the weights, stage by stage: the last accepted ones, and those on trial.
    from: Vec<f64>,
    k: Vec<f64>,
    residual: Vec<f64>,
    correction: Vec<f64>,
    next: Vec<f64>,
    /// The Jacobians of the stages, by columns.
    jacobians: Vec<Vec<f64>>,
}

/// The stage equations of a step, with the workspace for evaluations at one stage.
struct Equations<'r> {
    system: &'r dyn SystemAtPoints,
    table: &'r StageTable,
    t: f64,
    q: &'r [CompensatedSum],
    p: &'r [CompensatedSum],
    z: f64,
    least: [f64; 2],
    stage: &'r mut Stage,
    evaluation: &'r mut Evaluation,
}

impl Equations<'_> {
    /// The number of components of y.
    fn components(&self) -> usize {
        2 * self.q.len() + 2
    }

    /// Sets the stage to that of given right-hand sides.
    fn take_stage(&mut self, k: &[f64], i: usize) {
        let (n, components, table) = (self.q.len(), self.components(), self.table);
        let sum =
            |c: usize, start: f64| (0..table.s).fold(start, |sum, j| sum + table.m.0[j].0[i] * k[j * components + c]);
        let stage = &mut *self.stage;
        stage.t = self.t + table.times.0[i];
        for d in 0..n {
            stage.q[d] = sum(d, self.q[d].value);
            stage.scaled_p[d] = sum(n + d, self.p[d].value);
        }
        stage.z = sum(2 * n, self.z);
        stage.one_minus_rho = sum(2 * n + 1, 0.0);
        stage.set_momentum();
    }

    /// The right-hand side at the stage, in the order of y.
    fn right_hand_side(&mut self, i: usize, out: &mut [f64]) {
        self.evaluation.right_hand_side(self.system, self.stage, self.table.weights.0[i], out);
    }

    /// The residuals `w f(y) - w K`.
    fn residuals(&mut self, k: &[f64], out: &mut [f64]) {
        let components = self.components();
        for (i, (out, k_i)) in out.chunks_exact_mut(components).zip(k.chunks_exact(components)).enumerate() {
            self.take_stage(k, i);
            self.right_hand_side(i, out);
            out.iter_mut().zip(k_i).for_each(|(out, k)| *out -= k);
        }
    }

    /// The size of a correction: the largest component, each kind relative to the largest stage value of that kind.
    fn size(&mut self, k: &[f64], change: &[f64]) -> f64 {
        let (n, components) = (self.q.len(), self.components());
        let mut largest = [[0.0, 0.0], [0.0, self.least[0]], [0.0, self.least[1]], [0.0, 1.0]];
        let kind = |c: usize| match c {
            c if c < n => 0,
            c if c < 2 * n => 1,
            c => 2 + c - 2 * n,
        };
        for (i, change) in change.chunks_exact(components).enumerate() {
            self.take_stage(k, i);
            let stage = &*self.stage;
            let parts = stage.q.iter().chain(&stage.scaled_p).chain([&stage.z]);
            for (c, part) in parts.enumerate() {
                largest[kind(c)][1] = max_or_nan(largest[kind(c)][1], part.abs());
            }
            // An action may vanish by cancellation.
            let (weight, h) = (self.table.weights.0[i], self.table.h);
            let work = (0..n).map(|d| stage.scaled_p[d] * k[i * components + d] / weight * h);
            largest[2][1] = work.fold(largest[2][1], |largest, work| max_or_nan(largest, work.abs()));
            for (c, change) in change.iter().enumerate() {
                largest[kind(c)][0] = max_or_nan(largest[kind(c)][0], change.abs());
            }
        }
        let relative = |[change, size]: [f64; 2]| if change == 0.0 { 0.0 } else { change / size };
        largest.into_iter().map(relative).fold(0.0, max_or_nan)
    }
}

impl FullNewton {
    /// The workspace for s stages with n components.
    fn new(s: usize, n: usize) -> Self {
        let numbers = || vec![0.0; s * n];
        FullNewton {
            lu: DenseLu::new(s * n),
            from: numbers(),
            k: numbers(),
            residual: numbers(),
            correction: numbers(),
            next: numbers(),
            jacobians: vec![vec![0.0; n * n]; s],
        }
    }

    /// Solves the stage equations from the right-hand side at the start of the step.
    fn solve(&mut self, equations: &mut Equations<'_>) -> Result<(), StepError> {
        let table = equations.table;
        let (s, n) = (table.s, equations.components());
        let FullNewton { lu, from, k, residual, correction, next, jacobians } = self;
        from.fill(0.0);
        equations.take_stage(from, 0);
        equations.stage.t = equations.t;
        for (i, k) in from.chunks_exact_mut(n).enumerate() {
            equations.right_hand_side(i, k);
        }
        equations.residuals(from, residual);
        if !residual.iter().all(|r| r.is_finite()) {
            return Err(StepError::NonFinite);
        }
        let (mut damping, mut change) = (Damping::new(chances(s * n)), f64::INFINITY);
        for iterations in 1..=MAX_NEWTON_ITERATIONS {
            if damping.renews() {
                for (i, jacobian) in jacobians.iter_mut().enumerate() {
                    equations.take_stage(from, i);
                    equations.evaluation.jacobian(equations.system, equations.stage, jacobian);
                }
                factorise(lu, table, jacobians, n)?;
                correction.copy_from_slice(residual);
                lu.solve(correction)?;
            } else {
                std::mem::swap(correction, next);
            }
            let after = loop {
                for ((k, from), correction) in k.iter_mut().zip(from.iter()).zip(correction.iter()) {
                    *k = from + damping.part() * correction;
                }
                equations.residuals(k, residual);
                next.copy_from_slice(residual);
                let after = if lu.solve(next).is_ok() { equations.size(k, next) } else { f64::NAN };
                change = equations.size(k, correction);
                // No damping once half of the digits are correct.
                match damping.judge(change, after, f64::EPSILON.sqrt()) {
                    Verdict::Taken => break after,
                    Verdict::Again => {}
                    Verdict::GivenUp => return Err(StepError::NotConverged { residual: change, iterations }),
                }
            };
            from.copy_from_slice(k);
            // The round-off of a solution, which grows with the number of unknowns.
            let near = f64::EPSILON * max_or_nan(1e3, 8.0 * (s * n) as f64);
            if after <= f64::EPSILON || damping.ratio() >= 0.5 && after <= near {
                return Ok(());
            }
            if damping.ratio() * after <= f64::EPSILON {
                from.iter_mut().zip(next.iter()).for_each(|(from, next)| *from += next);
                return Ok(());
            }
        }
        Err(StepError::NotConverged { residual: change, iterations: MAX_NEWTON_ITERATIONS })
    }
}

/// Factorises the matrix with the blocks `1 - w_i m_ij J_i`, the Jacobian of the stage equations for the unknowns w K, from
/// the Jacobians of the stages with n components.
///
/// # Errors
/// [`StepError::Singular`].
pub(super) fn factorise(
    lu: &mut DenseLu,
    table: &StageTable,
    jacobians: &[Vec<f64>],
    n: usize,
) -> Result<(), StepError> {
    lu.factorise(|row, column| {
        let ((i, c), (j, e)) = ((row / n, row % n), (column / n, column % n));
        let own = if row == column { 1.0 } else { 0.0 };
        own - table.weights.0[i] * table.m.0[j].0[i] * jacobians[i][e * n + c]
    })
}

impl HamiltonianStages {
    /// Allocates the workspace of the Newton methods.
    pub(super) fn reserve(&mut self) {
        let (s, n) = (self.table.s, self.components());
        self.full_newton.get_or_insert_with(|| Box::new(FullNewton::new(s, n)));
        if self.newton.is_none() {
            self.suspended_newton.get_or_insert_with(|| Box::new(SimplifiedNewton::new(&self.table, n)));
        }
    }

    /// Solves the stage equations of the next step by damped Newton iteration from the right-hand side at its start.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub(super) fn solve(&mut self, system: &dyn SystemAtPoints, t: f64) -> Result<(), StepError> {
        self.reserve();
        self.admit_round_off(system, t);
        let n = self.components();
        let HamiltonianStages { table, q, p, z, least, stage, evaluation, full_newton, rows, .. } = self;
        let Some(work) = full_newton.as_deref_mut() else { return Ok(()) };
        work.solve(&mut Equations { system, table, t, q, p, z: z.value, least: *least, stage, evaluation })?;
        for (c, to) in rows.right_hand_sides_mut().iter_mut().enumerate() {
            for (to, k) in to.0.iter_mut().zip(work.from.chunks_exact(n)) {
                *to = k[c];
            }
        }
        self.solved = true;
        Ok(())
    }
}
