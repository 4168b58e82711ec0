//! The implicit midpoint rule for assembled systems.

use super::corrections::{Corrections, Verdict};
use super::krylov::Krylov;
use super::max_abs_or_nan;
use super::sparse::Sparse;
use crate::AssemblyError;
use crate::blocks::BLOCK;
use crate::kernels::Weight;
use crate::monitor::{EnergyMonitor, Reached, StepFacts};
use crate::system::{AssembledSystem, State};
use discrete_herglotz::{InputError, StepError, StepFailure, UnresolvedStep, solve::ITERATION_LIMIT};

/// The symmetric midpoint rule on `L = sum m_i v_i^2/2 - V(t, q) + gamma z`: the discrete Herglotz equations of
/// [`Midpoint`](discrete_herglotz::rules::Midpoint), for systems of any size.
///
/// With the mean velocity u as the unknown, `q' = q0 + h u/2` and `V_q` at `(t + h/2, q')`, a step solves
/// `M u + (h/2) V_q = (1 + gamma h/2) p0`; then `q1 = q0 + h u`, `(1 - gamma h/2) p1 = M u - (h/2) V_q`, and
/// `sigma_d = (1 + gamma h/2)/(1 - gamma h/2)`. The rank-one coupling through z is eliminated analytically, so that
/// only `M + (h^2/4) V_qq`, which is sparse and symmetric, is factorised.
///
/// Newton's method keeps the factors from step to step. It factorises anew only if the corrections decrease so slowly
/// that further solves would cost more, and stops when the estimated next correction is below round-off.
pub struct AssembledMidpoint<'a> {
    system: &'a AssembledSystem,
    pub(super) linear: Linear,
    h: f64,
    t0: f64,
    taken: usize,
    factorised: bool,
    factorisations: u64,
    iterations: u64,
    q: Vec<f64>,
    v: Vec<f64>,
    z: f64,
    action: bool,
    /// The mean velocities of the last step (`u`) and of the step before it (`before`).
    u: Vec<f64>,
    before: Vec<f64>,
    middle: Vec<f64>,
    residual: Vec<f64>,
    change: Vec<f64>,
    monitor: EnergyMonitor,
}

/// The solver for the corrections of Newton's method.
pub(super) enum Linear {
    /// Factors of the sparse matrix.
    Sparse(Box<Sparse>),
    /// Conjugate gradients, by products with the matrix.
    Krylov(Krylov),
}

impl<'a> AssembledMidpoint<'a> {
    /// Starts from a state. The action z is computed if the start has one, which costs one evaluation of the energies
    /// per step. Factors and workspace of more than `memory` bytes are refused; `None` stands for the memory that the
    /// system has available (`MemAvailable` on Linux; elsewhere there is no limit).
    ///
    /// # Errors
    /// Those of [`AssembledSplitting`](crate::AssembledSplitting::new), including [`AssemblyError::NotSeparable`];
    /// [`InputError::Sigma`] unless `|gamma h| < 2`; [`AssemblyError::Memory`] with the estimate.
    pub fn new(
        system: &'a AssembledSystem,
        h: f64,
        start: State,
        memory: Option<usize>,
    ) -> Result<Self, AssemblyError> {
        Self::with(system, h, start, || Ok(Linear::Sparse(Box::new(Sparse::new(system, memory)?))))
    }

    /// The same steps by Newton's method with conjugate gradients, for systems with a full matrix, such as N bodies.
    /// The matrix is not formed: its products with vectors are directional derivatives of the forces. The memory is
    /// that of a few vectors.
    ///
    /// `M + (h^2/4) V_qq` must be positive definite, which holds for steps that are short compared with the time scales
    /// of the motion.
    ///
    /// ```
    /// use assembled_herglotz::systems::OuterSolarSystem;
    /// use assembled_herglotz::{AssembledMidpoint, State};
    /// let (planets, q, v) =
    ///     (OuterSolarSystem::system(5, -1e-6)?, OuterSolarSystem::positions(5), OuterSolarSystem::velocities(5));
    /// let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    /// let mut motion = AssembledMidpoint::matrix_free(&planets, 10.0, start)?; // days
    /// assert!(motion.advance(10).is_ok());
    /// # Ok::<(), assembled_herglotz::AssemblyError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn matrix_free(system: &'a AssembledSystem, h: f64, start: State) -> Result<Self, AssemblyError> {
        Self::with(system, h, start, || Ok(Linear::Krylov(Krylov::new(system)?)))
    }

    fn with(
        system: &'a AssembledSystem,
        h: f64,
        start: State,
        linear: impl FnOnce() -> Result<Linear, AssemblyError>,
    ) -> Result<Self, AssemblyError> {
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h }.into());
        }
        start.check(system)?;
        system.check_separable()?;
        system.check_masses(false)?;
        AssembledSystem::check_number("gamma", system.rate(start.t))?;
        let half = 0.5 * h * system.rate(start.t + 0.5 * h);
        if half.abs() >= 1.0 {
            return Err(InputError::Sigma { sigma: (1.0 + half) / (1.0 - half) }.into());
        }
        let n = system.unknowns();
        let linear = linear()?;
        let mut q = vec![0.0; n + 2];
        q[1..=n].copy_from_slice(start.q);
        let zeros = vec![0.0; n];
        let log_sigma = ((1.0 + half) / (1.0 - half)).ln();
        let monitor = EnergyMonitor::new(system, start, StepFacts { h, log_sigma, order: 2 }, |bounded| {
            system.energies((start.t, &q, start.v, start.z.unwrap_or(0.0)), bounded)
        });
        let mut midpoint = AssembledMidpoint {
            system,
            linear,
            h,
            t0: start.t,
            taken: 0,
            factorised: false,
            factorisations: 0,
            iterations: 0,
            middle: q.clone(),
            q,
            v: start.v.to_vec(),
            z: start.z.unwrap_or(0.0),
            action: start.z.is_some(),
            u: start.v.to_vec(),
            before: zeros.clone(),
            residual: zeros.clone(),
            change: zeros,
            monitor,
        };
        midpoint.forces(start.t);
        match midpoint.residual.iter().position(|f| !f.is_finite()) {
            Some(unknown) => Err(AssemblyError::Undefined { unknown }),
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
                self.look();
            }
        }
        Ok(())
    }

    /// Checks the energy.
    #[cold]
    fn look(&mut self) {
        let State { t, z, .. } = self.state();
        let log_factor = self.taken as f64 * self.sigma().ln();
        let (reached, z) = (Reached { t, log_factor, taken: self.taken }, z.unwrap_or(0.0));
        let AssembledMidpoint { system, q, v, monitor, .. } = self;
        monitor.look(system, reached, |t, bounded| system.energies((t, q, v, z), bounded));
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
        if self.monitor.tells(self.taken) {
            self.look();
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
            z: self.action.then_some(self.z),
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
        if let Linear::Krylov(krylov) = &self.linear { krylov.products() } else { 0 }
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
        // The initial guess is the linear extrapolation of the mean velocities, stored in `before`.
        for ((before, u), v) in self.before.iter_mut().zip(&self.u).zip(&self.v) {
            *before = if self.taken == 0 { *v } else { 2.0 * u - *before };
        }
        let root = self.solve(t, half);
        if root.is_err() {
            // A retry starts from the mean velocity of the last step.
            self.before.copy_from_slice(&self.u);
        }
        root?;
        let gain = 1.0 / (1.0 - half);
        let mut twice_kinetic = 0.0;
        for i in 0..n {
            let u = self.before[i];
            self.middle[i + 1] = self.q[i + 1] + 0.5 * h * u;
            self.q[i + 1] += h * u;
            self.v[i] = (2.0 * u - (1.0 + half) * self.v[i]) * gain;
            if self.action {
                twice_kinetic += self.system.mass(i) * u * u;
            }
        }
        if self.action {
            let potential = self.system.potential(t, &self.middle);
            self.z = ((1.0 + half) * self.z + h * (0.5 * twice_kinetic - potential)) * gain;
        }
        std::mem::swap(&mut self.u, &mut self.before);
        self.taken += 1;
        Ok(())
    }

    /// Solves for the mean velocity; `before` holds the initial guess, and then the solution.
    fn solve(&mut self, t: f64, half: f64) -> Result<(), StepError> {
        let (h, n) = (self.h, self.system.unknowns());
        let resolution = max_abs_or_nan(&self.q) / h.abs();
        let mut corrections = Corrections::new();
        let mut size = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            for i in 0..n {
                self.middle[i + 1] = self.q[i + 1] + 0.5 * h * self.before[i];
            }
            // `residual` first holds -V_q, then the residual of the equation.
            self.forces(t);
            for i in 0..n {
                let m = self.system.mass(i);
                let (u, v) = (self.before[i], self.v[i]);
                self.residual[i] = m * (u - (1.0 + half) * v) - 0.5 * h * self.residual[i];
            }
            size = max_abs_or_nan(&self.residual);
            if !size.is_finite() {
                return Err(StepError::NonFinite);
            }
            if !self.factorised && matches!(self.linear, Linear::Sparse(_)) {
                corrections.forget();
            }
            self.correct(t)?;
            for (u, change) in self.before.iter_mut().zip(&self.change) {
                *u -= change;
            }
            self.iterations += 1;
            let (now, speed) = (max_abs_or_nan(&self.change), max_abs_or_nan(&self.before));
            if !now.is_finite() {
                return Err(StepError::NonFinite);
            }
            // A correction below this changes neither the position nor the velocity.
            let round_off = f64::EPSILON * (speed + resolution);
            match corrections.judge(now, round_off) {
                Verdict::Done => return Ok(()),
                Verdict::Further => {}
                Verdict::Factorise => self.factorised = false,
            }
        }
        self.factorised = false;
        Err(StepError::NotConverged { residual: size, iterations: ITERATION_LIMIT })
    }

    /// Computes `-V_q` at the midpoint, into `residual`.
    fn forces(&mut self, t: f64) {
        for (block, force) in self.residual.chunks_mut(BLOCK).enumerate() {
            force.fill(0.0);
            for list in &self.system.potentials {
                list.kick(block, t, &self.middle, Weight::Same(1.0), force, None);
            }
        }
    }

    /// Computes the correction for the present residual, into `change`.
    fn correct(&mut self, t: f64) -> Result<(), StepError> {
        let factor = 0.25 * self.h * self.h;
        self.change.copy_from_slice(&self.residual);
        if let Linear::Krylov(krylov) = &mut self.linear {
            return krylov.solve(self.system, (t, &self.middle), factor, &mut self.change);
        }
        let fresh = !self.factorised;
        if fresh {
            self.factorise(t)?;
        }
        let Linear::Sparse(sparse) = &mut self.linear else { return Ok(()) };
        sparse.factors.solve(&mut self.change)?;
        let n = self.change.len();
        if fresh && !sparse.solves(&self.change, &self.residual, &mut self.middle[1..=n]) {
            self.factorised = false;
            return Err(StepError::Singular { pivot: 0.0 });
        }
        Ok(())
    }

    /// Factorises `M + (h^2/4) V_qq` at the midpoint.
    pub(super) fn factorise(&mut self, t: f64) -> Result<(), StepError> {
        if let Linear::Sparse(sparse) = &mut self.linear {
            sparse.factorise(self.system, (t, &self.middle), 0.25 * self.h * self.h)?;
            self.factorised = true;
            self.factorisations += 1;
        }
        Ok(())
    }
}
