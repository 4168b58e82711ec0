//! A discrete Lagrangian by any of the methods.

use crate::{
    DiscreteLagrangian, InputError, LeftMidpoint, Midpoint, Rectangle, Solver, StepError, Strang, Transition,
    Trapezoidal,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscreteJet, DiscretePoint, Lagrangian, PhasePoint, Scalar, SecondDiscreteJet};

/// The discrete Lagrangian that a [`Method`](crate::Method) chosen at run time makes from a Lagrangian.
///
/// One type for all methods: code that is generic over discrete Lagrangians is compiled once for a Lagrangian, not once
/// for each method. [`Gauss`](crate::Gauss) is not among them: derivatives of its value, through the stages, would be
/// compiled into every program that names this type.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Discretised<L, const N: usize> {
    /// By the rectangle rule.
    Rectangle(Rectangle<L>),
    /// By the paper's midpoint rule.
    LeftMidpoint(LeftMidpoint<L>),
    /// By the symmetric midpoint rule.
    Midpoint(Midpoint<L>),
    /// By the symmetric trapezoidal rule.
    Trapezoidal(Trapezoidal<L>),
    /// By the Strang splitting.
    Strang(Strang<L, N>),
}

/// The same expression for each method.
macro_rules! each {
    ($self:ident, $ld:ident => $result:expr) => {
        match $self {
            Discretised::Rectangle($ld) => $result,
            Discretised::LeftMidpoint($ld) => $result,
            Discretised::Midpoint($ld) => $result,
            Discretised::Trapezoidal($ld) => $result,
            Discretised::Strang($ld) => $result,
        }
    };
}

impl<const N: usize, L: Lagrangian<N>> DiscreteLagrangian<N> for Discretised<L, N> {
    fn step_size(&self) -> f64 {
        each!(self, ld => DiscreteLagrangian::<N>::step_size(ld))
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        each!(self, ld => ld.value(t, x))
    }

    fn check_start(&self, t: f64, from: &PhasePoint<N>, velocity: &SVector<f64, N>) -> Result<(), InputError> {
        each!(self, ld => ld.check_start(t, from, velocity))
    }

    fn misfit(&self, velocities: [&SVector<f64, N>; 4], to: &PhasePoint<N>, sigma: f64) -> Option<f64> {
        each!(self, ld => ld.misfit(velocities, to, sigma))
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
