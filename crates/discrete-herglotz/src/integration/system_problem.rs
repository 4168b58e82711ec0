//! Initial value problems as runs, checks and searches see them.

use crate::integration::Problem;
use crate::integration::check_claims::verified_structure;
use crate::system::{AtState, Guarded};
use crate::{InputError, Interrupt, Point, State, StepError, System, Vector};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{Defect, GeometryError, Lagrangian, Regularity, Structure, numbers::max_abs_or_nan};
use std::rc::Rc;

/// The initial state of a motion of a [`System`].
#[derive(Clone, Debug, PartialEq)]
pub enum InitialState {
    /// A point `(q, v, z)` of TQ x R.
    Velocity(Point),
    /// A point `(q, p, z)` of T\*Q x R, with a guess of its velocity, which is needed where several velocities have the
    /// same momentum.
    Momentum(State, Vector),
}

impl From<Point> for InitialState {
    fn from(x: Point) -> Self {
        InitialState::Velocity(x)
    }
}

/// With the guess 0 of the velocity.
impl From<State> for InitialState {
    fn from(x: State) -> Self {
        let guess = Vector::zeros(x.q.len());
        InitialState::Momentum(x, guess)
    }
}

/// An initial value problem of a [`System`], whose number of coordinates is known at run time. Its runs are by contact
/// Gauss collocation, which evaluates the system at one point at a time; a [`Problem`] of a Lagrangian with a fixed number
/// of coordinates is faster, and has all integrators.
///
/// ```
/// use contact_geom::nalgebra::DMatrix;
/// use discrete_herglotz::{Components, Point, SecondDerivatives, System, SystemProblem, Until, Vector};
///
/// /// A chain of n particles between walls, with `L = v^2/2 - sum of (q_(i+1) - q_i)^2/2 - z/10`.
/// struct Chain(usize);
///
/// impl System for Chain {
///     fn dimension(&self) -> usize {
///         self.0
///     }
///     fn value(&self, _t: f64, x: &Point) -> f64 {
///         let at = |i: usize| x.q.get(i).copied().unwrap_or(0.0);
///         let springs: f64 = (0..=self.0).map(|i| (at(i) - if i > 0 { at(i - 1) } else { 0.0 }).powi(2)).sum();
///         (x.v.norm_squared() - springs) / 2.0 - x.z / 10.0
///     }
///     fn gradient(&self, _t: f64, x: &Point) -> Components {
///         let at = |i: usize| x.q.get(i).copied().unwrap_or(0.0);
///         let force = |i: usize| at(i + 1) + if i > 0 { at(i - 1) } else { 0.0 } - 2.0 * at(i);
///         Components { x: Vector::from_fn(self.0, force), y: x.v.clone(), z: -0.1 }
///     }
///     fn hessian(&self, _t: f64, _x: &Point) -> SecondDerivatives {
///         let n = self.0;
///         let qq = DMatrix::from_fn(n, n, |i, j| if i == j { -2.0 } else { f64::from(u8::from(i.abs_diff(j) == 1)) });
///         let (qv, line) = (DMatrix::zeros(n, n), Vector::zeros(n));
///         SecondDerivatives { qq, qv, vv: DMatrix::identity(n, n), qz: line.clone(), vz: line, zz: 0.0 }
///     }
/// }
///
/// let chain = Chain(40);
/// let start = Point { q: Vector::zeros(40), v: Vector::from_fn(40, |i| f64::from(u8::from(i == 0))), z: 0.0 };
/// let problem = SystemProblem::new(&chain, 0.0, start)?;
/// let outcome = problem.accuracy(1e-9).run(Until::Time(5.0))?;
/// println!("{}: {} after {} steps", outcome.status, outcome.q[0], outcome.steps);
/// # assert!(outcome.q.iter().all(|q| q.abs() < 1.0));
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone)]
pub struct SystemProblem<'a> {
    pub(crate) system: Rc<dyn System + 'a>,
    pub(crate) t0: f64,
    /// The initial state with its velocity, and (`state`) with its momentum.
    pub(crate) start: Point,
    pub(crate) state: State,
    /// Whether the momentum was given, not the velocity.
    pub(crate) from_momentum: bool,
    /// The structure that the Lagrangian claims, verified at the initial state.
    pub(crate) structure: Structure,
    /// The interrupt of its trial runs.
    pub(crate) interrupt: Option<Interrupt<'a>>,
}

impl<'a> SystemProblem<'a> {
    /// The problem of a system from a point `(q, v, z)` or `(q, p, z)` at the time `t0`. Where the code of the system
    /// panics, or returns vectors of a wrong length or numbers that are not finite, the run ends with a status. Of the
    /// system's claims that of a constant mass matrix is used, and all others where its structure is
    /// [proved](contact_geom::Hints::proved).
    ///
    /// # Errors
    /// [`InputError`]: vectors whose length is not the number of coordinates, a time or a state that is not finite, an
    /// initial state at which L or a derivative is not defined, a singular `W = L_vv`, a momentum without a velocity, a
    /// false claim of structure.
    pub fn new(system: &'a (dyn System + 'a), t0: f64, start: impl Into<InitialState>) -> Result<Self, InputError> {
        let (system, start) = (Guarded::new(system), start.into());
        let given = match &start {
            InitialState::Velocity(x) => vec![("q", &x.q), ("v", &x.v)],
            InitialState::Momentum(x, guess) => vec![("q", &x.q), ("p", &x.p), ("the guess of v", guess)],
        };
        let expected = system.dimension();
        for (what, vector) in given {
            if vector.len() != expected {
                return Err(GeometryError::WrongSize { what, expected, found: vector.len() }.into());
            }
        }
        Self::checked(Rc::new(system), t0, start)
    }

    /// The same with an interrupt for its trial runs and error estimates.
    pub fn with_interrupt(self, interrupt: Interrupt<'a>) -> Self {
        SystemProblem { interrupt: Some(interrupt), ..self }
    }

    /// The initial state `(q, v, z)`.
    pub fn start(&self) -> &Point {
        &self.start
    }

    /// The initial state `(q, p, z)`.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The same with the type of its Lagrangian.
    pub(crate) fn of<L: Lagrangian<N>, const N: usize>(&self, lagrangian: &'a L) -> Problem<'a, L, N> {
        let SystemProblem { t0, start, state, from_momentum, structure, interrupt, .. } = self;
        Problem {
            lagrangian,
            t0: *t0,
            start: start.fixed(),
            state: state.fixed(),
            from_momentum: *from_momentum,
            structure: *structure,
            interrupt: *interrupt,
        }
    }

    /// The problem of a system after all checks of its start.
    ///
    /// # Errors
    /// Those of [`Problem::new`].
    pub(crate) fn checked(system: Rc<dyn System + 'a>, t0: f64, start: InitialState) -> Result<Self, InputError> {
        check_time(t0)?;
        if system.dimension() == 0 {
            return Err(InputError::Dimension);
        }
        if system.hints().hamiltonian {
            return Self::given_by_hamiltonian(system, t0, start);
        }
        let (start, state) = match start {
            InitialState::Velocity(x) => {
                check_point(&x)?;
                (x, None)
            }
            InitialState::Momentum(x, guess) => {
                x.check()?;
                (system.legendre_inverse(t0, &x, &guess).map_err(InputError::FirstStep)?, Some(x))
            }
        };
        check_regular(&*system, t0, &start)?;
        let structure = verified_structure(&*system, t0, &start)?;
        let from_momentum = state.is_some();
        let state = state.unwrap_or_else(|| state_at(&*system, t0, &start));
        Ok(SystemProblem { system, t0, start, state, from_momentum, structure, interrupt: None })
    }

    /// The problem of a Lagrangian that is given by a contact Hamiltonian.
    fn given_by_hamiltonian(system: Rc<dyn System + 'a>, t0: f64, start: InitialState) -> Result<Self, InputError> {
        if system.hints().resets {
            let hypothesis = "a Lagrangian that is not given by a contact Hamiltonian, since its states are replaced";
            return Err(InputError::Hypothesis { hypothesis });
        }
        let (state, from_momentum) = match start {
            InitialState::Velocity(x) => {
                check_point(&x)?;
                let state = state_at(&*system, t0, &x);
                if !state.p.iter().all(|p| p.is_finite()) {
                    return Err(InputError::NoMomentum);
                }
                (state, false)
            }
            InitialState::Momentum(x, _) => {
                x.check()?;
                (x, true)
            }
        };
        let guess = Vector::zeros(system.dimension());
        let AtState { x: start, l, force, rate } =
            system.at_state(t0, &state, &guess).map_err(|_| InputError::Undefined)?;
        if !(l.is_finite() && rate.is_finite() && force.iter().all(|f| f.is_finite())) {
            return Err(InputError::Undefined);
        }
        let structure = verified_structure(&*system, t0, &start)?;
        if let Some(Defect { claim, size }) = system.hamiltonian_defect(t0, &state) {
            return Err(InputError::FalseClaim { claim, size });
        }
        Ok(SystemProblem { system, t0, start, state, from_momentum, structure, interrupt: None })
    }
}

/// The state of a point of TQ x R, by the Legendre transformation `p = L_v`.
pub(crate) fn state_at(system: &dyn System, t: f64, x: &Point) -> State {
    State { q: x.q.clone(), p: system.gradient(t, x).y, z: x.z }
}

/// Returns an error for a time that is not finite.
pub(crate) fn check_time(t0: f64) -> Result<(), GeometryError> {
    if t0.is_finite() { Ok(()) } else { Err(GeometryError::NonFinite { what: "t0", index: 0, value: t0 }) }
}

/// Returns an error for a point with a coordinate that is not finite.
fn check_point(x: &Point) -> Result<(), GeometryError> {
    State { q: x.q.clone(), p: x.v.clone(), z: x.z }.check()
}

/// Returns an error for an initial state at which L is not defined or not regular.
fn check_regular(system: &dyn System, t0: f64, start: &Point) -> Result<(), InputError> {
    let (g, w) = (system.gradient(t0, start), system.hessian(t0, start).vv);
    let value = system.value(t0, start);
    if !(value.is_finite() && g.is_finite() && w.iter().all(|e| e.is_finite())) {
        return Err(InputError::Undefined);
    }
    // W is scaled so that its rows have size one, since masses may differ by any factor.
    let n = system.dimension();
    let unit = Vector::from_fn(n, |i| max_abs_or_nan(w.row(i).iter().copied()).sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| w[(i, j)] / (unit[i] * unit[j]));
    let Regularity { smallest, largest } = Regularity::of(scaled);
    // A row of zeros cannot be scaled, and the comparison treats it as singular.
    if smallest > 4.0 * n as f64 * f64::EPSILON * largest {
        return Ok(());
    }
    Err(InputError::FirstStep(StepError::Singular { pivot: smallest }))
}
