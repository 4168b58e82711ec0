//! A discrete Lagrangian by any of the rules, chosen at run time.
//!
//! The code that checks a statement is long, and made anew for each type that it runs on. With the rule inside the type it
//! would be made for each system and each rule, and the program would take four times as long to build.

use contact_geom::nalgebra::SVector;
use contact_geom::{DiscreteJet, DiscretePoint, Lagrangian, PhasePoint, Scalar, SecondDiscreteJet};
use discrete_herglotz::{
    DiscreteLagrangian, DiscretePath, ExtendedJet, InputError, LeftMidpoint, Midpoint, Rectangle, Rule, Solver,
    StepError, Transition, Trapezoidal,
    rules::{LeftMidpointRule, MidpointRule, RectangleRule, TrapezoidalRule},
};
use thiserror::Error;

/// A rule of the library with its Lagrangian.
pub enum AnyRule<L> {
    /// The rectangle rule.
    Rectangle(Rectangle<L>),
    /// The paper's midpoint rule.
    LeftMidpoint(LeftMidpoint<L>),
    /// The symmetric midpoint rule.
    Midpoint(Midpoint<L>),
    /// The symmetric trapezoidal rule.
    Trapezoidal(Trapezoidal<L>),
}

/// Why there is no rule.
#[derive(Clone, Debug, Error)]
pub enum RuleError {
    /// The library has a discretisation that is not in [`AnyRule`].
    #[error("no rule of the name {0} in this program")]
    Unknown(String),
    /// The step is not acceptable.
    #[error(transparent)]
    Input(#[from] InputError),
}

/// The same expression for each rule.
macro_rules! each {
    ($self:ident, $ld:ident => $result:expr) => {
        match $self {
            AnyRule::Rectangle($ld) => $result,
            AnyRule::LeftMidpoint($ld) => $result,
            AnyRule::Midpoint($ld) => $result,
            AnyRule::Trapezoidal($ld) => $result,
        }
    };
}

impl<L> AnyRule<L> {
    /// The rule with the name that it has in the library's table.
    pub fn named<const N: usize>(name: &str, lagrangian: L, h: f64) -> Result<Self, RuleError>
    where
        L: Lagrangian<N>,
    {
        Ok(match name {
            RectangleRule::NAME => AnyRule::Rectangle(Rectangle::new::<N>(lagrangian, h)?),
            LeftMidpointRule::NAME => AnyRule::LeftMidpoint(LeftMidpoint::new::<N>(lagrangian, h)?),
            MidpointRule::NAME => AnyRule::Midpoint(Midpoint::new::<N>(lagrangian, h)?),
            TrapezoidalRule::NAME => AnyRule::Trapezoidal(Trapezoidal::new::<N>(lagrangian, h)?),
            name => return Err(RuleError::Unknown(name.into())),
        })
    }

    /// The jet on Q x Q x R^2.
    pub fn extended_jet<const N: usize>(&self, t: f64, x: &DiscretePoint<N>, z1: f64) -> ExtendedJet<N>
    where
        L: Lagrangian<N>,
    {
        each!(self, ld => ld.extended_jet(t, x, z1))
    }

    /// The residuals of the condition on Q x Q x R^2 along a path.
    pub fn extended_residuals<const N: usize>(
        &self,
        path: &DiscretePath<N>,
        t0: f64,
        z0: f64,
    ) -> Result<Vec<SVector<f64, N>>, StepError>
    where
        L: Lagrangian<N>,
    {
        each!(self, ld => path.extended_residuals(ld, t0, z0))
    }
}

impl<const N: usize, L: Lagrangian<N>> DiscreteLagrangian<N> for AnyRule<L> {
    fn step_size(&self) -> f64 {
        each!(self, ld => DiscreteLagrangian::<N>::step_size(ld))
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        each!(self, ld => ld.value(t, x))
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
    ) -> Result<Transition<N>, StepError> {
        each!(self, ld => ld.forward(t, from, guess, solver))
    }
    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<Transition<N>, StepError> {
        each!(self, ld => ld.backward(t, from, guess, solver))
    }
}
