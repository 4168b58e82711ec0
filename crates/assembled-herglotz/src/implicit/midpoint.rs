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
use discrete_herglotz::{ITERATION_LIMIT, InputError, StepError, StepFailure, UnresolvedStep};

/// The symmetric midpoint rule on `L = sum m_i v_i^2/2 - V(t, q) + gamma z`: the discrete Herglotz equations of
/// [`Midpoint`](discrete_herglotz::Midpoint), for systems of any size.
///
/// With the mean velocity u as the unknown, `q' = q0 + h u/2` and `V_q` at `(t + h/2, q')`, a step solves
/// `M u + (h/2) V_q = (1 + gamma h/2) p0`; then `q1 = q0 + h u`, `(1 - gamma h/2) p1 = M u - (h/2) V_q`, and
/// `sigma_d = (1 + gamma h/2)/(1 - gamma h/2)`. The rank-one coupling through z is eliminated by hand: what is left to factorise is
/// `M + (h^2/4) V_qq`, sparse and symmetric.
///
/// Newton's method keeps the factors from step to step. It factorises anew only where the corrections shrink so slowly that more
/// solves would cost more, and stops where the next correction is below round-off.
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
    /// The mean velocities of the last two steps, the latter first.
    u: Vec<f64>,
    before: Vec<f64>,
    middle: Vec<f64>,
    residual: Vec<f64>,
    change: Vec<f64>,
    monitor: EnergyMonitor,
}

/// How a correction is solved for.
pub(super) enum Linear {
    /// By factors of the sparse matrix.
    Sparse(Box<Sparse>),
    /// By products with it.
    Krylov(Krylov),
}

impl<'a> AssembledMidpoint<'a> {
    /// From a state; with the action z where the state has one, which costs the energies once a step. Factors and workspace of more than `memory` bytes are refused; with `None` of more than the system
    /// has available (Linux' `MemAvailable`; elsewhere there is no limit then).
    ///
    /// # Errors
    /// As [`AssembledSplitting`](crate::AssembledSplitting::new), [`AssemblyError::NotSeparable`] among them; [`InputError::Sigma`] unless `|gamma h| < 2`;
    /// [`AssemblyError::Memory`] with the estimate.
    pub fn new(
        system: &'a AssembledSystem,
        h: f64,
        start: State,
        memory: Option<usize>,
    ) -> Result<Self, AssemblyError> {
        Self::with(system, h, start, || Ok(Linear::Sparse(Box::new(Sparse::new(system, memory)?))))
    }

    /// The same steps by Newton's method with conjugate gradients, for systems whose matrix is full, as that of bodies in space: it is not
    /// formed, and products with it are derivatives of the forces along a vector. The memory is a few vectors.
    ///
    /// `M + (h^2/4) V_qq` must be positive definite: so it is for steps that are short beside the motion.
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

    /// Takes steps.
    ///
    /// # Errors
    /// [`StepFailure`] with the steps taken before and the cause: [`StepError::NotConverged`], [`StepError::Singular`],
    /// [`StepError::NonFinite`], or [`StepError::SigmaVanished`] of a rate that has grown beyond `|gamma h| < 2`. The state is that before the step which failed.
    pub fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
            if self.monitor.is_due(self.taken) {
                self.look();
            }
        }
        Ok(())
    }

    /// Looks at the energy.
    #[cold]
    fn look(&mut self) {
        let State { t, z, .. } = self.state();
        let log_factor = self.taken as f64 * self.sigma().ln();
        let (reached, z) = (Reached { t, log_factor, taken: self.taken }, z.unwrap_or(0.0));
        let AssembledMidpoint { system, q, v, monitor, .. } = self;
        monitor.look(system, reached, |t, bounded| system.energies((t, q, v, z), bounded));
    }

    /// The first step at which the steps were seen not to resolve the motion, where they were: by the energy, which is multiplied by the
    /// conformal factor where L does not depend on time, and without the action at least does not grow by drag. It is looked at after 4, 16, 64 and 256
    /// steps, every 1024, and here: what follows such a step may be wrong. Nothing is seen without the action where gamma is positive, and of
    /// systems that depend on time; the conformal factor of a step is compared with the exponential as well.
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

    /// `sigma_d` of the last step; before the first one, of that.
    pub fn sigma(&self) -> f64 {
        let half = self.half(self.taken.saturating_sub(1));
        (1.0 + half) / (1.0 - half)
    }

    /// `gamma h/2` in the middle of a step.
    fn half(&self, step: usize) -> f64 {
        0.5 * self.h * self.system.rate(self.t0 + (step as f64 + 0.5) * self.h)
    }

    /// The numeric factorisations made.
    pub fn factorisations(&self) -> u64 {
        self.factorisations
    }

    /// The products of the matrix with a vector that conjugate gradients have made.
    pub fn products(&self) -> u64 {
        if let Linear::Krylov(krylov) = &self.linear { krylov.products() } else { 0 }
    }

    /// The iterations made, each a solve and a force.
    pub fn iterations(&self) -> u64 {
        self.iterations
    }

    fn step(&mut self) -> Result<(), StepError> {
        let (h, n) = (self.h, self.system.unknowns());
        let t = self.t0 + (self.taken as f64 + 0.5) * h;
        let half = self.half(self.taken);
        // A rate that depends on time may have become too large for the step.
        if half.is_nan() || half.abs() >= 1.0 {
            return Err(StepError::SigmaVanished { sigma: (1.0 + half) / (1.0 - half) });
        }
        // The guess continues the mean velocities linearly; `before` holds it.
        for ((before, u), v) in self.before.iter_mut().zip(&self.u).zip(&self.v) {
            *before = if self.taken == 0 { *v } else { 2.0 * u - *before };
        }
        let root = self.solve(t, half);
        if root.is_err() {
            // What was known before the step, for another try.
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

    /// Solves for the mean velocity, from the guess in `before` and into it.
    fn solve(&mut self, t: f64, half: f64) -> Result<(), StepError> {
        let (h, n) = (self.h, self.system.unknowns());
        let resolution = max_abs_or_nan(&self.q) / h.abs();
        let mut corrections = Corrections::new();
        let mut size = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            for i in 0..n {
                self.middle[i + 1] = self.q[i + 1] + 0.5 * h * self.before[i];
            }
            // -(h/2) V_q, then the residual.
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
            // Below this a correction does not move the position or the velocity.
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

    /// `-V_q` at the middle, into `residual`.
    fn forces(&mut self, t: f64) {
        for (block, force) in self.residual.chunks_mut(BLOCK).enumerate() {
            force.fill(0.0);
            for list in &self.system.potentials {
                list.kick(block, t, &self.middle, Weight::Same(1.0), force, None);
            }
        }
    }

    /// Solves for the correction of this residual.
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

    /// Factorises `M + (h^2/4) V_qq` at the middle.
    pub(super) fn factorise(&mut self, t: f64) -> Result<(), StepError> {
        if let Linear::Sparse(sparse) = &mut self.linear {
            sparse.factorise(self.system, (t, &self.middle), 0.25 * self.h * self.h)?;
            self.factorised = true;
            self.factorisations += 1;
        }
        Ok(())
    }
}
