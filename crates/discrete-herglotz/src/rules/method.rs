//! The table of methods: what is known of each, and a discrete Lagrangian by any of them, chosen at run time.

use crate::rules::{LeftMidpointRule, MidpointRule, RectangleRule, TrapezoidalRule};
use crate::{Discretised, InputError, Quadrature, Rule, Strang};
use contact_geom::{Lagrangian, PhasePoint, Structure};
use std::fmt::{Display, Formatter};
use std::str::FromStr;
use thiserror::Error;

/// A method that makes a discrete Lagrangian from a Lagrangian and a time step.
///
/// ```
/// use contact_geom::{Lagrangian, PhasePoint, systems::Pendulum};
/// use discrete_herglotz::{DiscreteLagrangian, Method};
///
/// let (system, start) = (Pendulum::default(), PhasePoint::new([1.0], [0.5], 0.0));
/// for method in Method::applicable(&system.structure()) {
///     let ld = method.discretise(&system, 0.1, 0.0, &start)?;
///     println!("{method} of order {}, h = {}", method.order(), ld.step_size());
/// }
/// assert_eq!("midpoint".parse(), Ok(Method::Midpoint));
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
///
/// Where the method is known when the program is written, its own type ([`Midpoint`](crate::Midpoint) and so on) saves
/// the choice in every step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// The rectangle rule, [`RectangleRule`].
    Rectangle,
    /// The paper's midpoint rule, [`LeftMidpointRule`].
    LeftMidpoint,
    /// The symmetric midpoint rule, [`MidpointRule`].
    Midpoint,
    /// The symmetric trapezoidal rule, [`TrapezoidalRule`].
    Trapezoidal,
    /// The Strang splitting, [`Strang`].
    Strang,
}

/// What is known of a method.
struct Known {
    name: &'static str,
    order: u32,
    symmetric: bool,
    implicit_in_z: bool,
    exact_rate: bool,
}

impl Known {
    /// Those of a quadrature rule, read off its nodes.
    fn of_rule<R: Rule>() -> Self {
        Known {
            name: R::NAME,
            order: R::ORDER,
            symmetric: R::is_symmetric(),
            implicit_in_z: R::NODES.iter().any(|node| node.action != 0.0),
            // Rational in h gamma, whatever the nodes.
            exact_rate: false,
        }
    }
}

impl Method {
    /// The quadrature rules, which take every regular Lagrangian.
    pub const RULES: &'static [Method] =
        &[Method::Rectangle, Method::LeftMidpoint, Method::Midpoint, Method::Trapezoidal];

    /// Every method of this table. What holds for all of them is tested by walking this
    /// table.
    pub const ALL: &'static [Method] =
        &[Method::Rectangle, Method::LeftMidpoint, Method::Midpoint, Method::Trapezoidal, Method::Strang];

    /// The methods of [`ALL`](Self::ALL) whose hypothesis a Lagrangian of this structure meets.
    pub fn applicable(structure: &Structure) -> impl Iterator<Item = Method> {
        Self::ALL.iter().copied().filter(|method| method.check(structure).is_ok())
    }

    fn known(self) -> Known {
        match self {
            Method::Rectangle => Known::of_rule::<RectangleRule>(),
            Method::LeftMidpoint => Known::of_rule::<LeftMidpointRule>(),
            Method::Midpoint => Known::of_rule::<MidpointRule>(),
            Method::Trapezoidal => Known::of_rule::<TrapezoidalRule>(),
            Method::Strang => {
                Known { name: "strang", order: 2, symmetric: true, implicit_in_z: false, exact_rate: true }
            }
        }
    }

    /// The name in tables, in lower case with underscores.
    pub fn name(self) -> &'static str {
        self.known().name
    }

    /// The order of the flow.
    pub fn order(self) -> u32 {
        self.known().order
    }

    /// Whether the method is its own adjoint: a step of the motion reversed in time leads back.
    pub fn symmetric(self) -> bool {
        self.known().symmetric
    }

    /// Whether the action at the end of a step is defined by an equation that contains it, where L depends on z;
    /// otherwise it is an explicit function of `(q0, q1, z0)`.
    pub fn implicit_in_z(self) -> bool {
        self.known().implicit_in_z
    }

    /// Whether `sigma_d = e^(gamma h)` for a Lagrangian with the linear drag `gamma z`, as for the motion itself. A
    /// quadrature rule has a rational function of `h gamma` in its place, `1 + h gamma` where it is explicit in z.
    pub fn exact_rate(self) -> bool {
        self.known().exact_rate
    }

    /// Whether the claims of this structure are all that the method needs. The quadrature rules take
    /// every regular Lagrangian; the Strang splitting one that is separable, with a linear drag.
    ///
    /// # Errors
    /// [`InputError::Unclaimed`] with the claim that is missing.
    pub fn check(self, structure: &Structure) -> Result<(), InputError> {
        match self {
            Method::Rectangle | Method::LeftMidpoint | Method::Midpoint | Method::Trapezoidal => Ok(()),
            Method::Strang if !structure.separable => Err(InputError::Unclaimed { claim: "separable" }),
            Method::Strang if !structure.is_affine_in_z() => Err(InputError::Unclaimed { claim: "z_affine" }),
            Method::Strang => Ok(()),
        }
    }

    /// The discrete Lagrangian of this method for a Lagrangian, or a reference to one, with the time step `h`. The form of
    /// the Lagrangian is verified at a time and a state, and its constants are read there, by the methods that rest on it;
    /// of the state they take position and action. Whether it is regular shows where a run starts, as at
    /// [`Flow::new`](crate::Flow::new).
    ///
    /// # Errors
    /// [`InputError::Geometry`] where the time or the state is not finite, and those of the method's constructor:
    /// [`InputError::Step`] unless `h` is finite and not 0; it is negative to go back in time, [`InputError::Dimension`] if `N = 0`, and those of
    /// [`Strang::new`].
    pub fn discretise<const N: usize, L: Lagrangian<N>>(
        self,
        lagrangian: L,
        h: f64,
        t: f64,
        state: &PhasePoint<N>,
    ) -> Result<Discretised<L, N>, InputError> {
        crate::run::check_time(t)?;
        state.check()?;
        Ok(match self {
            Method::Rectangle => Discretised::Rectangle(Quadrature::new(lagrangian, h)?),
            Method::LeftMidpoint => Discretised::LeftMidpoint(Quadrature::new(lagrangian, h)?),
            Method::Midpoint => Discretised::Midpoint(Quadrature::new(lagrangian, h)?),
            Method::Trapezoidal => Discretised::Trapezoidal(Quadrature::new(lagrangian, h)?),
            Method::Strang => Discretised::Strang(Strang::new(lagrangian, h, t, state)?),
        })
    }
}

/// The [`name`](Method::name).
impl Display for Method {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// From the [`name`](Method::name).
impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        let named = Self::ALL.iter().copied().find(|method| method.name() == name);
        named.ok_or_else(|| UnknownMethod { name: name.into() })
    }
}

/// No method has this name.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there is no method {name:?}; the methods are {}", names())]
pub struct UnknownMethod {
    /// The name that was asked for.
    pub name: String,
}

/// The names of the table, for an error message.
fn names() -> String {
    let names: Vec<_> = Method::ALL.iter().map(|method| method.name()).collect();
    names.join(", ")
}
