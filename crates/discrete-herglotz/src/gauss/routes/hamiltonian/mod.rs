//! Steps of contact Gauss collocation for a contact Hamiltonian.

mod finish;
mod iteration;
mod kernel;
mod newton;
mod route;
mod rows;
mod simplified_newton;
mod stage;
mod tangent;

use crate::gauss::limits::{MIN_JACOBIAN_AGE, SLOW_NEWTON};
use crate::gauss::resolution::tail::Tail;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::increments::Increments;
use crate::gauss::system::{CollocationSystem, PointRef, SystemAtPoints};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::{CompensatedSum, copy_values};
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::Stages;
use contact_geom::numbers::max_abs_or_nan;
use finish::{Extrapolate, FinishStep};
pub(crate) use kernel::HamiltonianKernel;
use kernel::IterationStart;
use newton::FullNewton;
use rows::StageRows;
use simplified_newton::SimplifiedNewton;
use stage::{Evaluation, Stage};
pub(crate) use tangent::{StepDerivatives, step_derivatives, step_jacobian};

/// The number of steps for which `H_pp` is kept: its evaluation by dual numbers costs up to as much as a step.
const PP_AGE: u32 = 8;

/// The state and the workspace of a step.
///
/// The method is Gauss collocation of the symplectified motion, that of `rho H(t, q, P / rho, z)` in the canonical
/// variables (q, P) and (z, -rho), with rho = 1 at the start of each step:
///
/// `Q = q0 + hA H_p`, `P = p0 - hA (rho H_q)`, `Z = z0 + hA (p . H_p - H)`, `rho = 1 + hA (rho H_z)`, `p = P / rho`.
///
/// It is symplectic there and commutes with the scaling of (P, rho), so that its reduction to T\*Q x R is conformally
/// contact with `sigma_d = 1 / rho`, whatever the rank of `H_pp`. The equations are solved by fixed-point iteration,
/// with the values of the right-hand sides at the stages as the unknowns.
///
/// With an applied force f, `f - H_q` is in the place of `-H_q`.
pub(crate) struct HamiltonianStages {
    table: StageTable,
    arch: Instructions,
    rows: StageRows,
    q: Vec<CompensatedSum>,
    p: Vec<CompensatedSum>,
    z: CompensatedSum,
    /// `1 - rho` at the end of the last step.
    one_minus_rho: f64,
    /// `H_pp` at an earlier state by columns, by which velocities follow momenta within an iteration, and the number of
    /// steps since.
    pp: Vec<f64>,
    pp_age: u32,
    /// The least values with which changes of momenta and of the action are compared: 0, and in a step whose iteration does
    /// not converge otherwise, those of which the round-off of `h H_q` and `h (p . H_p - H)` is one unit.
    least: [f64; 2],
    /// Whether the right-hand sides are those of the last step.
    warm: bool,
    /// Whether the right-hand sides are the solution of the next step.
    solved: bool,
    /// Simplified Newton iteration, used while the fixed-point iteration does not converge.
    newton: Option<Box<SimplifiedNewton>>,
    suspended_newton: Option<Box<SimplifiedNewton>>,
    /// The number of steps since the Jacobian of the simplified Newton iteration was computed.
    age: u32,
    full_newton: Option<Box<FullNewton>>,
    tail: Tail,
    defect: f64,
    /// The velocity at the last stage of the last successful step, or at the start.
    known: Vec<f64>,
    evaluations: u64,
    /// See [`set_tolerance`](crate::gauss::routes::StageRoute::set_tolerance).
    tolerance: f64,
    increments: Increments,
    /// The stage at which H is evaluated outside of the iteration, and the workspace for it.
    stage: Stage,
    evaluation: Evaluation,
}

impl HamiltonianStages {
    /// The steps from a state `(q, p, z)` with its velocity.
    pub fn new(system: &dyn SystemAtPoints, table: StageTable, state: PointRef<'_>, v: &[f64]) -> Self {
        let n = state.q.len();
        let sums = |x: &[f64]| x.iter().map(|x| CompensatedSum::from(*x)).collect();
        HamiltonianStages {
            tail: Tail::new(table.s),
            table,
            arch: Instructions::new(),
            rows: StageRows::zeros(n),
            q: sums(state.q),
            p: sums(state.v),
            z: state.z.into(),
            one_minus_rho: 0.0,
            pp: vec![0.0; n * n],
            pp_age: PP_AGE,
            least: [0.0; 2],
            warm: false,
            solved: false,
            newton: None,
            suspended_newton: None,
            age: 0,
            full_newton: None,
            defect: 0.0,
            known: v.to_vec(),
            evaluations: 0,
            tolerance: 0.0,
            increments: Increments::zeros(n),
            stage: Stage::zeros(n),
            evaluation: Evaluation::of(system),
        }
    }

    /// The number of components of y = (q, P, z, 1 - rho).
    fn components(&self) -> usize {
        2 * self.q.len() + 2
    }

    /// Takes one step from the time `t`; on failure the state is unchanged.
    fn take_step(&mut self, system: &dyn CollocationSystem, t: f64) -> IterationOutcome {
        let (solved, warm) = (std::mem::take(&mut self.solved), std::mem::take(&mut self.warm));
        if !solved {
            self.renew_pp(system, t);
            if warm {
                self.arch.dispatch(Extrapolate { stages: self });
            }
            self.keep_iterate(warm);
        }
        self.least = [0.0; 2];
        let mut start = match (solved, warm) {
            (true, _) => IterationStart::Solution,
            (_, true) => IterationStart::Extrapolated,
            _ => {
                self.rest_stages();
                IterationStart::AtRest
            }
        };
        loop {
            let (outcome, iteration) = system.solve_hamiltonian_stages(self.arch, t, start, self);
            match outcome {
                IterationOutcome::Done if solved => return self.finish_step(f64::INFINITY),
                IterationOutcome::Done => {
                    let outcome = self.finish_step(iteration.first());
                    self.age = self.age.saturating_add(1);
                    if self.newton.is_some() && iteration.count() > SLOW_NEWTON && self.age > MIN_JACOBIAN_AGE {
                        self.renew(system, t);
                    }
                    return outcome;
                }
                // The convergence test starts again.
                IterationOutcome::Slow { .. } if self.least == [0.0; 2] && self.admit_round_off(system, t) => {
                    start = IterationStart::LastIterate;
                }
                refused => return refused,
            }
        }
    }

    /// The end of the step from its stages, and its defect; `first` is the relative error of its predictor.
    fn finish_step(&mut self, first: f64) -> IterationOutcome {
        self.arch.dispatch(FinishStep { stages: self, first })
    }

    /// Admits changes of the size of the round-off of the forces and of L at the start of the step, as at an equilibrium,
    /// where forces cancel and momenta vanish. Returns whether there is any.
    #[cold]
    #[inline(never)]
    fn admit_round_off(&mut self, system: &dyn SystemAtPoints, t: f64) -> bool {
        self.take_state(t);
        let Stage { q, scaled_p: p, z, .. } = &self.stage;
        let of_gradient = &mut self.evaluation.derivatives.gradient;
        let of_l = system.rounding_at_state(t, PointRef { q, v: &self.known, z: *z }, p, of_gradient);
        let least =
            [max_abs_or_nan(of_gradient.q.iter().copied()), of_l].map(|once| self.table.h.abs() * once / f64::EPSILON);
        let is_usable = least.iter().all(|e| e.is_finite()) && least.iter().any(|e| *e > 0.0);
        if is_usable {
            self.least = least;
        }
        is_usable
    }

    /// Evaluates `H_pp` at the state, where it is old.
    fn renew_pp(&mut self, system: &dyn SystemAtPoints, t: f64) {
        self.pp_age += 1;
        if self.pp_age > PP_AGE {
            self.pp_age = 0;
            self.evaluate_pp(system, t);
        }
    }

    #[cold]
    #[inline(never)]
    fn evaluate_pp(&mut self, system: &dyn SystemAtPoints, t: f64) {
        self.take_state(t);
        let derivatives = &mut self.evaluation.derivatives;
        let known = system.hamiltonian_derivatives(t, self.stage.phase_point(), derivatives);
        let pp = derivatives.vv.as_slice();
        // Where it is not finite, velocities follow in the next evaluation.
        if known && pp.iter().all(|e| e.is_finite()) {
            self.pp.copy_from_slice(pp);
        } else {
            self.pp.fill(0.0);
        }
    }

    /// Sets the stage of the workspace to the state, where rho = 1.
    fn take_state(&mut self, t: f64) {
        let stage = &mut self.stage;
        copy_values(&self.q, &mut stage.q);
        copy_values(&self.p, &mut stage.scaled_p);
        (stage.t, stage.z, stage.one_minus_rho) = (t, self.z.value, 0.0);
        stage.set_momentum();
    }

    /// The stages of a motion at rest, from which the iteration of a first step starts.
    fn rest_stages(&mut self) {
        let n = self.q.len();
        // The velocities, which come first, are those of the last evaluation.
        let positions_and_momenta = &mut self.rows.stages_mut()[n..];
        for (stages, start) in positions_and_momenta.iter_mut().zip(self.q.iter().chain(&self.p).chain([&self.z])) {
            *stages = Stages([start.value; MAX_STAGES]);
        }
        if let Some(one_minus_rho) = positions_and_momenta.last_mut() {
            *one_minus_rho = Stages::ZERO;
        }
    }
}
