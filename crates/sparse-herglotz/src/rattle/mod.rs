//! RATTLE with a drag for large systems with constraints, and its compositions.

mod gram;
mod solver;
mod start;

use crate::SparseError;
use crate::blocks::BLOCK_SIZE;
use crate::drag::Drag;
use crate::kick::KickFactor;
use crate::monitor::{EnergyMonitor, RunProgress, StepInfo};
use crate::system::{MassSource, SparseSystem, State};
use discrete_herglotz::constraints::OffConstraint;
use discrete_herglotz::{InputError, SplittingScheme, StepError, StepFailure, UnresolvedStep};
use solver::ConstraintSolver;

/// RATTLE between two halves of a linear drag, `D_(h/2) o RATTLE_h o D_(h/2)`, and its symmetric compositions of order
/// up to 10, for `L = sum m_i v_i^2/2 - V(t, q) + gamma z` on constraints `c_e(q_e) = 0` of elements: chains, nets and
/// linkages of any size.
///
/// D is the flow of the drag, `p -> e^(gamma h/2) p`, `z -> e^(gamma h/2) z`. RATTLE with the action is, with `G = c_q`,
///
/// `p_h = p0 - h/2 V_q(q0) + G(q0)^T Y`, `q1 = q0 + h M^-1 p_h`, `c(q1) = 0`,
/// `p1 = p_h - h/2 V_q(q1) + G(q1)^T Y'`, `G(q1) M^-1 p1 = 0`,
/// `z1 = z0 + h p_h.M^-1 p_h/2 - h (V(q0) + V(q1))/2`.
///
/// Both are conformally contact on the constraint manifold, with `sigma_d = e^(gamma h)` of the step exactly; if the drag
/// depends on time, `sigma_d` is the exponential of its integral. The map is that of
/// [`DragRattle`](discrete_herglotz::constraints::DragRattle) on a small system.
///
/// A substep evaluates one new force and factorises one sparse matrix, `G M^-1 G^T` at the new position, with which the
/// velocity is projected and with which Newton's method for the next position begins. It factorises another matrix only
/// if it converges slowly. The cost of a step is linear in the number of links of a chain.
///
/// Reference: Hairer, Lubich and Wanner, Geometric Numerical Integration, section VII.1.4, for RATTLE.
///
/// ```
/// use discrete_herglotz::{SplittingScheme, constraints::OffConstraint};
/// use sparse_herglotz::{SparseRattle, State, systems::RodChain};
/// let rods = RodChain { links: 100, length: 0.01, mass: 0.01, gravity: 9.81 };
/// let (chain, q) = (rods.system(-0.1)?, rods.straight(0.3));
/// let start = State { t: 0.0, q: &q, v: &vec![0.0; 200], z: Some(0.0) };
/// let mut motion = SparseRattle::new(&chain, &SplittingScheme::STRANG, 1e-3, start, OffConstraint::Refuse)?;
/// assert!(motion.advance(10).is_ok());
/// println!("{:?}", motion.state().q);
/// println!("multiplier at the top {:?}", motion.multipliers().map(|m| m[0]));
/// # Ok::<(), sparse_herglotz::SparseError>(())
/// ```
pub struct SparseRattle<'a> {
    system: &'a SparseSystem,
    solver: ConstraintSolver<'a>,
    substeps: Vec<f64>,
    h: f64,
    t0: f64,
    taken: usize,
    /// Positions and velocities are padded with one fixed component at each end.
    q: Vec<f64>,
    v: Vec<f64>,
    z: f64,
    has_action: bool,
    /// The positions after the current substep.
    next: Vec<f64>,
    /// `-V_q` at the current position, and V if the action is computed.
    force: Vec<f64>,
    potential: f64,
    impulse: Vec<f64>,
    /// The state before the current step.
    before: (Vec<f64>, Vec<f64>),
    monitor: EnergyMonitor,
}

impl<'a> SparseRattle<'a> {
    /// Starts from a state, which is refused or projected if it does not satisfy the constraints. The action z is
    /// computed if the start has one, which costs one evaluation of the potential per substep.
    ///
    /// # Errors
    /// Those of [`SparseSplitting`](crate::SparseSplitting::new); [`InputError::Hypothesis`] for a scheme of
    /// Runge-Kutta-Nystrom type; [`SparseError::Unconstrained`] for a system without constraints,
    /// [`SparseError::Friction`] for one with friction; [`SparseError::OffConstraint`] and
    /// [`SparseError::OffVelocity`] with the element, [`SparseError::NotProjected`]; [`SparseError::Dependent`] for
    /// constraints that are dependent at the start; [`SparseError::UndefinedConstraint`]; [`SparseError::Memory`].
    pub fn new(
        system: &'a SparseSystem,
        scheme: &SplittingScheme,
        h: f64,
        start: State,
        off: OffConstraint,
    ) -> Result<Self, SparseError> {
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h }.into());
        }
        let Some(substeps) = scheme.substeps() else {
            let hypothesis = "a composition of symmetric steps, not a Nyström splitting";
            return Err(InputError::Hypothesis { hypothesis }.into());
        };
        start.check(system)?;
        system.check_separable()?;
        system.check_frictionless("`SparseRattle`")?;
        system.check_masses(MassSource::Diagonal)?;
        SparseSystem::check_number("gamma", system.rate(start.t))?;
        let mut solver = ConstraintSolver::new(system)?;
        let padded = |x: &[f64]| [&[0.0], x, &[0.0]].concat();
        let (mut q, mut v, z) = (padded(start.q), padded(start.v), start.z.unwrap_or(0.0));
        solver.start(&mut q, &mut v, off)?;
        let n = system.unknowns();
        let info = StepInfo { h, log_sigma: system.rate(start.t) * h, order: scheme.order() };
        let monitor =
            EnergyMonitor::new(system, start, info, |kind| system.energies((start.t, &q, &v[1..=n], z), kind));
        let mut rattle = SparseRattle {
            system,
            substeps,
            h,
            t0: start.t,
            taken: 0,
            next: q.clone(),
            before: (q.clone(), v.clone()),
            q,
            v,
            z,
            has_action: start.z.is_some(),
            force: vec![0.0; n],
            potential: 0.0,
            impulse: vec![0.0; solver.y.len()],
            solver,
            monitor,
        };
        rattle.evaluate(start.t);
        match rattle.force.iter().position(|f| !f.is_finite()) {
            Some(unknown) => Err(SparseError::Undefined { unknown }),
            None => Ok(rattle),
        }
    }

    /// Takes the given number of steps.
    ///
    /// # Errors
    /// [`StepFailure`] with the number of steps taken before the failure and the cause: [`StepError::NotConverged`] if no
    /// multipliers are found, [`StepError::Singular`] if the constraints are dependent, [`StepError::NonFinite`]. The
    /// state is that before the step that failed.
    pub fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
            if self.monitor.is_due(self.taken) {
                self.check_energy();
            }
        }
        Ok(())
    }

    fn step(&mut self) -> Result<(), StepError> {
        self.before.0.copy_from_slice(&self.q);
        self.before.1.copy_from_slice(&self.v);
        let z = self.z;
        let t = self.time();
        let stepped = self.substeps(t);
        if stepped.is_err() {
            self.q.copy_from_slice(&self.before.0);
            self.v.copy_from_slice(&self.before.1);
            self.z = z;
            // They succeeded at this state before.
            self.solver.linearise(&self.q)?;
            self.evaluate(t);
        } else {
            self.taken += 1;
        }
        stepped
    }

    /// All substeps of a step.
    fn substeps(&mut self, mut t: f64) -> Result<(), StepError> {
        self.impulse.fill(0.0);
        for i in 0..self.substeps.len() {
            let h = self.substeps[i] * self.h;
            self.drag(t, 0.5 * h);
            self.rattle(t, h)?;
            self.drag(t + 0.5 * h, 0.5 * h);
            t += h;
        }
        let sum = self.v.iter().sum::<f64>() + self.z;
        if sum.is_finite() { Ok(()) } else { Err(StepError::NonFinite) }
    }

    /// The flow of the drag from the time t over a time s.
    fn drag(&mut self, t: f64, s: f64) {
        let damping = self.system.drag.drift(t, s).damping;
        self.v.iter_mut().for_each(|v| *v += *v * damping);
        self.z += self.z * damping;
    }

    /// RATTLE with the action from the time t over a time h.
    fn rattle(&mut self, t: f64, h: f64) -> Result<(), StepError> {
        self.kick(0.5 * h);
        self.solver.constrain(h, &self.q, (&mut self.next, &mut self.v), &mut self.impulse)?;
        if self.has_action {
            let moving = self.v.iter().skip(1).take(self.force.len()).enumerate();
            let twice_kinetic: f64 = moving.map(|(i, v)| self.system.mass(i) * v * v).sum();
            self.z += 0.5 * h * twice_kinetic;
        }
        std::mem::swap(&mut self.q, &mut self.next);
        self.evaluate(t + h);
        self.kick(0.5 * h);
        self.solver.linearise(&self.q)?;
        self.solver.project(&mut self.v, &mut self.impulse)
    }

    /// The flow of the potential over a time s.
    fn kick(&mut self, s: f64) {
        let moving = self.v.iter_mut().zip(&self.solver.inverse_masses).skip(1);
        for ((v, w), force) in moving.zip(&self.force) {
            *v += s * w * force;
        }
        self.z -= s * self.potential;
    }

    /// Evaluates the force, and the potential if the action is computed, at the current position.
    fn evaluate(&mut self, t: f64) {
        for (block, force) in self.force.chunks_mut(BLOCK_SIZE).enumerate() {
            force.fill(0.0);
            for list in &self.system.potentials {
                list.kick(block, t, &self.q, KickFactor::Uniform(1.0), force, None);
            }
        }
        if self.has_action {
            self.potential = self.system.potential(t, &self.q);
        }
    }

    fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    /// The state.
    pub fn state(&self) -> State<'_> {
        let n = self.system.unknowns();
        State { t: self.time(), q: &self.q[1..=n], v: &self.v[1..=n], z: self.has_action.then_some(self.z) }
    }

    /// `sigma_d` of the last step: `e^(gamma h)`, or the exponential of the integral of gamma over it; before the first
    /// step, `sigma_d` of the first.
    pub fn sigma(&self) -> f64 {
        if let Drag::Constant(gamma) = self.system.drag {
            return (gamma * self.h).exp();
        }
        let mut t = self.t0 + self.taken.saturating_sub(1) as f64 * self.h;
        let mut sigma = 1.0;
        for g in &self.substeps {
            let s = 0.5 * g * self.h;
            for _ in 0..2 {
                sigma *= 1.0 + self.system.drag.drift(t, s).damping;
                t += s;
            }
        }
        sigma
    }

    /// The multipliers lambda of the motion at the current state, one for each element, list by list in the order in
    /// which they were added: the constrained Herglotz equations are `p' = -V_q + gamma p + G^T lambda`. They are computed
    /// from the state, so that they have its accuracy.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the constraints are dependent.
    pub fn multipliers(&mut self) -> Result<&[f64], StepError> {
        let rate = self.system.rate(self.time());
        let ConstraintSolver { change, inverse_masses, .. } = &mut self.solver;
        // The fixed components at both ends are at rest.
        change.fill(0.0);
        for (i, force) in self.force.iter().enumerate() {
            change[i + 1] = inverse_masses[i + 1] * force + rate * self.v[i + 1];
        }
        self.solver.multipliers(&self.q, &self.v)?;
        Ok(&self.solver.y)
    }

    /// The forces `G^T lambda` of the constraints on the unknowns at the current state.
    ///
    /// # Errors
    /// Those of [`multipliers`](Self::multipliers).
    pub fn constraint_forces(&mut self) -> Result<&[f64], StepError> {
        self.multipliers()?;
        let ConstraintSolver { pattern, g, y, change, .. } = &mut self.solver;
        change.fill(0.0);
        pattern.add_transposed(g, y, 1.0, change);
        // The fixed components at both ends are no unknowns.
        Ok(&self.solver.change[1..=self.force.len()])
    }

    /// The impulses `Y + Y'` of the constraints in the last step, the sums over its substeps: divided by h, a mean of the
    /// multipliers, of order 2 without a composition.
    pub fn impulses(&self) -> &[f64] {
        &self.impulse
    }

    /// The values `c(q)` of the constraints at the current state.
    pub fn residuals(&mut self) -> &[f64] {
        self.solver.residual(&self.q);
        &self.solver.y
    }

    /// The number of Newton iterations for positions so far.
    pub fn iterations(&self) -> u64 {
        self.solver.iterations
    }

    /// The number of numeric factorisations so far.
    pub fn factorisations(&self) -> u64 {
        self.solver.factorisations
    }

    /// The first step at which the energy showed that the steps do not resolve the motion, if there is one: results
    /// from this step on may be wrong. The checks are those of
    /// [`SparseSplitting::unresolved`](crate::SparseSplitting::unresolved).
    pub fn unresolved(&mut self) -> Option<UnresolvedStep> {
        if self.monitor.can_check(self.taken) {
            self.check_energy();
        }
        self.monitor.unresolved()
    }

    /// Checks the energy.
    #[cold]
    fn check_energy(&mut self) {
        let t = self.time();
        let progress = RunProgress { t, log_factor: self.system.rate(t) * (t - self.t0), taken: self.taken };
        let n = self.system.unknowns();
        let SparseRattle { system, q, v, z, monitor, .. } = self;
        monitor.check(system, progress, |t, kind| system.energies((t, q, &v[1..=n], *z), kind));
    }
}
