//! RATTLE with a linear drag, and its compositions.

use super::linear_system::SmallSystem;
use super::start::inverse_mass;
use super::variation::{Unvaried, Vary};
use super::{ConstrainedStart, Corrections, Progress};
use crate::numbers::extent::extent;
use crate::numbers::state_words::{restored_from, saved, words_of};
use crate::splitting::separable::SeparableForm;
use crate::{InputError, RunSupport, SplittingScheme, State, StepError, StepFailure, Stepper};
use contact_geom::constraints::{ConstrainedMotion, Constraint, ConstraintDerivatives, Redundancy, constrained_motion};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::numbers::dot;
use contact_geom::support::{independent_rows, least_norm, restricted};
use contact_geom::{ChartVector, Derivatives, GeometryError, Lagrangian, PhasePoint, Scalar, VelocityPoint};

/// RATTLE between two halves of a linear drag, `D_(h/2) o RATTLE_h o D_(h/2)`, and its symmetric compositions of order
/// up to 10, for `L = v.Mv/2 - V(t, q) + gamma z` on `c(q) = 0`, with the current state.
///
/// D is the flow of `-gamma z`, `p -> e^(gamma h/2) p`, `z -> e^(gamma h/2) z`. RATTLE with the action is, with
/// `G = c_q`,
///
/// `p_h = p0 - h/2 V_q(q0) + G(q0)^T Y`, `q1 = q0 + h M^-1 p_h`, `c(q1) = 0`,
/// `p1 = p_h - h/2 V_q(q1) + G(q1)^T Y'`, `G(q1) M^-1 p1 = 0`,
/// `z1 = z0 + h p_h.M^-1 p_h/2 - h (V(q0) + V(q1))/2`.
///
/// Both are conformally contact on `T*N x R`, hence also the step, with `sigma_d = e^(gamma h)` exactly. A step
/// evaluates one new force, and solves for the M multipliers alone.
///
/// Reference: Hairer, Lubich and Wanner, Geometric Numerical Integration, section VII.1.4, for RATTLE.
///
/// ```
/// use contact_examples::systems::constrained::RigidPendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{SplittingScheme, Stepper, constraints::{ConstrainedStart, DragRattle}};
/// let pendulum = RigidPendulum::<2> { gravity: 9.81, gamma: -0.1 };
/// let start = ConstrainedStart::new(VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0));
/// let mut motion = DragRattle::new(&pendulum, &pendulum, &SplittingScheme::KAHAN_LI_8, 0.1, &start)?;
/// motion.advance(100)?;
/// println!("{:?}, tension {}", motion.state(), motion.multipliers()?[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct DragRattle<L, C, const N: usize, const M: usize> {
    form: SeparableForm<L, N>,
    constraint: C,
    inverse: SMatrix<f64, N, N>,
    gamma: f64,
    redundancy: Redundancy,
    substeps: Vec<f64>,
    h: f64,
    t0: f64,
    taken: usize,
    state: PhasePoint<N>,
    sigma: f64,
    impulse: SVector<f64, M>,
    evaluations: u64,
}

/// One step: its final state, and the impulses of the constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RattleStep<const N: usize, const M: usize, T = f64> {
    /// The state `(q, p, z)` at the end.
    pub end: PhasePoint<N, T>,
    /// The sum of the impulses `Y + Y'` of all substeps. It vanishes on dependent constraints that were left out.
    pub impulse: SVector<T, M>,
}

/// `-V`, `-V_q` and `G = c_q` at a position, and the responses `M^-1 G^T` of the velocity to impulses, as real numbers.
struct Place<const N: usize, const M: usize, T> {
    value: T,
    force: SVector<T, N>,
    jacobian: SMatrix<T, M, N>,
    responses: SMatrix<f64, N, M>,
}

impl<L: Lagrangian<N>, C: Constraint<N, M>, const N: usize, const M: usize> DragRattle<L, C, N, M> {
    /// The motion with steps of the length h from a start, composed by a scheme.
    ///
    /// # Errors
    /// [`InputError`]: a start off the constraints, dependent constraints; and of the Lagrangian: it does not
    /// claim to be `separable` with a constant rate `L_z`, or is not; a scheme of Runge-Kutta-Nystrom type.
    pub fn new(
        lagrangian: L,
        constraint: C,
        scheme: &SplittingScheme,
        h: f64,
        start: &ConstrainedStart<N>,
    ) -> Result<Self, InputError> {
        let motion = Self::of(lagrangian, constraint, scheme, h, start)?;
        // The first step is tried, so that input that cannot be advanced is refused.
        motion.step(start.t, &motion.state).map_err(InputError::FirstStep)?;
        Ok(motion)
    }

    /// The motion, without the trial of its first step.
    pub(super) fn of(
        lagrangian: L,
        constraint: C,
        scheme: &SplittingScheme,
        h: f64,
        start: &ConstrainedStart<N>,
    ) -> Result<Self, InputError> {
        let substeps = substeps(scheme)?;
        let at = start.at;
        let form = SeparableForm::read(lagrangian, h, start.t, &PhasePoint { q: at.q, p: at.v, z: at.z })?;
        if !form.lagrangian.structure().has_constant_rate() {
            let hypothesis = "a drag L_z that is constant";
            return Err(InputError::Hypothesis { hypothesis });
        }
        let at = start.resolved_for(&form.lagrangian, &constraint, h)?;
        let gamma = form.lagrangian.rate(start.t, &at);
        let p = form.lagrangian.gradient(start.t, &at).y;
        let inverse = inverse_mass(&form.lagrangian, start.t, &at)?;
        Ok(DragRattle {
            form,
            constraint,
            inverse,
            gamma,
            redundancy: start.redundancy,
            substeps,
            h,
            t0: start.t,
            taken: 0,
            state: PhasePoint { q: at.q, p, z: at.z },
            sigma: 1.0,
            impulse: SVector::zeros(),
            evaluations: 0,
        })
    }

    /// The step from a state on the constraint, over any scalar: on dual numbers it is the step with its derivatives
    /// along vectors that are tangent to `c(q) = 0`.
    ///
    /// # Errors
    /// [`StepError`]: the multipliers are not found, the constraints are dependent, or a value is not finite.
    pub fn step<T: Scalar>(&self, t: f64, from: &PhasePoint<N, T>) -> Result<RattleStep<N, M, T>, StepError> {
        self.step_varied(t, from, &mut Unvaried)
    }

    /// The same step of a Lagrangian whose variation has the same form: of M, V and gamma.
    pub(super) fn step_varied<T: Scalar, V: Vary<N, T>>(
        &self,
        t: f64,
        from: &PhasePoint<N, T>,
        vary: &mut V,
    ) -> Result<RattleStep<N, M, T>, StepError> {
        let mut step = RattleStep { end: *from, impulse: SVector::from_fn(|_, _| T::zero()) };
        let mut gamma = T::from(self.gamma);
        if const { V::VARIES } {
            gamma += varied(vary, t, &rest(&from.q)).1.z;
        }
        let mut time = t;
        let mut place = self.place(t, &step.end.q, vary);
        for g in &self.substeps {
            let h = g * self.h;
            drag(gamma * (0.5 * h), &mut step.end);
            place = self.rattle(time, h, (&mut step, &place), vary)?;
            drag(gamma * (0.5 * h), &mut step.end);
            time += h;
        }
        Ok(step)
    }

    /// What a substep needs of a position; the end of each substep is the start of the next.
    fn place<T: Scalar, V: Vary<N, T>>(&self, t: f64, q: &SVector<T, N>, vary: &mut V) -> Place<N, M, T> {
        let (_, jacobian) = vary.constraint(&self.constraint, q);
        let (value, force) = self.kick(t, q, vary);
        let responses = self.inverse * jacobian.map(|e| e.re()).transpose();
        Place { value, force, jacobian, responses }
    }

    /// `-V` and `-V_q` at a position.
    fn kick<T: Scalar, V: Vary<N, T>>(&self, t: f64, q: &SVector<T, N>, vary: &mut V) -> (T, SVector<T, N>) {
        let at = rest(q);
        let (mut value, mut force) = self.form.lagrangian.with_force(T::from(t), &at);
        if const { V::VARIES } {
            let (l, slope) = varied(vary, t, &at);
            value += l;
            force += slope.x;
        }
        (value, force)
    }

    /// The velocity `M^-1 p` at a time and a position.
    fn velocity<T: Scalar, V: Vary<N, T>>(
        &self,
        t: f64,
        (q, p): (&SVector<T, N>, &SVector<T, N>),
        vary: &mut V,
    ) -> SVector<T, N> {
        let mut v = times(&self.inverse, p);
        if const { V::VARIES } {
            // The variation of `M v = p` for a given p.
            let of_momentum = varied(vary, t, &VelocityPoint { q: *q, v, z: T::zero() }).1.y;
            v -= times(&self.inverse, &of_momentum);
        }
        v
    }

    /// RATTLE with the action, from a place to the one that it returns.
    fn rattle<T: Scalar, V: Vary<N, T>>(
        &self,
        t: f64,
        h: f64,
        (step, from): (&mut RattleStep<N, M, T>, &Place<N, M, T>),
        vary: &mut V,
    ) -> Result<Place<N, M, T>, StepError> {
        let PhasePoint { q: q0, mut p, mut z } = step.end;
        let (half, g0) = (T::from(0.5 * h), &from.jacobian);
        p += from.force * half;
        z += from.value * half;
        let count = self.constraint.count();
        let kept = self.redundancy.imposed(count, &g0.map(|e| e.re()));
        let system = |g: &SMatrix<T, M, N>, responses| {
            SmallSystem::new(&restricted(g.map(|e| e.re()) * responses, &kept), count)
        };
        let responses = from.responses * h;
        let (mut corrections, mut known) = (Corrections::new(), None);
        let mut q;
        loop {
            q = q0 + self.velocity(t, (&q0, &p), vary) * T::from(h);
            // The matrix of the first iteration is at the position without constraints, which is near: it is kept
            // unless that is slow.
            let (mut c, solver) = match known.take() {
                Some(solver) => (vary.constraint_values(&self.constraint, &q), solver),
                None => {
                    let (c, g) = vary.constraint(&self.constraint, &q);
                    (c, system(&g, responses)?)
                }
            };
            mask(&mut c, &kept);
            solver.solve(c.as_mut_slice());
            let push = g0.transpose() * c;
            p -= push;
            step.impulse -= c;
            let moved = times(&self.inverse, &push) * T::from(h);
            match corrections.after(extent(&moved), extent(&q))? {
                Progress::Ended => {
                    q -= moved;
                    break;
                }
                Progress::Continues => known = Some(solver),
                Progress::Slow => {}
            }
        }
        let v = self.velocity(t, (&q0, &p), vary);
        z += dot(p, v) * half;
        let to = self.place(t + h, &q, vary);
        p += to.force * half;
        z += to.value * half;
        let g = &to.jacobian;
        let solver = system(g, to.responses)?;
        // The second pass completes the derivatives of dual numbers, the third removes round-off.
        for _ in 0..3 {
            let mut normal = g * self.velocity(t, (&q, &p), vary);
            mask(&mut normal, &kept);
            solver.solve(normal.as_mut_slice());
            p -= g.transpose() * normal;
            step.impulse -= normal;
        }
        if self.redundancy == Redundancy::LeastNorm {
            self.check_dependent(&q)?;
        }
        step.end = PhasePoint { q, p, z };
        let size = extent(&q) + extent(&p) + z.extent();
        if size.is_finite() { Ok(to) } else { Err(StepError::NonFinite) }
    }

    /// Checks that the constraints that were left out hold as well.
    fn check_dependent<T: Scalar>(&self, q: &SVector<T, N>) -> Result<(), StepError> {
        let q = q.map(|x| x.re());
        let (c, g) = self.constraint.with_jacobian(&q);
        let residual = c.max_abs_or_nan();
        let bound = 1e-10 * g.max_abs_or_nan() * (1.0 + q.max_abs_or_nan());
        if residual <= bound { Ok(()) } else { Err(StepError::NotConverged { residual, iterations: 0 }) }
    }

    /// The velocity and the action with the position of the current state.
    pub fn velocity_point(&self) -> VelocityPoint<N> {
        VelocityPoint { q: self.state.q, v: self.inverse * self.state.p, z: self.state.z }
    }

    /// The acceleration and the multipliers of the motion at the current state; the constraint force is `G^T lambda`.
    /// They are computed from the constrained Herglotz equations at the state, so that they have the accuracy of the
    /// state. Where the constraints are redundant, the multipliers are those of least norm.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where the constraints are dependent.
    pub fn constrained_motion(&self) -> Result<ConstrainedMotion<N, M>, GeometryError> {
        let x = self.velocity_point();
        constrained_motion(&self.form.lagrangian, &self.constraint, self.time(), &x, self.redundancy)
    }

    /// The multipliers alone; see [`constrained_motion`](Self::constrained_motion).
    ///
    /// # Errors
    /// Those of [`constrained_motion`](Self::constrained_motion).
    pub fn multipliers(&self) -> Result<SVector<f64, M>, GeometryError> {
        Ok(self.constrained_motion()?.multipliers)
    }

    /// The impulse of the constraints in the last step, the sum over its substeps: `G^T impulse / h` is a mean of the
    /// constraint force, of order 2 without a composition. Where the constraints are redundant, the impulse of least
    /// norm for the Jacobian at the end of the step.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where the constraints are dependent.
    pub fn impulse(&self) -> Result<SVector<f64, M>, GeometryError> {
        if self.redundancy == Redundancy::Refuse {
            return Ok(self.impulse);
        }
        let g = self.constraint.with_jacobian(&self.state.q).1;
        least_norm(&g, &independent_rows(&g), &self.impulse)
            .map_err(|e| e.of("c_q c_q^T", "choose a state at which the rank of c_q is that near it"))
    }
}

impl<L: Lagrangian<N>, C: Constraint<N, M>, const N: usize, const M: usize> Stepper for DragRattle<L, C, N, M> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            let step = self.step(self.time(), &self.state).map_err(|cause| StepFailure { taken, cause })?;
            (self.state, self.impulse) = (step.end, step.impulse);
            self.sigma = (self.gamma * self.h).exp();
            self.taken += 1;
            self.evaluations += 1 + self.substeps.len() as u64;
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

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl<L: Lagrangian<N>, C: Constraint<N, M>, const N: usize, const M: usize> RunSupport for DragRattle<L, C, N, M> {
    fn has_constant_rate(&self) -> bool {
        true
    }

    fn save(&self) -> Option<Vec<u64>> {
        Some(words_of(self))
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        restored_from(self, words)
    }
}

saved!([L, C, const N: usize, const M: usize] DragRattle<L, C, N, M> { taken, state, sigma, impulse, evaluations });

/// The substeps of a composition of symmetric steps.
pub(super) fn substeps(scheme: &SplittingScheme) -> Result<Vec<f64>, InputError> {
    let hypothesis = "a composition of symmetric steps, not a Nyström splitting";
    scheme.substeps().ok_or(InputError::Hypothesis { hypothesis })
}

/// The flow of the drag for a product of its rate with a time.
fn drag<T: Scalar, const N: usize>(rate: T, x: &mut PhasePoint<N, T>) {
    let damping = rate.exp_m1();
    x.p = x.p.map(|p| p + p * damping);
    x.z += x.z * damping;
}

/// A position at rest, where L is `-V`.
fn rest<T: Scalar, const N: usize>(q: &SVector<T, N>) -> VelocityPoint<N, T> {
    VelocityPoint { q: *q, v: SVector::from_fn(|_, _| T::zero()), z: T::zero() }
}

/// The variation of the value and the gradient of L at a point.
fn varied<T: Scalar, const N: usize>(
    vary: &mut impl Vary<N, T>,
    t: f64,
    x: &VelocityPoint<N, T>,
) -> (T, ChartVector<N, T>) {
    let none = SVector::from_fn(|_, _| T::zero());
    let (mut value, mut slope) = (T::zero(), ChartVector { x: none, y: none, z: T::zero() });
    vary.add(t, x, &mut value, &mut slope);
    (value, slope)
}

/// The product of a real matrix with a vector of any numbers.
pub(super) fn times<T: Scalar, const N: usize>(matrix: &SMatrix<f64, N, N>, x: &SVector<T, N>) -> SVector<T, N> {
    SVector::from_fn(|i, _| {
        let mut sum = T::zero();
        for j in 0..N {
            // Entries that vanish, as those of a diagonal mass matrix, add nothing.
            if matrix[(i, j)] != 0.0 {
                sum += x[j] * matrix[(i, j)];
            }
        }
        sum
    })
}

/// Sets the entries of dependent constraints to 0.
fn mask<T: Scalar, const M: usize>(x: &mut SVector<T, M>, kept: &[bool; M]) {
    for a in 0..M {
        if !kept[a] {
            x[a] = T::zero();
        }
    }
}
