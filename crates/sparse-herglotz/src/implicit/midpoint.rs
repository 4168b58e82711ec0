//! The implicit midpoint rule for sparse systems.

use super::conjugate_gradients::ConjugateGradients;
use super::max_norm::max_norm;
use super::midpoint_matrix::MidpointMatrix;
use super::newton_convergence::{NewtonConvergence, NewtonDecision};
use crate::SparseError;
use crate::blocks::BLOCK_SIZE;
use crate::kick::KickFactor;
use crate::monitor::{EnergyMonitor, RunProgress, StepInfo};
use crate::system::{MassSource, SparseSystem, State};
use discrete_herglotz::{InputError, StepError, StepFailure, UnresolvedStep, solve::ITERATION_LIMIT};

/// The symmetric midpoint rule on `L = sum m_i v_i^2/2 - V(t, q) + gamma z`: the discrete Herglotz equations of
/// [`Rule::MIDPOINT`](discrete_herglotz::rules::Rule::MIDPOINT), for systems of any size.
///
/// With the mean velocity u as the unknown, `q' = q0 + h u/2` and `V_q` at `(t + h/2, q')`, a step solves
/// `M u + (h/2) V_q = (1 + gamma h/2) p0`; then `q1 = q0 + h u`, `(1 - gamma h/2) p1 = M u - (h/2) V_q`, and
/// `sigma_d = (1 + gamma h/2)/(1 - gamma h/2)`. The rank-one coupling through z is eliminated analytically, so that
/// only `M + (h^2/4) V_qq`, which is sparse and symmetric, is factorised.
///
/// Newton's method keeps the factors from step to step. It factorises anew only if the corrections decrease so slowly
/// that further solves would cost more, and stops when the estimated next correction is below round-off.
pub struct SparseMidpoint<'a> {
    system: &'a SparseSystem,
    pub(super) solver: LinearSolver,
    h: f64,
    t0: f64,
    taken: usize,
    /// Whether the factors of the sparse matrix are in use for further corrections.
    factors_are_current: bool,
    factorisations: u64,
    iterations: u64,
    q: Vec<f64>,
    v: Vec<f64>,
    z: f64,
    has_action: bool,
    /// The mean velocities of the last step.
    u: Vec<f64>,
    /// Those of the step before it; during a step, the initial guess of the next mean velocities, and then these.
    other_u: Vec<f64>,
    /// The positions at the midpoint, padded.
    middle: Vec<f64>,
    residual: Vec<f64>,
    correction: Vec<f64>,
    monitor: EnergyMonitor,
}

/// The solver for the corrections of Newton's method.
pub(super) enum LinearSolver {
    /// Factors of the sparse matrix.
    Factors(Box<MidpointMatrix>),
    /// Conjugate gradients, by products with the matrix.
    ConjugateGradients(ConjugateGradients),
}

impl<'a> SparseMidpoint<'a> {
    /// Starts from a state. The action z is computed if the start has one, which costs one evaluation of the energies
    /// per step. Factors and workspace of more than `memory` bytes are refused; `None` stands for the memory that the
    /// system has available (`MemAvailable` on Linux; elsewhere there is no limit).
    ///
    /// # Errors
    /// Those of [`SparseSplitting`](crate::SparseSplitting::new), including [`SparseError::NotSeparable`];
    /// [`InputError::Sigma`] unless `|gamma h| < 2`; [`SparseError::Memory`] with the estimate.
    pub fn new(system: &'a SparseSystem, h: f64, start: State, memory: Option<usize>) -> Result<Self, SparseError> {
        Self::with_solver(system, h, start, || {
            Ok(LinearSolver::Factors(Box::new(MidpointMatrix::new(system, memory)?)))
        })
    }

    /// The same steps by Newton's method with conjugate gradients, for systems with a full matrix, such as N bodies.
    /// The matrix is not formed: its products with vectors are directional derivatives of the forces. The memory is
    /// that of a few vectors.
    ///
    /// `M + (h^2/4) V_qq` must be positive definite, which holds for steps that are short compared with the time scales
    /// of the motion.
    ///
    /// ```
    /// use sparse_herglotz::systems::OuterSolarSystem;
    /// use sparse_herglotz::{SparseMidpoint, State};
    /// let (planets, q, v) =
    ///     (OuterSolarSystem::system(5, -1e-6)?, OuterSolarSystem::positions(5), OuterSolarSystem::velocities(5));
    /// let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    /// let mut motion = SparseMidpoint::matrix_free(&planets, 10.0, start)?; // days
    /// assert!(motion.advance(10).is_ok());
    /// # Ok::<(), sparse_herglotz::SparseError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn matrix_free(system: &'a SparseSystem, h: f64, start: State) -> Result<Self, SparseError> {
        Self::with_solver(system, h, start, || Ok(LinearSolver::ConjugateGradients(ConjugateGradients::new(system)?)))
    }

    fn with_solver(
        system: &'a SparseSystem,
        h: f64,
        start: State,
        solver: impl FnOnce() -> Result<LinearSolver, SparseError>,
    ) -> Result<Self, SparseError> {
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h }.into());
        }
        start.check(system)?;
        system.check_separable()?;
        system.check_unconstrained("`SparseMidpoint`")?;
        system.check_frictionless("`SparseMidpoint`")?;
        system.check_masses(MassSource::Diagonal)?;
        SparseSystem::check_number("gamma", system.rate(start.t))?;
        let half = 0.5 * h * system.rate(start.t + 0.5 * h);
        if half.abs() >= 1.0 {
            return Err(InputError::Sigma { sigma: (1.0 + half) / (1.0 - half) }.into());
        }
        let n = system.unknowns();
        let solver = solver()?;
        let mut q = vec![0.0; n + 2];
        q[1..=n].copy_from_slice(start.q);
        let zeros = vec![0.0; n];
        let log_sigma = ((1.0 + half) / (1.0 - half)).ln();
        let monitor = EnergyMonitor::new(system, start, StepInfo { h, log_sigma, order: 2 }, |kind| {
            system.energies((start.t, &q, start.v, start.z.unwrap_or(0.0)), kind)
        });
        let mut midpoint = SparseMidpoint {
            system,
            solver,
            h,
            t0: start.t,
            taken: 0,
            factors_are_current: false,
            factorisations: 0,
            iterations: 0,
            middle: q.clone(),
            q,
            v: start.v.to_vec(),
            z: start.z.unwrap_or(0.0),
            has_action: start.z.is_some(),
            u: start.v.to_vec(),
            other_u: zeros.clone(),
            residual: zeros.clone(),
            correction: zeros,
            monitor,
        };
        midpoint.forces(start.t);
        match midpoint.residual.iter().position(|f| !f.is_finite()) {
            Some(unknown) => Err(SparseError::Undefined { unknown }),
            None => Ok(midpoint),
        }
    }

    /// Takes the given number of steps.
    ///
    /// # Errors
    /// [`StepFailure`] with the number of steps taken before the failure and the cause: [`StepError::NotConverged`],
    /// [`StepError::Singular`], [`StepError::NonFinite`], or [`StepError::SigmaVanished`] if a time-dependent rate no
    /// longer satisfies `|gamma h| < 2`. The state is that before the step that failed.
    pub fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
            if self.monitor.is_due(self.taken) {
                self.check_energy();
            }
        }
        Ok(())
    }

    /// Checks the energy.
    #[cold]
    fn check_energy(&mut self) {
        let State { t, z, .. } = self.state();
        let log_factor = self.taken as f64 * self.sigma().ln();
        let (progress, z) = (RunProgress { t, log_factor, taken: self.taken }, z.unwrap_or(0.0));
        let SparseMidpoint { system, q, v, monitor, .. } = self;
        monitor.check(system, progress, |t, kind| system.energies((t, q, v, z), kind));
    }

    /// The first step at which the energy showed that the steps do not resolve the motion, if there is one: results
    /// from this step on may be wrong.
    ///
    /// The energy `E_L`, which is multiplied by the conformal factor if L does not depend on time, is checked after 4,
    /// 16, 64 and 256 steps, every 1024 steps, and by this call. Without the action, or with a time-dependent gamma,
    /// the check is that `T + V` does not grow while the drag dissipates. The check detects nothing if the potential
    /// depends on time, nor from `T + V` if `gamma h > 0`. For a constant gamma the conformal factor of a step is also
    /// compared with `e^(gamma h)`.
    pub fn unresolved(&mut self) -> Option<UnresolvedStep> {
        if self.monitor.can_check(self.taken) {
            self.check_energy();
        }
        self.monitor.unresolved()
    }

    /// The state.
    pub fn state(&self) -> State<'_> {
        let n = self.system.unknowns();
        State {
            t: self.t0 + self.taken as f64 * self.h,
            q: &self.q[1..=n],
            v: &self.v,
            z: self.has_action.then_some(self.z),
        }
    }

    /// `sigma_d` of the last step; before the first step, `sigma_d` of the first.
    pub fn sigma(&self) -> f64 {
        let half = self.half(self.taken.saturating_sub(1));
        (1.0 + half) / (1.0 - half)
    }

    /// `gamma h/2` at the midpoint of a step.
    fn half(&self, step: usize) -> f64 {
        0.5 * self.h * self.system.rate(self.t0 + (step as f64 + 0.5) * self.h)
    }

    /// The number of numeric factorisations so far.
    pub fn factorisations(&self) -> u64 {
        self.factorisations
    }

    /// The number of matrix-vector products of the conjugate gradients so far.
    pub fn products(&self) -> u64 {
        match &self.solver {
            LinearSolver::Factors(_) => 0,
            LinearSolver::ConjugateGradients(solver) => solver.products(),
        }
    }

    /// The number of Newton iterations so far; each has one linear solve and one evaluation of the forces.
    pub fn iterations(&self) -> u64 {
        self.iterations
    }

    fn step(&mut self) -> Result<(), StepError> {
        let (h, n) = (self.h, self.system.unknowns());
        let t = self.t0 + (self.taken as f64 + 0.5) * h;
        let half = self.half(self.taken);
        // A time-dependent rate may have become too large for the step.
        if half.is_nan() || half.abs() >= 1.0 {
            return Err(StepError::SigmaVanished { sigma: (1.0 + half) / (1.0 - half) });
        }
        // The initial guess is the linear extrapolation of the mean velocities, stored in `other_u`.
        for ((guess, u), v) in self.other_u.iter_mut().zip(&self.u).zip(&self.v) {
            *guess = if self.taken == 0 { *v } else { 2.0 * u - *guess };
        }
        let solution = self.solve(t, half);
        if solution.is_err() {
            // A retry starts from the mean velocity of the last step.
            self.other_u.copy_from_slice(&self.u);
        }
        solution?;
        let factor = 1.0 / (1.0 - half);
        let mut twice_kinetic = 0.0;
        for i in 0..n {
            let u = self.other_u[i];
            self.middle[i + 1] = self.q[i + 1] + 0.5 * h * u;
            self.q[i + 1] += h * u;
            self.v[i] = (2.0 * u - (1.0 + half) * self.v[i]) * factor;
            if self.has_action {
                twice_kinetic += self.system.mass(i) * u * u;
            }
        }
        if self.has_action {
            let potential = self.system.potential(t, &self.middle);
            self.z = ((1.0 + half) * self.z + h * (0.5 * twice_kinetic - potential)) * factor;
        }
        std::mem::swap(&mut self.u, &mut self.other_u);
        self.taken += 1;
        Ok(())
    }

    /// Solves for the mean velocity; `other_u` holds the initial guess, and then the solution.
    fn solve(&mut self, t: f64, half: f64) -> Result<(), StepError> {
        let (h, n) = (self.h, self.system.unknowns());
        let resolution = max_norm(&self.q) / h.abs();
        let mut convergence = NewtonConvergence::new();
        let mut residual = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            for i in 0..n {
                self.middle[i + 1] = self.q[i + 1] + 0.5 * h * self.other_u[i];
            }
            // `residual` first holds -V_q, then the residual of the equation.
            self.forces(t);
            for i in 0..n {
                let m = self.system.mass(i);
                let (u, v) = (self.other_u[i], self.v[i]);
                self.residual[i] = m * (u - (1.0 + half) * v) - 0.5 * h * self.residual[i];
            }
            residual = max_norm(&self.residual);
            if !residual.is_finite() {
                return Err(StepError::NonFinite);
            }
            if !self.factors_are_current && matches!(self.solver, LinearSolver::Factors(_)) {
                convergence.restart();
            }
            self.correct(t)?;
            for (u, correction) in self.other_u.iter_mut().zip(&self.correction) {
                *u -= correction;
            }
            self.iterations += 1;
            let (size_of_correction, speed) = (max_norm(&self.correction), max_norm(&self.other_u));
            if !size_of_correction.is_finite() {
                return Err(StepError::NonFinite);
            }
            // A correction below this changes neither the position nor the velocity.
            let round_off = f64::EPSILON * (speed + resolution);
            match convergence.decide(size_of_correction, round_off) {
                NewtonDecision::Converged => return Ok(()),
                NewtonDecision::Continue => {}
                NewtonDecision::Refactorise => self.factors_are_current = false,
            }
        }
        self.factors_are_current = false;
        Err(StepError::NotConverged { residual, iterations: ITERATION_LIMIT })
    }

    /// Computes `-V_q` at the midpoint, into `residual`.
    fn forces(&mut self, t: f64) {
        for (block, force) in self.residual.chunks_mut(BLOCK_SIZE).enumerate() {
            force.fill(0.0);
            for list in &self.system.potentials {
                list.kick(block, t, &self.middle, KickFactor::Uniform(1.0), force, None);
            }
        }
    }

    /// Computes the correction for the present residual, into `correction`.
    fn correct(&mut self, t: f64) -> Result<(), StepError> {
        let factor = 0.25 * self.h * self.h;
        self.correction.copy_from_slice(&self.residual);
        if let LinearSolver::ConjugateGradients(solver) = &mut self.solver {
            return solver.solve(self.system, (t, &self.middle), factor, &mut self.correction);
        }
        let is_new = !self.factors_are_current;
        if is_new {
            self.factorise(t)?;
        }
        let LinearSolver::Factors(matrix) = &mut self.solver else { return Ok(()) };
        matrix.factors.solve(&mut self.correction)?;
        let n = self.correction.len();
        if is_new && !matrix.is_solution(&self.correction, &self.residual, &mut self.middle[1..=n]) {
            self.factors_are_current = false;
            return Err(StepError::Singular { pivot: 0.0 });
        }
        Ok(())
    }

    /// Factorises `M + (h^2/4) V_qq` at the midpoint.
    pub(super) fn factorise(&mut self, t: f64) -> Result<(), StepError> {
        if let LinearSolver::Factors(matrix) = &mut self.solver {
            matrix.factorise(self.system, (t, &self.middle), 0.25 * self.h * self.h)?;
            self.factors_are_current = true;
            self.factorisations += 1;
        }
        Ok(())
    }
}
