//! The derivatives of a step in the state at its start, in parameters, in its time and in its length.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::newton::factorise;
use crate::gauss::routes::hamiltonian::stage::Stage;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::product::dot;
use crate::gauss::system::{CollocationSystem, PointRef, SystemAtPoints, Typed};
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::lanes::forget_branches;
use crate::solve::DenseLu;
use crate::{Components, ExplicitDerivatives, Problem, State, StepError};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{Lagrangian, PhasePoint};

/// The derivatives of the end of a step.
pub(crate) struct StepDerivatives {
    /// In the coordinates q, p, z of its start.
    pub state: Vec<Components>,
    /// In each parameter, in the time of its start, and in its length; empty if not requested.
    pub sources: Vec<Components>,
}

/// The derivatives of H, of its gradient and of the force at a stage, in each parameter and in the time.
type Explicit<'e> = &'e mut dyn FnMut(f64, &State) -> Vec<ExplicitDerivatives>;

/// The same derivatives as [`StepDerivatives`], with the coordinates q, p, z in this order.
struct Columns {
    state: Vec<Vec<f64>>,
    sources: Vec<Vec<f64>>,
}

/// The derivative of the end of a step in (q, p, z) at its start, as a matrix with the coordinates in this order.
///
/// # Errors
/// Those of the step.
pub(crate) fn step_jacobian<L: Lagrangian<N>, const N: usize>(
    problem: &Problem<'_, L, N>,
    s: usize,
    h: f64,
    (t, start): (f64, &PhasePoint<N>),
) -> Result<DMatrix<f64>, StepError> {
    let system = Typed::<L, N>(problem.lagrangian);
    let columns = derivatives(&system, StageTable::new(s, h), (t, PointRef::of_state(start)), None)?.state;
    Ok(DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| columns[j][i]))
}

/// The derivatives of a step of length h from a time and a state; in parameters, time and length if `explicit` is given.
///
/// The right-hand sides K of the stage equations `K = f(t + h c, y0 + hA K; theta)` change by the solution of
/// `(1 - hA (x) J) dK = J (dy0 + dh A K) + f_theta dtheta + f_t (dt + c dh)` with the Jacobian J of f at each stage. The
/// unknowns are `h b K`, so that a change of h also adds `b K dh`, and `dh A K` is no term of its own.
///
/// # Errors
/// Those of the step.
pub(crate) fn step_derivatives(
    system: &dyn CollocationSystem,
    s: usize,
    h: f64,
    (t, start): (f64, &State),
    explicit: Option<Explicit<'_>>,
) -> Result<StepDerivatives, StepError> {
    let n = start.q.len();
    let from = PointRef { q: &start.q, v: &start.p, z: start.z };
    let columns = derivatives(system, StageTable::new(s, h), (t, from), explicit)?;
    let of_column = |of: &Vec<f64>| Components { x: of[..n].into(), y: of[n..2 * n].into(), z: of[2 * n] };
    let [state, sources] = [columns.state, columns.sources].map(|columns| columns.iter().map(of_column).collect());
    Ok(StepDerivatives { state, sources })
}

/// The derivatives of a step from a time and a state.
fn derivatives(
    system: &dyn CollocationSystem,
    table: StageTable,
    (t, start): (f64, PointRef<'_>),
    explicit: Option<Explicit<'_>>,
) -> Result<Columns, StepError> {
    let (s, h, v) = (table.s, table.h, vec![0.0; start.q.len()]);
    let mut stages = HamiltonianStages::new(system, table, start, &v);
    forget_branches();
    if stages.take_step(system, t) != IterationOutcome::Done {
        stages = HamiltonianStages::new(system, StageTable::new(s, h), start, &v);
        stages.solve(system, t)?;
        forget_branches();
        match stages.take_step(system, t) {
            IterationOutcome::Done => {}
            refused => return Err(refused.into()),
        }
    }
    stages.derivatives_of_last_step(system, t, start.v, explicit)
}

impl HamiltonianStages {
    /// The derivatives of the last step, which began at the time t with the momentum p.
    fn derivatives_of_last_step(
        &mut self,
        system: &dyn SystemAtPoints,
        t: f64,
        start_p: &[f64],
        explicit: Option<Explicit<'_>>,
    ) -> Result<Columns, StepError> {
        let (s, n, components) = (self.table.s, self.q.len(), self.components());
        let stages: Vec<Stage> = (0..s).map(|i| self.stage_of_last_step(t, i)).collect();
        let mut jacobians = vec![vec![0.0; components * components]; s];
        for (stage, jacobian) in stages.iter().zip(&mut jacobians) {
            self.evaluation.jacobian(system, stage, jacobian);
        }
        let mut lu = DenseLu::new(s * components);
        factorise(&mut lu, &self.table, &jacobians, components)?;
        let (weights, rows) = (&self.table.weights.0, &self.rows);
        // The momentum at the end is `P / rho`.
        let sum = |of: &dyn Fn(usize) -> f64| (0..s).map(of).sum::<f64>();
        let rho = 1.0 - sum(&|i| rows.rate().0[i]);
        let p: Vec<f64> = (0..n).map(|d| (start_p[d] + sum(&|i| rows.force()[d].0[i])) / rho).collect();
        // The change of the end from that of the start and the known terms of that of the right-hand sides.
        let mut end = |start: &dyn Fn(usize) -> f64, mut change: Vec<f64>| {
            lu.solve(&mut change)?;
            let total = |c: usize| sum(&|i| change[i * components + c]);
            let fallen = total(2 * n + 1);
            let mut end = vec![0.0; 2 * n + 1];
            for d in 0..n {
                end[d] = start(d) + total(d);
                end[n + d] = (start(n + d) + total(n + d) + p[d] * fallen) / rho;
            }
            end[2 * n] = start(2 * n) + total(2 * n);
            if end.iter().all(|e| e.is_finite()) { Ok(end) } else { Err(StepError::NonFinite) }
        };
        let mut state = Vec::with_capacity(2 * n + 1);
        for column in 0..=2 * n {
            let unit = |i: usize| f64::from(u8::from(i == column));
            let known = (0..s * components).map(|row| {
                let (i, c) = (row / components, row % components);
                weights[i] * jacobians[i][column * components + c]
            });
            state.push(end(&unit, known.collect())?);
        }
        let mut sources = Vec::new();
        if let Some(explicit) = explicit {
            let still = |_: usize| 0.0;
            let at_stage = |stage: &Stage| {
                let x = stage.phase_point();
                explicit(stage.t, &State { q: x.q.into(), p: x.v.into(), z: x.z })
            };
            let at_stages: Vec<_> = stages.iter().map(at_stage).collect();
            let count = at_stages.first().map_or(0, Vec::len);
            let mut known = Vec::new();
            for quantity in 0..count {
                known = vec![0.0; s * components];
                for (i, (stage, of)) in stages.iter().zip(&at_stages).enumerate() {
                    let out = &mut known[i * components..][..components];
                    stage.explicit_change(&of[quantity], out);
                    out.iter_mut().for_each(|out| *out *= weights[i]);
                }
                sources.push(end(&still, known.clone())?);
            }
            // Those of the time are the last ones.
            let slope = |row: usize| {
                let (i, c) = (row / components, row % components);
                (rows.right_hand_sides()[c].0[i] + self.table.times.0[i] * known[row]) / self.table.h
            };
            sources.push(end(&still, (0..s * components).map(slope).collect())?);
        }
        Ok(Columns { state, sources })
    }

    fn stage_of_last_step(&self, t: f64, i: usize) -> Stage {
        let (rows, mut stage) = (&self.rows, Stage::zeros(self.q.len()));
        stage.t = t + self.table.times.0[i];
        stage.z = rows.z().0[i];
        stage.one_minus_rho = rows.one_minus_rho().0[i];
        let rho = stage.rho();
        for d in 0..self.q.len() {
            stage.q[d] = rows.x()[d].0[i];
            stage.scaled_p[d] = rows.p()[d].0[i] * rho;
        }
        stage.set_momentum();
        stage
    }
}

impl Stage {
    /// The change of the right-hand side for a fixed stage, from that of H.
    fn explicit_change(&self, of: &ExplicitDerivatives, out: &mut [f64]) {
        let ExplicitDerivatives { l: value, gradient, force } = of;
        let (n, rho) = (force.len(), self.rho());
        for d in 0..n {
            out[d] = gradient.y[d];
            out[n + d] = rho * (force[d] - gradient.x[d]);
        }
        out[2 * n] = dot(self.phase_point().v, &gradient.y) - value;
        out[2 * n + 1] = -rho * gradient.z;
    }
}
