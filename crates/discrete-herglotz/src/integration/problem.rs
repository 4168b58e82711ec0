//! Initial value problems: a Lagrangian with an initial state.

use crate::integration::OfTyped;
use crate::integration::system_problem::{InitialState, SystemProblem, check_time};
use crate::{
    DiscreteLagrangian, InputError, Interrupt, State, StepError,
    theory::{discrete_regularity, legendre_minus},
};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ContactHamiltonian, DiscretePoint, Lagrangian, OfHamiltonian, PhasePoint, Structure, VelocityPoint,
};
use std::rc::Rc;

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

/// With the guess 0 of the velocity. A problem with another number of coordinates refuses it: its action is then NaN.
impl<const N: usize> From<State> for Start<N> {
    fn from(x: State) -> Self {
        let z = if x.q.len() == N { x.z } else { f64::NAN };
        Start::from(PhasePoint { q: x.q.fixed(), p: x.p.fixed(), z })
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

impl<L: ?Sized, const N: usize> Clone for Problem<'_, L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L: ?Sized, const N: usize> Copy for Problem<'_, L, N> {}

impl<'a, L: ?Sized, const N: usize> Problem<'a, L, N> {
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

impl<'a, L: Lagrangian<N>, const N: usize> Problem<'a, L, N> {
    /// The problem of a Lagrangian from a point `(q, v, z)` or `(q, p, z)` at the time `t0`.
    ///
    /// # Errors
    /// [`InputError`]: a time or a state that is not finite, an initial state at which L or a derivative is not
    /// defined, a singular `W = L_vv`, a momentum without a velocity, a false claim of structure.
    pub fn new(lagrangian: &'a L, t0: f64, start: impl Into<Start<N>>) -> Result<Self, InputError> {
        let start = match start.into() {
            Start::Velocity(x) => InitialState::Velocity(x.into()),
            Start::Momentum(x, guess) => InitialState::Momentum(x.into(), guess.into()),
        };
        Ok(SystemProblem::checked(Rc::new(OfTyped(lagrangian)), t0, start)?.of(lagrangian))
    }

    /// The same problem without the type of its Lagrangian.
    pub(crate) fn of_system(&self) -> SystemProblem<'a> {
        let Problem { lagrangian, t0, start, state, from_momentum, structure, interrupt } = *self;
        let system = Rc::new(OfTyped(lagrangian));
        SystemProblem { system, t0, start: start.into(), state: state.into(), from_momentum, structure, interrupt }
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
