//! The table of methods: their properties, and the discrete Lagrangian of a method chosen at run time.

use crate::{
    DiscreteLagrangian, DiscreteStep, InputError, StepError,
    rules::{Quadrature, Rule},
    solve::Solver,
    splitting::Strang,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscreteJet, DiscretePoint, Lagrangian, PhasePoint, Scalar, SecondDiscreteJet, Structure};
use std::fmt::{Display, Formatter};
use std::str::FromStr;
use thiserror::Error;

/// A method that constructs a discrete Lagrangian from a Lagrangian and a time step.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::{Lagrangian, PhasePoint};
/// use discrete_herglotz::{DiscreteLagrangian, rules::Method};
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
/// Where the method is known to be a quadrature rule, [`Rule::of`] avoids the dispatch in every step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// The rectangle rule, [`Rule::RECTANGLE`].
    Rectangle,
    /// The midpoint rule of the paper, [`Rule::LEFT_MIDPOINT`].
    LeftMidpoint,
    /// The symmetric midpoint rule, [`Rule::MIDPOINT`].
    Midpoint,
    /// The symmetric trapezoidal rule, [`Rule::TRAPEZOIDAL`].
    Trapezoidal,
    /// The Strang splitting, [`Strang`].
    Strang,
}

impl Method {
    /// The quadrature rules, which apply to every regular Lagrangian.
    pub const RULES: &'static [Method] =
        &[Method::Rectangle, Method::LeftMidpoint, Method::Midpoint, Method::Trapezoidal];

    /// Every method of this table.
    pub const ALL: &'static [Method] =
        &[Method::Rectangle, Method::LeftMidpoint, Method::Midpoint, Method::Trapezoidal, Method::Strang];

    /// The methods of [`ALL`](Self::ALL) whose hypotheses a Lagrangian of this structure satisfies.
    pub fn applicable(structure: &Structure) -> impl Iterator<Item = Method> {
        Self::ALL.iter().copied().filter(|method| method.check(structure).is_ok())
    }

    /// The quadrature rule; `None` for the Strang splitting.
    pub fn rule(self) -> Option<Rule> {
        match self {
            Method::Rectangle => Some(Rule::RECTANGLE),
            Method::LeftMidpoint => Some(Rule::LEFT_MIDPOINT),
            Method::Midpoint => Some(Rule::MIDPOINT),
            Method::Trapezoidal => Some(Rule::TRAPEZOIDAL),
            Method::Strang => None,
        }
    }

    /// The name in tables, in lower case with underscores.
    pub fn name(self) -> &'static str {
        self.rule().map_or("strang", |rule| rule.name)
    }

    /// The order of the flow.
    pub fn order(self) -> u32 {
        self.rule().map_or(2, |rule| rule.order)
    }

    /// Whether the method is symmetric (equal to its adjoint): a step with `-h` is the inverse of the step with `h`.
    pub fn symmetric(self) -> bool {
        self.rule().is_none_or(|rule| rule.is_symmetric())
    }

    /// Whether, for L that depends on z, the action at the end of a step is defined implicitly; otherwise it is an
    /// explicit function of `(q0, q1, z0)`.
    pub fn implicit_in_z(self) -> bool {
        self.rule().is_some_and(|rule| rule.is_implicit_in_z())
    }

    /// Whether `sigma_d = e^(gamma h)` for a Lagrangian with the linear drag `gamma z`, as for the exact flow. For a
    /// quadrature rule it is a rational function of `h gamma`, `1 + h gamma` for a rule that is explicit in z.
    pub fn exact_rate(self) -> bool {
        self == Method::Strang
    }

    /// Checks that a Lagrangian of this structure satisfies the hypotheses of the method. The quadrature rules apply to
    /// every regular Lagrangian; the Strang splitting requires a separable one with a linear drag.
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

    /// The discrete Lagrangian of this method for a Lagrangian, or a reference to one, with the time step `h`, which is
    /// negative for steps backward in time.
    ///
    /// A method that requires a special form of the Lagrangian verifies it, and reads its constants, at the given time
    /// and the position and action of the given state. Regularity is checked at the start of a run, as in
    /// [`Flow::new`](crate::rules::Flow::new).
    ///
    /// # Errors
    /// [`InputError::Geometry`] where the time or the state is not finite, [`InputError::Step`] unless `h` is finite
    /// and not 0, [`InputError::Dimension`] if `N = 0`, and those of [`Strang::new`].
    pub fn discretise<const N: usize, L: Lagrangian<N>>(
        self,
        lagrangian: L,
        h: f64,
        t: f64,
        state: &PhasePoint<N>,
    ) -> Result<AnyDiscreteLagrangian<L, N>, InputError> {
        crate::integration::system_problem::check_time(t)?;
        state.check()?;
        Ok(match self.rule() {
            Some(rule) => AnyDiscreteLagrangian::Rule(rule.of(lagrangian, h)?),
            None => AnyDiscreteLagrangian::Strang(Strang::new(lagrangian, h, t, state)?),
        })
    }
}

/// The discrete Lagrangian that a [`Method`] chosen at run time constructs from a Lagrangian.
///
/// It is one type for all methods, so that code that is generic over discrete Lagrangians is compiled once for each
/// Lagrangian instead of once for each method. [`Gauss`](crate::gauss::Gauss) is not included, because the derivatives
/// of its value through the stages would be compiled into every program that uses this type.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum AnyDiscreteLagrangian<L, const N: usize> {
    /// A quadrature rule.
    Rule(Quadrature<L>),
    /// The Strang splitting.
    Strang(Strang<L, N>),
}

/// Evaluates one expression for whichever method the value holds.
macro_rules! each {
    ($self:ident, $ld:ident => $result:expr) => {
        match $self {
            AnyDiscreteLagrangian::Rule($ld) => $result,
            AnyDiscreteLagrangian::Strang($ld) => $result,
        }
    };
}

impl<const N: usize, L: Lagrangian<N>> DiscreteLagrangian<N> for AnyDiscreteLagrangian<L, N> {
    const FORCED: bool = L::HINTS.forced;

    fn has_forces(&self) -> bool {
        each!(self, ld => DiscreteLagrangian::<N>::has_forces(ld))
    }

    fn step_size(&self) -> f64 {
        each!(self, ld => DiscreteLagrangian::<N>::step_size(ld))
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        each!(self, ld => ld.value(t, x))
    }

    fn forces<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<[SVector<T, N>; 2], StepError> {
        each!(self, ld => ld.forces(t, x))
    }

    fn check_start(&self, t: f64, from: &PhasePoint<N>, velocity: &SVector<f64, N>) -> Result<(), InputError> {
        each!(self, ld => ld.check_start(t, from, velocity))
    }

    fn defect(&self, velocities: [&SVector<f64, N>; 4], to: &PhasePoint<N>, sigma: f64) -> Option<f64> {
        each!(self, ld => ld.defect(velocities, to, sigma))
    }

    fn order(&self) -> Option<u32> {
        each!(self, ld => DiscreteLagrangian::<N>::order(ld))
    }

    fn is_explicit(&self) -> bool {
        each!(self, ld => DiscreteLagrangian::<N>::is_explicit(ld))
    }

    fn constant_rate(&self) -> bool {
        each!(self, ld => DiscreteLagrangian::<N>::constant_rate(ld))
    }

    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        each!(self, ld => ld.jet(t, x))
    }

    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        each!(self, ld => ld.second_jet(t, x))
    }

    fn forward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        each!(self, ld => ld.forward(t, from, guess, solver))
    }

    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        each!(self, ld => ld.backward(t, from, guess, solver))
    }
}

/// Writes the [`name`](Method::name).
impl Display for Method {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// Parses the [`name`](Method::name).
impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        let named = Self::ALL.iter().copied().find(|method| method.name() == name);
        named.ok_or_else(|| UnknownMethod { name: name.into() })
    }
}

/// The error for a name that no method has.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("unknown method {name:?}; the methods are {}", names())]
pub struct UnknownMethod {
    /// The requested name.
    pub name: String,
}

/// The names of the table, for an error message.
fn names() -> String {
    let names: Vec<_> = Method::ALL.iter().map(|method| method.name()).collect();
    names.join(", ")
}
