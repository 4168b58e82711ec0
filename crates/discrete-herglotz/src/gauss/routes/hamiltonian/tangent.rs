//! The derivatives of a step in the state at its start, in parameters, in its time and in its length.

use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::newton::Stage;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::tables::stage_table::StageTable;
use crate::integration::QuantityDerivatives;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::solve::DenseLu;
use crate::{Problem, StepError};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, Lagrangian, PhasePoint};
use pulp::{Simd, WithSimd};

/// The derivatives of the end of a step.
pub(crate) struct StepDerivatives<const N: usize> {
    /// In the coordinates q, p, z of its start.
    pub state: Vec<ChartVector<N>>,
    /// In each parameter, in the time of its start, and in its length; empty if not requested.
    pub sources: Vec<ChartVector<N>>,
}

/// The derivatives of H, of its gradient and of the force at a stage, in each parameter and in the time.
pub(crate) type Explicit<'e, const N: usize> = &'e mut dyn FnMut(f64, &PhasePoint<N>) -> Vec<QuantityDerivatives<N>>;

/// The derivative of the end of a step in (q, p, z) at its start, as a matrix with the coordinates in this order.
///
/// # Errors
/// Those of the step.
pub(crate) fn step_jacobian<L: Lagrangian<N>, const N: usize>(
    problem: &Problem<'_, L, N>,
    s: usize,
    h: f64,
    at: (f64, &PhasePoint<N>),
) -> Result<DMatrix<f64>, StepError> {
    let columns = step_derivatives(problem.lagrangian, s, h, at, None)?.state;
    Ok(DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| columns[j].component(i)))
}

/// The derivatives of a step of length h from a time and a state; in parameters, time and length if `explicit` is given.
///
/// The right-hand sides K of the stage equations `K = f(t + h c, y0 + hA K; theta)` change by the solution of
/// `(1 - hA (x) J) dK = J (dy0 + dh A K) + f_theta dtheta + f_t (dt + c dh)` with the Jacobian J of f at each stage. The
/// unknowns are `h b K`, so that a change of h also adds `b K dh`, and `dh A K` is no term of its own.
///
/// # Errors
/// Those of the step.
pub(crate) fn step_derivatives<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    s: usize,
    h: f64,
    (t, start): (f64, &PhasePoint<N>),
    explicit: Option<Explicit<'_, N>>,
) -> Result<StepDerivatives<N>, StepError> {
    let v = SVector::zeros();
    let mut stages = HamiltonianStages::new(lagrangian, StageTable::new(s, h), start, &v);
    let outcome = Instructions::new().dispatch(OneStep { stages: &mut stages, t });
    if outcome != IterationOutcome::Done {
        stages = HamiltonianStages::new(lagrangian, StageTable::new(s, h), start, &v);
        stages.solve(t)?;
        match Instructions::new().dispatch(OneStep { stages: &mut stages, t }) {
            IterationOutcome::Done => {}
            refused => return Err(refused.into()),
        }
    }
    stages.derivatives_of_last_step(t, start, explicit)
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
    fn derivatives_of_last_step(
        &self,
        t: f64,
        start: &PhasePoint<N>,
        explicit: Option<Explicit<'_, N>>,
    ) -> Result<StepDerivatives<N>, StepError> {
        let (s, n) = (self.table.s, Self::COMPONENTS);
        let weight = |i: usize| self.table.weights.0[i];
        let stages: Vec<Stage<N>> = (0..s).map(|i| self.stage_of_last_step(t, i)).collect();
        let mut jacobians = vec![vec![0.0; n * n]; s];
        for (stage, jacobian) in stages.iter().zip(&mut jacobians) {
            self.jacobian(stage, jacobian);
        }
        let mut lu = DenseLu::new(s * n);
        lu.factorise(|row, column| {
            let ((i, c), (j, e)) = ((row / n, row % n), (column / n, column % n));
            let own = if row == column { 1.0 } else { 0.0 };
            own - weight(i) * self.table.m.0[j].0[i] * jacobians[i][e * n + c]
        })?;
        // The momentum at the end is `P / rho`.
        let sum = |of: &dyn Fn(usize) -> f64| (0..s).map(of).sum::<f64>();
        let rho = 1.0 - sum(&|i| self.rate.0[i]);
        let p = SVector::<f64, N>::from_fn(|d, _| start.p[d] + sum(&|i| self.force[d].0[i])) / rho;
        // The change of the end from that of the start and the known terms of that of the right-hand sides.
        let mut end = |start: &ChartVector<N>, mut change: Vec<f64>| {
            lu.solve(&mut change)?;
            let total = |c: usize| sum(&|i| change[i * n + c]);
            let fallen = total(2 * N + 1);
            let end = ChartVector {
                x: start.x + SVector::from_fn(|d, _| total(d)),
                y: (start.y + SVector::from_fn(|d, _| total(N + d)) + p * fallen) / rho,
                z: start.z + total(2 * N),
            };
            if end.is_finite() { Ok(end) } else { Err(StepError::NonFinite) }
        };
        let mut state = Vec::with_capacity(2 * N + 1);
        for column in 0..=2 * N {
            let unit = ChartVector::from_fn(|i| f64::from(u8::from(i == column)));
            let known = (0..s * n).map(|row| weight(row / n) * jacobians[row / n][column * n + row % n]);
            state.push(end(&unit, known.collect())?);
        }
        let mut sources = Vec::new();
        if let Some(explicit) = explicit {
            let still = ChartVector::from_fn(|_| 0.0);
            let at_stages: Vec<_> = stages.iter().map(|stage| explicit(stage.t, &stage.phase_point())).collect();
            let count = at_stages.first().map_or(0, Vec::len);
            let mut known = Vec::new();
            for quantity in 0..count {
                known = vec![0.0; s * n];
                for (i, (stage, of)) in stages.iter().zip(&at_stages).enumerate() {
                    let out = &mut known[i * n..][..n];
                    stage.explicit_change(&of[quantity], out);
                    out.iter_mut().for_each(|out| *out *= weight(i));
                }
                sources.push(end(&still, known.clone())?);
            }
            // Those of the time are the last ones.
            let slope = |row: usize| {
                let (i, c) = (row / n, row % n);
                (self.right_hand_side_of_last_step(i, c) + self.table.times.0[i] * known[row]) / self.table.h
            };
            sources.push(end(&still, (0..s * n).map(slope).collect())?);
        }
        Ok(StepDerivatives { state, sources })
    }

    fn stage_of_last_step(&self, t: f64, i: usize) -> Stage<N> {
        let vector = |of: &dyn Fn(usize) -> f64| SVector::from_fn(|d, _| of(d));
        let one_minus_rho = self.one_minus_rho_stages.0[i];
        Stage {
            t: t + self.table.times.0[i],
            q: vector(&|d| self.x[d].0[i]),
            scaled_p: vector(&|d| self.p_stages[d].0[i] * (1.0 - one_minus_rho)),
            z: self.z_stages.0[i],
            one_minus_rho,
        }
    }

    /// A component of the right-hand side at a stage, multiplied by the weight.
    fn right_hand_side_of_last_step(&self, i: usize, c: usize) -> f64 {
        match c {
            c if c < N => self.moved[c].0[i],
            c if c < 2 * N => self.force[c - N].0[i],
            c if c == 2 * N => self.l.0[i],
            _ => self.rate.0[i],
        }
    }
}

impl<const N: usize> Stage<N> {
    /// The change of the right-hand side for a fixed stage, from that of H.
    fn explicit_change(&self, of: &QuantityDerivatives<N>, out: &mut [f64]) {
        let QuantityDerivatives { l: of_h, gradient, force } = of;
        let rho = self.rho();
        for d in 0..N {
            out[d] = gradient.y[d];
            out[N + d] = rho * (force[d] - gradient.x[d]);
        }
        out[2 * N] = self.phase_point().p.dot(&gradient.y) - of_h;
        out[2 * N + 1] = -rho * gradient.z;
    }
}
