//! Contact Gauss collocation for sparse systems.

use super::border::Border;
use super::gauss_table::{GaussTable, MAX_STAGES};
use super::lu::LuFactors;
use super::stage_equations::{StageEquations, StepStart};
use super::stage_jacobian::StageJacobian;
use super::velocity_solver::VelocitySolver;
use crate::SparseError;
use crate::derivatives::{EvaluationPoint, FirstDerivatives};
use crate::energies::Energies;
use crate::memory::memory_limit;
use crate::monitor::{EnergyMonitor, RunProgress, StepInfo};
use crate::system::{LagrangianValue, MassSource, SparseSystem, State};
use discrete_herglotz::{InputError, StepError, StepFailure, UnresolvedStep};

/// Contact Gauss collocation with one or two stages, of order 2 or 4, for systems of any size and any local terms. The
/// stage equations are those of [`Gauss`](discrete_herglotz::gauss::Gauss):
///
/// `Q = q0 + hA V`, `Z = z0 + hA L`, `rho = 1 - hA (rho L_z)`, `rho L_v = p0 + hA (rho L_q)`.
///
/// The step is completed with the weights `hb`: `q1 = q0 + hb.V`, `z1 = z0 + hb.L`, `p1 = (p0 + hb.(rho L_q))/rho1`,
/// `sigma_d = 1/rho1`. With one stage this is the midpoint rule.
///
/// The stage velocities are found by Newton's method with faer's sparse LU, which is analysed once and factorised anew
/// only if the corrections decrease slowly. All unknowns are coupled through Z and rho. These are a border of at most
/// four columns and rows, which is eliminated by its Schur complement, so that the matrix stays sparse. Without general
/// terms rho does not depend on the unknowns, and there is no border.
///
/// ```
/// use sparse_herglotz::systems::{FputBond, fput_chain};
/// use sparse_herglotz::{SparseGauss, State};
/// let chain = fput_chain(100, FputBond { alpha: 0.0, beta: 1.0 }, -0.01)?;
/// let q: Vec<f64> = (1..=100).map(|i| (0.03 * i as f64).sin()).collect();
/// let start = State { t: 0.0, q: &q, v: &[0.0; 100], z: Some(0.0) };
/// let mut motion = SparseGauss::new(&chain, 2, 0.1, start, None)?;
/// assert!(motion.advance(100).is_ok());
/// println!("{:?}", motion.q()[50]);
/// # Ok::<(), sparse_herglotz::SparseError>(())
/// ```
pub struct SparseGauss<'a> {
    system: &'a SparseSystem,
    equations: StageEquations<'a>,
    /// Present only with general terms; otherwise `p = M v`.
    velocity_solver: Option<VelocitySolver>,
    h: f64,
    t0: f64,
    taken: usize,
    /// The number of factorisations for the velocities of states.
    velocity_factorisations: u64,
    has_action: bool,
    /// The positions, padded.
    q: Vec<f64>,
    p: Vec<f64>,
    z: f64,
    sigma: f64,
    /// The stage velocities of the last step, grouped by unknown.
    v: Vec<f64>,
    /// The velocity of a requested state.
    end_v: Vec<f64>,
    log_factor: f64,
    monitor: EnergyMonitor,
}

impl<'a> SparseGauss<'a> {
    /// Starts from a state, with 1 or 2 stages. The action z is computed if the start has one, which costs one
    /// evaluation of the energies per stage unless there are general terms. The matrix, its factors and the workspace
    /// are refused if they may need more than `memory` bytes; `None` stands for the memory that the system has
    /// available (`MemAvailable` on Linux; elsewhere there is no limit).
    ///
    /// # Errors
    /// [`InputError::Stages`] and [`InputError::Step`]; [`SparseError::Length`] and [`SparseError::NonFinite`] of
    /// the state and the masses; [`SparseError::Mass`] if an unknown has no mass, neither its own nor from a general
    /// term; [`SparseError::SingularMass`]; [`SparseError::NoAction`] for general terms and a state without the
    /// action; [`SparseError::Undefined`] if a derivative of L is not finite at the start; [`SparseError::Memory`]
    /// with the estimate.
    pub fn new(
        system: &'a SparseSystem,
        stages: usize,
        h: f64,
        start: State,
        memory: Option<usize>,
    ) -> Result<Self, SparseError> {
        if !(1..=MAX_STAGES).contains(&stages) {
            return Err(InputError::Stages { found: stages }.into());
        }
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h }.into());
        }
        start.check(system)?;
        system.check_frictionless("`SparseGauss`")?;
        system.check_unconstrained("`SparseGauss`")?;
        let general = !system.general_terms.is_empty();
        if general && start.z.is_none() {
            return Err(SparseError::NoAction);
        }
        let z = start.z.unwrap_or(0.0);
        system.check_masses(if general { MassSource::WithGeneralTerms } else { MassSource::Diagonal })?;
        SparseSystem::check_number("gamma", system.rate(start.t))?;
        let (n, limit) = (system.unknowns(), memory_limit(memory));
        let len = n.checked_mul(stages).ok_or(SparseError::Unknowns { found: n, most: usize::MAX / stages })?;
        let mut jacobian = StageJacobian::new(system)?;
        let (column_starts, rows) = jacobian.pattern.blocks(stages)?;
        let factors = LuFactors::new(column_starts, rows, limit)?;
        let padded = |x: &[f64]| [&[0.0], x, &[0.0]].concat();
        let (q, stage_v) = (padded(start.q), padded(start.v));
        let mut first = FirstDerivatives::zeros(n);
        let at = EvaluationPoint { t: start.t, q: &q, v: &stage_v, z };
        system.first_derivatives(at, LagrangianValue::Needed, &mut first);
        let defined = |unknown: usize| first.q[unknown].is_finite() && first.v[unknown].is_finite();
        if let Some(unknown) = (0..n).find(|i| !defined(*i)) {
            return Err(SparseError::Undefined { unknown });
        }
        let table = GaussTable::new(stages, h);
        let rho = table.factors([first.z; MAX_STAGES]);
        let end = table.b.iter().zip(rho).take(stages).fold(1.0, |end, (b, rho)| end - b * rho * first.z);
        let info = StepInfo { h, log_sigma: -end.ln(), order: 2 * stages as u32 };
        let monitor = EnergyMonitor::new(system, start, info, |kind| {
            if general {
                energies(&first, (start.v, &first.v), z)
            } else {
                system.energies((start.t, &q, start.v, z), kind)
            }
        });
        let velocity_solver = if general { Some(VelocitySolver::new(system, &mut jacobian, at, limit)?) } else { None };
        let v: Vec<f64> = start.v.iter().flat_map(|v| std::iter::repeat_n(*v, stages)).collect();
        let p = first.v.clone();
        let equations = StageEquations {
            system,
            table,
            jacobian,
            factors,
            border: general.then(|| Border::new(len)),
            h,
            factorisations: 0,
            iterations: 0,
            v: v.clone(),
            correction: vec![0.0; len],
            residual: vec![0.0; len],
            actions: [0.0; MAX_STAGES],
            rho: [1.0; MAX_STAGES],
            derivatives: vec![first; stages],
            stage_q: q.clone(),
            stage_v,
        };
        Ok(SparseGauss {
            system,
            equations,
            velocity_solver,
            h,
            t0: start.t,
            taken: 0,
            velocity_factorisations: 0,
            has_action: start.z.is_some(),
            q,
            p,
            z,
            sigma: 1.0,
            v,
            end_v: start.v.to_vec(),
            log_factor: 0.0,
            monitor,
        })
    }

    /// Takes the given number of steps.
    ///
    /// # Errors
    /// [`StepFailure`] with the number of steps taken before the failure and the cause: [`StepError::NotConverged`],
    /// [`StepError::Singular`], [`StepError::NonFinite`], [`StepError::StageFactor`] or [`StepError::SigmaVanished`].
    /// The state is that before the step that failed.
    pub fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
            if self.monitor.is_due(self.taken) {
                self.check_energy();
            }
        }
        Ok(())
    }

    /// Checks the energy. With general terms this requires the velocity; if it cannot be computed, the check is
    /// omitted.
    #[cold]
    fn check_energy(&mut self) {
        let Ok(State { t, .. }) = self.state() else { return };
        let progress = RunProgress { t, log_factor: self.log_factor, taken: self.taken };
        let SparseGauss { system, velocity_solver, q, p, z, end_v, monitor, .. } = self;
        monitor.check(system, progress, |t, kind| match velocity_solver {
            Some(solver) => energies(solver.evaluate(system, (t, q, *z), end_v), (end_v, p), *z),
            None => system.energies((t, q, end_v, *z), kind),
        });
    }

    /// The first step at which the energy showed that the steps do not resolve the motion, if there is one: results
    /// from this step on may be wrong.
    ///
    /// The energy `E_L`, which is multiplied by the conformal factor if L does not depend on time, is checked after 4,
    /// 16, 64 and 256 steps, every 1024 steps, and by this call. Without the action, or with a time-dependent gamma and
    /// no general terms, the check is that `T + V` does not grow while the drag dissipates. The check detects nothing
    /// if the potential depends on time, or with general terms any part of L, nor from `T + V` if `gamma h > 0`.
    /// Without general terms and for a constant gamma the conformal factor of a step is also compared with
    /// `e^(gamma h)`.
    pub fn unresolved(&mut self) -> Option<UnresolvedStep> {
        if self.monitor.can_check(self.taken) {
            self.check_energy();
        }
        self.monitor.unresolved()
    }

    /// The time.
    pub fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    /// The positions.
    pub fn q(&self) -> &[f64] {
        &self.q[1..=self.system.unknowns()]
    }

    /// The momenta `p = L_v`.
    pub fn p(&self) -> &[f64] {
        &self.p
    }

    /// The action, if the start has one.
    pub fn z(&self) -> Option<f64> {
        self.has_action.then_some(self.z)
    }

    /// `sigma_d` of the last step; 1 before the first step.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The number of numeric factorisations so far, including those for the velocity of a state.
    pub fn factorisations(&self) -> u64 {
        self.equations.factorisations + self.velocity_factorisations
    }

    /// The number of Newton iterations so far; each has one linear solve and one evaluation of the derivatives of L per
    /// stage.
    pub fn iterations(&self) -> u64 {
        self.equations.iterations
    }

    /// The state. With general terms the velocity is computed from `p = L_v` by Newton's method.
    ///
    /// # Errors
    /// [`StepError`] if no velocity is found. The motion can be continued, since the steps do not use this velocity.
    pub fn state(&mut self) -> Result<State<'_>, StepError> {
        let (n, t) = (self.system.unknowns(), self.time());
        let SparseGauss { system, equations, velocity_solver, velocity_factorisations, q, p, z, end_v, .. } = self;
        match velocity_solver {
            None => {
                for (i, (v, p)) in end_v.iter_mut().zip(p).enumerate() {
                    *v = *p / system.mass(i);
                }
            }
            Some(solver) => {
                solver.solve(system, &mut equations.jacobian, (t, q, *z), p, end_v, velocity_factorisations)?;
            }
        }
        Ok(State { t, q: &self.q[1..=n], v: &self.end_v, z: self.z() })
    }

    fn step(&mut self) -> Result<(), StepError> {
        let GaussTable { s, extrapolation, .. } = self.equations.table;
        // The initial guess is extrapolated from the stages of the last step, or with one stage from those of the last
        // two steps.
        for (next, v) in self.equations.v.chunks_exact_mut(s).zip(self.v.chunks_exact(s)) {
            match (self.taken, s) {
                (0, _) => next.copy_from_slice(v),
                (_, 1) => next[0] = 2.0 * v[0] - next[0],
                _ => {
                    for (next, row) in next.iter_mut().zip(&extrapolation) {
                        *next = row.iter().zip(v).map(|(a, v)| a * v).sum();
                    }
                }
            }
        }
        let (actions, rho) = (self.equations.actions, self.equations.rho);
        let done = self.solve().and_then(|()| self.complete_step());
        if done.is_err() {
            // Restores the data from before the step, so that it can be retried.
            let equations = &mut self.equations;
            equations.v.copy_from_slice(&self.v);
            (equations.actions, equations.rho) = (actions, rho);
            equations.factors.discard();
        }
        done
    }

    /// Solves for the stage velocities, and evaluates L and its first derivatives there.
    fn solve(&mut self) -> Result<(), StepError> {
        let start = StepStart { t: self.time(), q: &self.q, p: &self.p, z: self.z };
        self.equations.solve(start)?;
        let value = if self.has_action { LagrangianValue::Needed } else { LagrangianValue::NotNeeded };
        self.equations.evaluate(start, value);
        Ok(())
    }

    /// Completes the step with the weighted sums over its stages.
    fn complete_step(&mut self) -> Result<(), StepError> {
        let StageEquations { table, border, rho: stage_rho, derivatives, v, .. } = &mut self.equations;
        let (GaussTable { s, b, .. }, stage_rho) = (&*table, *stage_rho);
        let least = stage_rho[..*s].iter().copied().fold(f64::INFINITY, f64::min);
        if least.is_nan() || least <= 0.0 {
            return Err(StepError::StageFactor { rho: least });
        }
        if self.has_action && border.is_none() {
            // L is affine in z: its stages were evaluated at the action of the start, and are corrected here by the
            // actions of the stages.
            let stage_values =
                |f: fn(&FirstDerivatives) -> f64| std::array::from_fn(|j| derivatives.get(j).map_or(0.0, f));
            let actions = table.actions(stage_values(|l| l.z), stage_values(|l| l.l));
            derivatives.iter_mut().zip(actions).for_each(|(stage, action)| stage.l += stage.z * action);
        }
        let stages = || derivatives.iter().zip(*b).zip(stage_rho);
        let rho = stages().fold(1.0, |sum, ((l, b), rho)| sum - b * rho * l.z);
        if rho.is_nan() || rho <= 0.0 {
            return Err(StepError::SigmaVanished { sigma: 1.0 / rho });
        }
        let action = stages().map(|((l, b), _)| b * l.l).sum::<f64>();
        for (i, p) in self.p.iter_mut().enumerate() {
            let force: f64 = stages().map(|((l, b), rho)| b * rho * l.q[i]).sum();
            *p = (*p + force) / rho;
        }
        for (q, v) in self.q.iter_mut().skip(1).zip(v.chunks_exact(*s)) {
            *q += v.iter().zip(b).map(|(v, b)| b * v).sum::<f64>();
        }
        if self.has_action {
            self.z += action;
        }
        self.sigma = 1.0 / rho;
        self.log_factor -= rho.ln();
        std::mem::swap(&mut self.v, v);
        self.taken += 1;
        Ok(())
    }
}

/// The energies of a Lagrangian, from its first derivatives, the velocity and the momentum. The kinetic energy is
/// `|p.v|/2`, as for a quadratic form in the velocity.
fn energies(first: &FirstDerivatives, (v, p): (&[f64], &[f64]), z: f64) -> Energies {
    let twice_kinetic: f64 = p.iter().zip(v).map(|(p, v)| p * v).sum();
    let terms = first.l.abs() + (first.z * z).abs();
    Energies { total: twice_kinetic - first.l, kinetic: 0.5 * twice_kinetic.abs(), terms }
}
