//! Contact Lobatto IIIA-IIIB methods under holonomic constraints.

use super::lobatto_tables::{LobattoTables, STAGES};
use super::lobatto_workspace::Workspace;
use super::variation::{Unvaried, Vary};
use super::{ConstrainedStart, ConstraintError, Corrections, Progress, velocity_scale};
use crate::numbers::extent::extent;
use crate::numbers::state_words::{restored_from, saved, words_of};
use crate::system::applied_force::AppliedForce;
use crate::{InputError, RunSupport, State, StepDetails, StepError, StepFailure, Stepper, Vector};
use contact_geom::constraints::{ConstrainedMotion, Constraint, ConstraintDerivatives, Redundancy, constrained_motion};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::{ChartVector, Derivatives, GeometryError, Lagrangian, PhasePoint, Scalar, VelocityPoint};

/// The contact Lobatto IIIA-IIIB method with s stages, of order `2s - 2`, for any regular Lagrangian on `c(q) = 0`,
/// with the current state.
///
/// The motion is symplectified: with `rho' = -rho L_z` and `P = rho p`, `(q, z)` and `(P, -rho)` are canonical
/// coordinates, in which the motion has the homogeneous Hamiltonian `rho H(t, q, P/rho, z)`. Lobatto IIIA is applied to
/// `(q, z)` and IIIB to `(P, rho)`, with the constraints at all stages (Jay's SPARK method). With `G = c_q`,
/// `rho_0 = 1`, an applied force f and `f_j = h rho_j (L_q + f) + G(Q_j)^T Y_j`:
///
/// `Q_i = q0 + h sum a_ij V_j`, `Z_i = z0 + h sum a_ij L_j`, `rho_i = 1 - h sum a_hat_ij rho_j L_z,j`,
/// `rho_i L_v(Q_i, V_i, Z_i) = p0 + sum a_hat_ij f_j`, `c(Q_i) = 0`,
/// `rho_1 p1 = p0 + sum b_j f_j`, `G(q1) v(q1, p1, z1) = 0`.
///
/// The map is symplectic and homogeneous of degree one, so it keeps the form `P dq - rho dz = -rho eta`: on `T*N x R`
/// it is conformally contact with `sigma_d = 1/rho_1`, where no force is applied. For `s = 2` it is RATTLE.
///
/// Reference: Jay, SIAM J. Numer. Anal. 33 (1996) 368-387; Hairer, Lubich and Wanner, Geometric Numerical Integration,
/// section VII.1.4.
///
/// ```
/// use contact_examples::systems::constrained::RigidPendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Stepper, constraints::{ConstrainedStart, ContactLobatto}};
/// let pendulum = RigidPendulum::<3> { gravity: 9.81, gamma: -0.1 };
/// let start = ConstrainedStart::new(VelocityPoint::new([1.0, 0.0, 0.0], [0.0, 2.0, 0.0], 0.0));
/// let mut motion = ContactLobatto::new(&pendulum, &pendulum, 4, 0.1, &start)?;
/// motion.advance(100)?;
/// assert!((motion.sigma() - (-0.01f64).exp()).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ContactLobatto<L, C, const N: usize, const M: usize> {
    lagrangian: L,
    constraint: C,
    redundancy: Redundancy,
    tables: LobattoTables,
    h: f64,
    t0: f64,
    taken: usize,
    state: PhasePoint<N>,
    velocity: SVector<f64, N>,
    sigma: f64,
    evaluations: u64,
    workspace: Workspace<N, M>,
}

/// One step: its final state, with the velocity and the conformal factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobattoStep<const N: usize, T = f64> {
    /// The state `(q, p, z)` at the end.
    pub end: PhasePoint<N, T>,
    /// The velocity at the end, tangent to the constraint.
    pub velocity: SVector<T, N>,
    /// The conformal factor `1/rho_1`.
    pub sigma: T,
}

impl<L: Lagrangian<N>, C: Constraint<N, M>, const N: usize, const M: usize> ContactLobatto<L, C, N, M> {
    /// The motion with s stages and steps of the length h from a start.
    ///
    /// # Errors
    /// [`InputError`]: a start off the constraints, dependent constraints, a number of stages that is not from 2
    /// to 8, a step that is 0 or not finite, a Lagrangian that is singular at the start, a first step that fails.
    pub fn new(
        lagrangian: L,
        constraint: C,
        stages: usize,
        h: f64,
        start: &ConstrainedStart<N>,
    ) -> Result<Self, InputError> {
        let mut motion = Self::of(lagrangian, constraint, stages, h, start)?;
        let mut workspace = motion.workspace.clone();
        let step = motion.solve(start.t, &motion.state, &motion.velocity, &mut Unvaried, &mut workspace);
        motion.workspace = workspace;
        motion.workspace.evaluations = 0;
        step.map_err(InputError::FirstStep)?;
        Ok(motion)
    }

    /// The motion, without the trial of its first step.
    pub(super) fn of(
        lagrangian: L,
        constraint: C,
        stages: usize,
        h: f64,
        start: &ConstrainedStart<N>,
    ) -> Result<Self, InputError> {
        Self::check(stages)?;
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        let at = start.resolved_for(&lagrangian, &constraint, h)?;
        let p = lagrangian.gradient(start.t, &at).y;
        Ok(ContactLobatto {
            lagrangian,
            constraint,
            redundancy: start.redundancy,
            tables: LobattoTables::new(stages),
            h,
            t0: start.t,
            taken: 0,
            state: PhasePoint { q: at.q, p, z: at.z },
            velocity: at.v,
            sigma: 1.0,
            evaluations: 0,
            workspace: Workspace::new(stages),
        })
    }

    /// Checks the number of stages.
    pub(super) fn check(stages: usize) -> Result<(), InputError> {
        if STAGES.contains(&stages) { Ok(()) } else { Err(ConstraintError::Stages { found: stages }.into()) }
    }

    /// The step from a state on the constraint, over any scalar: on dual numbers it is the step with its derivatives
    /// along vectors that are tangent to `c(q) = 0`. `guess` is the velocity at the state.
    ///
    /// # Errors
    /// [`StepError`]: the stages are not found, the constraints are dependent, a factor is not positive, or a value is
    /// not finite.
    pub fn step<T: Scalar>(
        &self,
        t: f64,
        from: &PhasePoint<N, T>,
        guess: &SVector<f64, N>,
    ) -> Result<LobattoStep<N, T>, StepError> {
        self.step_varied(t, from, guess, &mut Unvaried)
    }

    /// The same step of a varied Lagrangian.
    pub(super) fn step_varied<T: Scalar>(
        &self,
        t: f64,
        from: &PhasePoint<N, T>,
        guess: &SVector<f64, N>,
        vary: &mut impl Vary<N, T>,
    ) -> Result<LobattoStep<N, T>, StepError> {
        self.solve(t, from, guess, vary, &mut Workspace::new(self.tables.b.len()))
    }

    /// The current velocity, with the position and the action.
    pub fn velocity_point(&self) -> VelocityPoint<N> {
        VelocityPoint { q: self.state.q, v: self.velocity, z: self.state.z }
    }

    /// The acceleration and the multipliers of the motion at the current state, from the constrained Herglotz
    /// equations; the constraint force is `G^T lambda`.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where the constraints are dependent.
    pub fn constrained_motion(&self) -> Result<ConstrainedMotion<N, M>, GeometryError> {
        constrained_motion(&self.lagrangian, &self.constraint, self.time(), &self.velocity_point(), self.redundancy)
    }

    /// The multipliers alone; see [`constrained_motion`](Self::constrained_motion).
    ///
    /// # Errors
    /// Those of [`constrained_motion`](Self::constrained_motion).
    pub fn multipliers(&self) -> Result<SVector<f64, M>, GeometryError> {
        Ok(self.constrained_motion()?.multipliers)
    }

    /// Solves the equations of a step.
    fn solve<T: Scalar>(
        &self,
        t: f64,
        from: &PhasePoint<N, T>,
        guess: &SVector<f64, N>,
        vary: &mut impl Vary<N, T>,
        work: &mut Workspace<N, M, T>,
    ) -> Result<LobattoStep<N, T>, StepError> {
        let jacobian = self.constraint.with_jacobian(&from.q.map(|q| q.re())).1;
        let kept = self.redundancy.imposed(self.constraint.count(), &jacobian);
        for stage in &mut work.stages {
            (stage.v, stage.rho, stage.z) = (guess.map(T::from), T::one(), from.z);
            stage.y = SVector::from_fn(|_, _| T::zero());
        }
        let mut corrections = Corrections::new();
        let mut progress = Progress::Slow;
        for k in 0.. {
            self.evaluate(t, from, vary, work);
            self.residual(from, &kept, work);
            // Two evaluations of the matrix suffice, unless the iteration is slow.
            if k < 2 || progress == Progress::Slow {
                self.linearise(t, &kept, work)?;
            }
            work.system.solve(&mut work.residual);
            let size = correct(work, extent(&from.q), self.h);
            progress = corrections.after(size, 1.0)?;
            if progress == Progress::Ended {
                break;
            }
        }
        self.evaluate(t, from, vary, work);
        self.last((t, from), &kept, vary, work)
    }

    /// Evaluates the positions of the stages, the Lagrangian and the constraints there.
    fn evaluate<T: Scalar>(
        &self,
        t: f64,
        from: &PhasePoint<N, T>,
        vary: &mut impl Vary<N, T>,
        work: &mut Workspace<N, M, T>,
    ) {
        for i in 0..work.stages.len() {
            let mut q = from.q;
            for (j, stage) in work.stages.iter().enumerate().filter(|(j, _)| self.tables.a[i][*j] != 0.0) {
                q += stage.v * T::from(self.h * self.tables.a[i][j]);
            }
            let stage = &mut work.stages[i];
            stage.q = q;
            let x = VelocityPoint { q, v: stage.v, z: stage.z };
            let time = t + self.tables.c[i] * self.h;
            (stage.value, stage.gradient) = self.lagrangian.with_gradient(T::from(time), &x);
            vary.add(time, &x, &mut stage.value, &mut stage.gradient);
            (stage.c, stage.g) = vary.constraint(&self.constraint, &q);
            if const { L::HINTS.forced } {
                stage.applied = self.lagrangian.applied_force(T::from(time), &x);
            }
            stage.force = (stage.gradient.x + stage.applied) * (stage.rho * self.h) + stage.g.transpose() * stage.y;
        }
        work.evaluations += work.stages.len() as u64;
    }

    /// The residuals, in the order momenta, factors, actions, constraints; see the definition of the method.
    fn residual<T: Scalar>(&self, from: &PhasePoint<N, T>, kept: &[bool; M], work: &mut Workspace<N, M, T>) {
        let (h, s, stages) = (self.h, work.stages.len(), &work.stages);
        for i in 0..s {
            let stage = &stages[i];
            let (mut p, mut rho, mut z) =
                (from.p - stage.gradient.y * stage.rho, T::one() - stage.rho, from.z - stage.z);
            for (other, (a, a_hat)) in stages.iter().zip(self.tables.a[i].iter().zip(&self.tables.a_hat[i])) {
                p += other.force * T::from(*a_hat);
                rho -= other.rho * other.gradient.z * (h * a_hat);
                z += other.value * (h * a);
            }
            (0..N).for_each(|k| work.residual[i * N + k] = p[k]);
            work.residual[s * N + i] = rho;
            work.residual[s * (N + 1) + i] = z;
            if i > 0 {
                for (a, kept) in kept.iter().enumerate() {
                    let entry = if *kept { stage.c[a] / h } else { stages[i - 1].y[a] };
                    work.residual[s * (N + 2) + (i - 1) * M + a] = entry;
                }
            }
        }
    }

    /// The matrix of Newton's method at the current stages.
    fn linearise<T: Scalar>(&self, t: f64, kept: &[bool; M], work: &mut Workspace<N, M, T>) -> Result<(), StepError> {
        let (h, s) = (self.h, work.stages.len());
        let (rhos, zs, ys) = (s * N, s * (N + 1), s * (N + 2));
        work.system.clear();
        for j in 0..s {
            let stage = &work.stages[j];
            let (rho, g) = (stage.rho.re(), stage.g.map(|e| e.re()));
            let slope = real(&stage.gradient);
            let x = VelocityPoint { q: stage.q.map(|e| e.re()), v: stage.v.map(|e| e.re()), z: stage.z.re() };
            let hessian = self.lagrangian.hessian(t + self.tables.c[j] * h, &x);
            let y = stage.y.map(|e| e.re());
            let mut stiffness = hessian.qq * (h * rho) + self.constraint.force_slope(&x.q, &y);
            // The derivatives of the impulse `rho (L_q + f)` in the velocity, the factor and the action.
            let (mut by_velocity, mut by_factor, mut by_action) = (hessian.qv, slope.x, hessian.qz);
            if let Some(applied) = AppliedForce::of(&self.lagrangian, t + self.tables.c[j] * h, &x) {
                stiffness += applied.q * (h * rho);
                by_velocity += applied.v;
                by_factor += applied.value;
                by_action += applied.z;
            }
            let system = &mut work.system;
            // Stage j enters the equations of stage i by the weights a_hat_ij or a_ij, and itself directly.
            for i in 0..s {
                let (a, a_hat, own) = (self.tables.a[i][j], self.tables.a_hat[i][j], i == j);
                for m in 0..N {
                    let row = i * N + m;
                    let direct = if own { rho } else { 0.0 };
                    for k in 0..N {
                        system.add(row, j * N + k, a_hat * h * rho * by_velocity[(m, k)] - direct * hessian.vv[(m, k)]);
                        for l in 0..s {
                            let moved = h * self.tables.a[j][l];
                            let by_position = a_hat * stiffness[(m, k)] - direct * hessian.qv[(k, m)];
                            system.add(row, l * N + k, moved * by_position);
                        }
                    }
                    let own_momentum = if own { slope.y[m] } else { 0.0 };
                    system.add(row, rhos + j, a_hat * h * by_factor[m] - own_momentum);
                    system.add(row, zs + j, a_hat * h * rho * by_action[m] - direct * hessian.vz[m]);
                    if j + 1 < s {
                        (0..M).for_each(|b| system.add(row, ys + j * M + b, a_hat * g[(b, m)]));
                    }
                }
                for k in 0..N {
                    system.add(rhos + i, j * N + k, -h * a_hat * rho * hessian.vz[k]);
                    system.add(zs + i, j * N + k, h * a * slope.y[k]);
                    for l in 0..s {
                        let moved = h * self.tables.a[j][l];
                        system.add(rhos + i, l * N + k, -h * a_hat * rho * hessian.qz[k] * moved);
                        system.add(zs + i, l * N + k, h * a * slope.x[k] * moved);
                    }
                }
                let one = if own { 1.0 } else { 0.0 };
                system.add(rhos + i, rhos + j, -h * a_hat * slope.z - one);
                system.add(rhos + i, zs + j, -h * a_hat * rho * hessian.zz);
                system.add(zs + i, zs + j, h * a * slope.z - one);
            }
            if j > 0 {
                for a in 0..M {
                    let row = ys + (j - 1) * M + a;
                    if !kept[a] {
                        system.add(row, row, 1.0);
                        continue;
                    }
                    for (l, k) in (0..s).flat_map(|l| (0..N).map(move |k| (l, k))) {
                        system.add(row, l * N + k, self.tables.a[j][l] * g[(a, k)]);
                    }
                }
            }
        }
        work.system.factorise()
    }

    /// The momentum and the velocity at the end, from the stages.
    fn last<T: Scalar>(
        &self,
        (t, from): (f64, &PhasePoint<N, T>),
        kept: &[bool; M],
        vary: &mut impl Vary<N, T>,
        work: &mut Workspace<N, M, T>,
    ) -> Result<LobattoStep<N, T>, StepError> {
        let (h, b) = (self.h, &self.tables.b);
        let (mut momentum, mut rho) = (from.p, T::one());
        for (stage, b) in work.stages.iter().zip(b) {
            // The last stage has no impulse yet.
            momentum += stage.force * T::from(*b);
            rho -= stage.rho * stage.gradient.z * (h * b);
        }
        let smallest = work.stages.iter().map(|stage| stage.rho.re()).fold(rho.re(), f64::min);
        if smallest <= 0.0 {
            return Err(StepError::StageFactor { rho: smallest });
        }
        let Some(end) = work.stages.last().copied() else { return Err(StepError::NonFinite) };
        let time = t + h;
        let (mut v, mut y) = (end.v, SVector::<T, M>::from_fn(|_, _| T::zero()));
        let mut corrections = Corrections::new();
        let real = end.g.map(|e| e.re());
        loop {
            let x = VelocityPoint { q: end.q, v, z: end.z };
            let (mut value, mut slope) = self.lagrangian.with_gradient(T::from(time), &x);
            vary.add(time, &x, &mut value, &mut slope);
            let defect = slope.y * rho - momentum - end.g.transpose() * y;
            let normal = end.g * v;
            (0..N).for_each(|k| work.last_residual[k] = defect[k]);
            (0..M).for_each(|a| work.last_residual[N + a] = if kept[a] { normal[a] } else { y[a] });
            let x = VelocityPoint { q: end.q.map(|e| e.re()), v: v.map(|e| e.re()), z: end.z.re() };
            let mass = self.lagrangian.mass_matrix(time, &x);
            let system = &mut work.last_system;
            system.clear();
            for m in 0..N {
                (0..N).for_each(|k| system.add(m, k, mass[(m, k)] * rho.re()));
                (0..M).for_each(|a| system.add(m, N + a, -real[(a, m)]));
            }
            for a in 0..M {
                if kept[a] {
                    (0..N).for_each(|k| system.add(N + a, k, real[(a, k)]));
                } else {
                    system.add(N + a, N + a, 1.0);
                }
            }
            system.factorise()?;
            system.solve(&mut work.last_residual);
            let change = SVector::<T, N>::from_fn(|k, _| work.last_residual[k]);
            v -= change;
            y -= SVector::<T, M>::from_fn(|a, _| work.last_residual[N + a]);
            work.evaluations += 1;
            if corrections.after(extent(&change), velocity_scale(extent(&v), extent(&end.q), h))? == Progress::Ended {
                break;
            }
        }
        if self.redundancy == Redundancy::LeastNorm {
            let residual = extent(&end.c.map(|c| T::from(c.re())));
            if residual > 1e-10 * real.max_abs_or_nan() * (1.0 + extent(&end.q)) {
                return Err(StepError::NotConverged { residual, iterations: 0 });
            }
        }
        let p = (momentum + end.g.transpose() * y) / rho;
        let size = extent(&end.q) + extent(&p) + end.z.extent();
        if !size.is_finite() {
            return Err(StepError::NonFinite);
        }
        Ok(LobattoStep { end: PhasePoint { q: end.q, p, z: end.z }, velocity: v, sigma: rho.recip() })
    }
}

/// Subtracts the corrections; returns the largest of those of velocities and factors, relative to their scale.
fn correct<T: Scalar, const N: usize, const M: usize>(work: &mut Workspace<N, M, T>, position: f64, h: f64) -> f64 {
    let s = work.stages.len();
    let residual = &work.residual;
    let (mut of_velocity, mut of_factor, mut velocity) = (0f64, 0f64, 0f64);
    for (i, stage) in work.stages.iter_mut().enumerate() {
        for k in 0..N {
            stage.v[k] -= residual[i * N + k];
            of_velocity = of_velocity.max(residual[i * N + k].extent());
        }
        stage.rho -= residual[s * N + i];
        of_factor = of_factor.max(residual[s * N + i].extent());
        stage.z -= residual[s * (N + 1) + i];
        if i + 1 < s {
            for a in 0..M {
                stage.y[a] -= residual[s * (N + 2) + i * M + a];
            }
        }
        velocity = velocity.max(extent(&stage.v));
    }
    // An extent is infinite, not NaN, where a number is NaN.
    of_factor.max(of_velocity / velocity_scale(velocity, position, h).min(f64::MAX))
}

/// The derivatives without their differentials.
fn real<T: Scalar, const N: usize>(x: &ChartVector<N, T>) -> ChartVector<N> {
    ChartVector { x: x.x.map(|e| e.re()), y: x.y.map(|e| e.re()), z: x.z.re() }
}

impl<L: Lagrangian<N>, C: Constraint<N, M>, const N: usize, const M: usize> Stepper for ContactLobatto<L, C, N, M> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            let mut workspace = std::mem::replace(&mut self.workspace, Workspace::empty());
            let step = self.solve(self.time(), &self.state, &self.velocity, &mut Unvaried, &mut workspace);
            self.workspace = workspace;
            let step = step.map_err(|cause| StepFailure { taken, cause })?;
            (self.state, self.velocity, self.sigma) = (step.end, step.velocity, step.sigma);
            self.taken += 1;
            self.evaluations += std::mem::take(&mut self.workspace.evaluations);
        }
        Ok(())
    }

    fn state(&self) -> State {
        self.state.into()
    }

    fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn last_step(&self) -> Option<&dyn StepDetails> {
        Some(self)
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl<L: Lagrangian<N>, C: Constraint<N, M>, const N: usize, const M: usize> StepDetails for ContactLobatto<L, C, N, M> {
    fn last_velocity(&self) -> Option<Vector> {
        Some(self.velocity.into())
    }
}

impl<L: Lagrangian<N>, C: Constraint<N, M>, const N: usize, const M: usize> RunSupport for ContactLobatto<L, C, N, M> {
    fn save(&self) -> Option<Vec<u64>> {
        Some(words_of(self))
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        restored_from(self, words)
    }
}

saved!([L, C, const N: usize, const M: usize] ContactLobatto<L, C, N, M> { taken, state, velocity, sigma, evaluations });
