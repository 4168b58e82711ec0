//! Damped Newton iteration for the stages of a step, with the derivatives of H at each stage.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::simplified_newton::SimplifiedNewton;
use crate::gauss::routes::hamiltonian::stage::{Evaluation, Stage};
use crate::gauss::stages::damped_newton::{DampedNewton, StageUnknowns};
use crate::gauss::system::SystemAtPoints;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::CompensatedSum;
use crate::solve::DenseLu;
use contact_geom::numbers::max_or_nan;

/// The workspace of Newton's method with the derivatives at each stage.
pub(super) struct FullNewton {
    /// The unknowns are the right-hand sides, multiplied by the weights, stage by stage.
    newton: DampedNewton,
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
    jacobians: &'r mut [Vec<f64>],
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
}

impl StageUnknowns for Equations<'_> {
    /// The residuals `w f(y) - w K`.
    fn residuals(&mut self, k: &[f64], out: &mut [f64]) {
        let components = self.components();
        for (i, (out, k_i)) in out.chunks_exact_mut(components).zip(k.chunks_exact(components)).enumerate() {
            self.take_stage(k, i);
            self.right_hand_side(i, out);
            out.iter_mut().zip(k_i).for_each(|(out, k)| *out -= k);
        }
    }

    fn factorise(&mut self, k: &[f64], lu: &mut DenseLu) -> Result<(), StepError> {
        for i in 0..self.jacobians.len() {
            self.take_stage(k, i);
            self.evaluation.jacobian(self.system, self.stage, &mut self.jacobians[i]);
        }
        factorise(lu, self.table, self.jacobians, self.components())
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

    /// It grows with the number of unknowns.
    fn round_off(&self, k: &[f64]) -> f64 {
        f64::EPSILON * max_or_nan(1e3, 8.0 * k.len() as f64)
    }
}

impl FullNewton {
    /// The workspace for s stages with n components.
    fn new(s: usize, n: usize) -> Self {
        FullNewton { newton: DampedNewton::new(s * n), jacobians: vec![vec![0.0; n * n]; s] }
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
        let Some(FullNewton { newton, jacobians }) = full_newton.as_deref_mut() else { return Ok(()) };
        let mut equations =
            Equations { system, table, t, q, p, z: z.value, least: *least, stage, evaluation, jacobians };
        newton.x.fill(0.0);
        equations.take_stage(&newton.x, 0);
        equations.stage.t = t;
        for (i, k) in newton.x.chunks_exact_mut(n).enumerate() {
            equations.right_hand_side(i, k);
        }
        newton.solve(&mut equations, newton.chances())?;
        for (c, to) in rows.right_hand_sides_mut().iter_mut().enumerate() {
            for (to, k) in to.0.iter_mut().zip(newton.x.chunks_exact(n)) {
                *to = k[c];
            }
        }
        self.solved = true;
        Ok(())
    }
}
