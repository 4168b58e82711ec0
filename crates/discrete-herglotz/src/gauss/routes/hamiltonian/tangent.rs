//! The derivative of a step in the state at its start.

use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::newton::Stage;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::solve::DenseLu;
use crate::{Problem, StepError};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{Lagrangian, PhasePoint};
use pulp::{Simd, WithSimd};

/// The derivative of the end of a step in (q, p, z) at its start, as a matrix with the coordinates in this order.
///
/// The right-hand sides K of the stage equations `K = f(y0 + hA K)` change by the solution of
/// `(1 - hA (x) J) dK = J dy0` with the Jacobian J of f at each stage.
///
/// # Errors
/// Those of the step.
pub(crate) fn step_jacobian<L: Lagrangian<N>, const N: usize>(
    problem: &Problem<'_, L, N>,
    s: usize,
    h: f64,
    (t, start): (f64, &PhasePoint<N>),
) -> Result<DMatrix<f64>, StepError> {
    let v = SVector::zeros();
    let mut stages = HamiltonianStages::new(problem.lagrangian, StageTable::new(s, h), start, &v);
    let outcome = Instructions::new().dispatch(OneStep { stages: &mut stages, t });
    if outcome != IterationOutcome::Done {
        stages = HamiltonianStages::new(problem.lagrangian, StageTable::new(s, h), start, &v);
        stages.solve(t)?;
        match Instructions::new().dispatch(OneStep { stages: &mut stages, t }) {
            IterationOutcome::Done => {}
            refused => return Err(refused.into()),
        }
    }
    stages.derivative_of_last_step(t, start)
}

/// One step, compiled for one instruction set.
struct OneStep<'b, 'a, L, const N: usize> {
    stages: &'b mut HamiltonianStages<'a, L, N>,
    t: f64,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for OneStep<'_, '_, L, N> {
    type Output = IterationOutcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> IterationOutcome {
        forget_branches();
        self.stages.take_step::<S>(self.t)
    }
}

impl<L: Lagrangian<N>, const N: usize> HamiltonianStages<'_, L, N> {
    fn derivative_of_last_step(&self, t: f64, start: &PhasePoint<N>) -> Result<DMatrix<f64>, StepError> {
        let (s, n, size) = (self.table.s, Self::COMPONENTS, 2 * N + 1);
        let weight = |i: usize| self.table.weights.0[i];
        let jacobians: Vec<Vec<f64>> = (0..s)
            .map(|i| {
                let vector = |of: &dyn Fn(usize) -> f64| SVector::from_fn(|d, _| of(d));
                let one_minus_rho = self.one_minus_rho_stages.0[i];
                let stage = Stage {
                    t: t + self.table.times.0[i],
                    q: vector(&|d| self.x[d].0[i]),
                    scaled_p: vector(&|d| self.p_stages[d].0[i] * (1.0 - one_minus_rho)),
                    z: self.z_stages.0[i],
                    one_minus_rho,
                };
                let mut jacobian = vec![0.0; n * n];
                self.jacobian(&stage, &mut jacobian);
                jacobian
            })
            .collect();
        let mut lu = DenseLu::new(s * n);
        lu.factorise(|row, column| {
            let ((i, c), (j, e)) = ((row / n, row % n), (column / n, column % n));
            let own = if row == column { 1.0 } else { 0.0 };
            own - weight(i) * self.table.m.0[j].0[i] * jacobians[i][e * n + c]
        })?;
        // The momentum at the end is `P / rho`.
        let sum = |of: &dyn Fn(usize) -> f64| (0..s).map(of).sum::<f64>();
        let rho = 1.0 - sum(&|i| self.rate.0[i]);
        let scaled_p = SVector::<f64, N>::from_fn(|d, _| start.p[d] + sum(&|i| self.force[d].0[i]));
        let mut derivative = DMatrix::identity(size, size);
        let mut change = vec![0.0; s * n];
        for column in 0..size {
            for (i, change) in change.chunks_exact_mut(n).enumerate() {
                for (c, change) in change.iter_mut().enumerate() {
                    *change = weight(i) * jacobians[i][column * n + c];
                }
            }
            lu.solve(&mut change)?;
            let total = |c: usize| sum(&|i| change[i * n + c]);
            let fallen = total(2 * N + 1);
            for d in 0..N {
                derivative[(d, column)] += total(d);
                let own = if column == N + d { 1.0 } else { 0.0 };
                derivative[(N + d, column)] = (own + total(N + d) + scaled_p[d] * fallen / rho) / rho;
            }
            derivative[(2 * N, column)] += total(2 * N);
        }
        if derivative.iter().all(|e| e.is_finite()) { Ok(derivative) } else { Err(StepError::NonFinite) }
    }
}
