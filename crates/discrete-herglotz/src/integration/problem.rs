//! Initial value problems: a Lagrangian with an initial state.

use crate::integration::check_claims::check_claims;
use crate::integration::{AtState, at_state, state_of};
use crate::{
    DiscreteLagrangian, InputError, Interrupt, StepError, System,
    theory::{discrete_regularity, legendre_inverse, legendre_minus},
};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ContactHamiltonian, Defect, DiscretePoint, GeometryError, Lagrangian, OfHamiltonian, PhasePoint, Regularity,
    Structure, VelocityPoint, numbers::max_abs_or_nan,
};

/// The initial state of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start<const N: usize> {
    /// A point `(q, v, z)` of TQ x R.
    Velocity(VelocityPoint<N>),
    /// A point `(q, p, z)` of T\*Q x R, with a guess of its velocity, which is needed where several velocities have the
    /// same momentum.
    Momentum(PhasePoint<N>, SVector<f64, N>),
}

impl<const N: usize> From<VelocityPoint<N>> for Start<N> {
    fn from(x: VelocityPoint<N>) -> Self {
        Start::Velocity(x)
    }
}

/// With the guess 0 of the velocity.
impl<const N: usize> From<PhasePoint<N>> for Start<N> {
    fn from(x: PhasePoint<N>) -> Self {
        Start::Momentum(x, SVector::zeros())
    }
}

/// An initial value problem: a Lagrangian with an initial state, checked on construction.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Problem, Rows, Until};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0))?;
/// let mut rows = Rows::at((0..=100).map(f64::from))?;
/// let outcome = problem.accuracy(1e-9).observe(&mut rows).run(Until::Time(100.0))?;
/// println!("{}: q = {} after {} steps", outcome.status, outcome.q[0], outcome.steps);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Debug)]
pub struct Problem<'a, L: ?Sized, const N: usize> {
    pub(crate) lagrangian: &'a L,
    pub(crate) t0: f64,
    /// The initial state with its velocity, and (`state`) with its momentum.
    pub(crate) start: VelocityPoint<N>,
    pub(crate) state: PhasePoint<N>,
    /// Whether the momentum was given, not the velocity: derivatives with respect to the start are with respect to what
    /// was given.
    pub(crate) from_momentum: bool,
    /// The structure that the Lagrangian claims, verified at the initial state.
    pub(crate) structure: Structure,
    /// The interrupt of its trial runs.
    pub(crate) interrupt: Option<Interrupt<'a>>,
}

/// A problem as runs, checks and searches see it, whatever its Lagrangian.
pub(crate) type SystemProblem<'a, const N: usize> = Problem<'a, dyn System<N> + 'a, N>;

impl<L: ?Sized, const N: usize> Clone for Problem<'_, L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L: ?Sized, const N: usize> Copy for Problem<'_, L, N> {}

impl<'a, L: ?Sized, const N: usize> Problem<'a, L, N> {
    /// The same with another view of the Lagrangian.
    pub(crate) fn with_lagrangian<M: ?Sized>(self, lagrangian: &'a M) -> Problem<'a, M, N> {
        let Problem { t0, start, state, from_momentum, structure, interrupt, .. } = self;
        Problem { lagrangian, t0, start, state, from_momentum, structure, interrupt }
    }

    /// The same with an interrupt for its trial runs and error estimates. A run itself is ended by an
    /// [`Observer`](crate::Observer).
    pub fn with_interrupt(self, interrupt: Interrupt<'a>) -> Self {
        Problem { interrupt: Some(interrupt), ..self }
    }

    /// The Lagrangian.
    pub fn lagrangian(&self) -> &'a L {
        self.lagrangian
    }

    /// The initial time.
    pub fn t0(&self) -> f64 {
        self.t0
    }

    /// The initial state `(q, v, z)`.
    pub fn start(&self) -> &VelocityPoint<N> {
        &self.start
    }

    /// The structure that the Lagrangian claims, verified at the initial state.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// The initial state `(q, p, z)`.
    pub fn state(&self) -> &PhasePoint<N> {
        &self.state
    }
}

impl<'a, const N: usize> SystemProblem<'a, N> {
    /// The problem of a system after all checks of its start.
    fn checked(system: &'a (dyn System<N> + 'a), t0: f64, start: Start<N>) -> Result<Self, InputError> {
        check_time(t0)?;
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if system.hints().hamiltonian {
            return Self::given_by_hamiltonian(system, t0, start);
        }
        let (start, state) = match start {
            Start::Velocity(x) => {
                PhasePoint { q: x.q, p: x.v, z: x.z }.check()?;
                (x, None)
            }
            Start::Momentum(x, guess) => {
                x.check()?;
                (legendre_inverse(system, t0, &x, &guess).map_err(InputError::FirstStep)?, Some(x))
            }
        };
        check_regular(system, t0, &start)?;
        let structure = check_claims(system, t0, &start)?;
        let from_momentum = state.is_some();
        let state = state.unwrap_or_else(|| state_of(system, t0, &start));
        Ok(Problem { lagrangian: system, t0, start, state, from_momentum, structure, interrupt: None })
    }

    /// The problem of a Lagrangian that is given by a contact Hamiltonian.
    fn given_by_hamiltonian(system: &'a (dyn System<N> + 'a), t0: f64, start: Start<N>) -> Result<Self, InputError> {
        if system.hints().switching_functions {
            let hypothesis = "a Lagrangian that is not given by a contact Hamiltonian, since steps end at switches";
            return Err(InputError::Hypothesis { hypothesis });
        }
        let (state, from_momentum) = match start {
            Start::Velocity(x) => {
                PhasePoint { q: x.q, p: x.v, z: x.z }.check()?;
                let state = state_of(system, t0, &x);
                if !state.p.iter().all(|p| p.is_finite()) {
                    return Err(InputError::NoMomentum);
                }
                (state, false)
            }
            Start::Momentum(x, _) => {
                x.check()?;
                (x, true)
            }
        };
        let AtState { x: start, l, force, rate } =
            at_state(system, t0, &state, &SVector::zeros()).map_err(|_| InputError::Undefined)?;
        if !(l.is_finite() && rate.is_finite() && force.iter().all(|f| f.is_finite())) {
            return Err(InputError::Undefined);
        }
        let structure = check_claims(system, t0, &start)?;
        if let Some(Defect { claim, size }) = system.hamiltonian_defect(t0, &state) {
            return Err(InputError::FalseClaim { claim, size });
        }
        Ok(Problem { lagrangian: system, t0, start, state, from_momentum, structure, interrupt: None })
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Problem<'a, L, N> {
    /// The problem of a Lagrangian from a point `(q, v, z)` or `(q, p, z)` at the time `t0`.
    ///
    /// # Errors
    /// [`InputError`]: a time or a state that is not finite, an initial state at which L or a derivative is not
    /// defined, a singular `W = L_vv`, a momentum without a velocity, a false claim of structure.
    pub fn new(lagrangian: &'a L, t0: f64, start: impl Into<Start<N>>) -> Result<Self, InputError> {
        Ok(SystemProblem::checked(lagrangian, t0, start.into())?.with_lagrangian(lagrangian))
    }

    /// The same problem without the type of its Lagrangian.
    pub(crate) fn of_system(&self) -> SystemProblem<'a, N> {
        self.with_lagrangian(self.lagrangian as &(dyn System<N> + 'a))
    }

    /// The problem from two positions and the action, as in the paper: the state at `t0` is `F-L_d (q0, q1, z0)`.
    ///
    /// # Errors
    /// Those of [`new`](Self::new); [`InputError::Sigma`] where `sigma_d <= 0`; [`InputError::FirstStep`] where the
    /// discrete Lagrangian is not regular at the point, [`InputError::EqualPoints`] where it is not regular because
    /// `q0 = q1`.
    pub fn from_points(
        lagrangian: &'a L,
        ld: &impl DiscreteLagrangian<N>,
        t0: f64,
        x: DiscretePoint<N>,
    ) -> Result<Self, InputError> {
        check_time(t0)?;
        let state = start_of(ld, t0, &x)?;
        Self::new(lagrangian, t0, Start::Momentum(state, (x.q1 - x.q0) / ld.step_size()))
    }
}

impl<'a, H: ContactHamiltonian<N>, const N: usize> Problem<'a, OfHamiltonian<H>, N> {
    /// The problem of a contact Hamiltonian from a state `(q, p, z)` at the time `t0`, whatever the rank of `H_pp`.
    ///
    /// ```
    /// use contact_geom::{nalgebra::SVector, ContactHamiltonian, OfHamiltonian, PhasePoint, Scalar};
    /// use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
    /// /// `q' = -q^3`: H is linear in p.
    /// struct Decay;
    /// impl ContactHamiltonian<1> for Decay {
    ///     #[inline(always)]
    ///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
    ///         -p[0] * q[0].powi(3)
    ///     }
    /// }
    /// let decay = OfHamiltonian(Decay);
    /// let problem = Problem::of_hamiltonian(&decay, 0.0, PhasePoint::new([1.0], [1.0], 0.0))?;
    /// let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.1));
    /// let outcome = run.run(Until::Time(1.0))?;
    /// assert!((outcome.q[0] - 1.0 / 3.0_f64.sqrt()).abs() < 1e-14);
    /// # Ok::<(), discrete_herglotz::InputError>(())
    /// ```
    ///
    /// # Errors
    /// [`InputError`]: a time or a state that is not finite, a state at which H or a derivative is not defined, a false
    /// claim of structure.
    pub fn of_hamiltonian(
        hamiltonian: &'a OfHamiltonian<H>,
        t0: f64,
        start: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        Self::new(hamiltonian, t0, Start::Momentum(start, SVector::zeros()))
    }
}

/// The state `F-L_d (q0, q1, z0)` at the first of two points.
pub(crate) fn start_of<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t0: f64,
    x: &DiscretePoint<N>,
) -> Result<PhasePoint<N>, InputError> {
    x.check()?;
    let bad = |cause| if x.q0 == x.q1 { InputError::EqualPoints } else { InputError::FirstStep(cause) };
    let regularity = discrete_regularity(ld, t0, x).map_err(bad)?;
    let sigma = regularity.sigma;
    if sigma <= 0.0 {
        return Err(InputError::Sigma { sigma });
    }
    // The comparison is written so that a NaN fails it.
    let regular = regularity.fibre.condition() < 1.0 / f64::EPSILON;
    if !(sigma.is_finite() && regular) {
        return Err(bad(StepError::Singular { pivot: regularity.fibre.smallest }));
    }
    legendre_minus(ld, t0, x).map_err(bad)
}

/// Returns an error for a time that is not finite.
pub(crate) fn check_time(t0: f64) -> Result<(), GeometryError> {
    if t0.is_finite() { Ok(()) } else { Err(GeometryError::NonFinite { what: "t0", index: 0, value: t0 }) }
}

/// Returns an error for an initial state at which L is not defined or not regular.
fn check_regular<const N: usize>(system: &dyn System<N>, t0: f64, start: &VelocityPoint<N>) -> Result<(), InputError> {
    let (g, w) = (system.gradient(t0, start), system.hessian(t0, start).vv);
    let value = system.value(t0, start);
    if !(value.is_finite() && g.is_finite() && w.iter().all(|e| e.is_finite())) {
        return Err(InputError::Undefined);
    }
    // W is scaled so that its rows have size one, since masses may differ by any factor.
    let unit = SVector::<f64, N>::from_fn(|i, _| max_abs_or_nan(w.row(i).iter().copied()).sqrt());
    let scaled = DMatrix::from_fn(N, N, |i, j| w[(i, j)] / (unit[i] * unit[j]));
    let Regularity { smallest, largest } = Regularity::of(scaled);
    // A row of zeros cannot be scaled, and the comparison treats it as singular.
    if smallest > 4.0 * N as f64 * f64::EPSILON * largest {
        return Ok(());
    }
    Err(InputError::FirstStep(StepError::Singular { pivot: smallest }))
}
