//! The discrete Legendre transforms F+L_d and F-L_d, their inverses, and regularity.

use super::discrete_forces::{momenta, states, transform_jacobians};
use crate::{DiscreteLagrangian, StepError, solve::Solver};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{DiscretePoint, PhasePoint, Regularity};

/// The conformal factor `sigma_d = 1 + Dz L_d` of a step; paper, section 3.1.
///
/// # Errors
/// Those of the discrete Lagrangian.
pub fn sigma_d<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, StepError> {
    Ok(ld.jet(t, x)?.sigma())
}

/// The discrete Legendre transform `F-L_d (q0, q1, z0) = (q0, -D1 L_d / (1 + Dz L_d), z0)`; paper, section 3.1. With
/// [discrete forces](DiscreteLagrangian::forces), `-(D1 L_d + F-)/(1 + Dz L_d)`.
///
/// # Errors
/// [`StepError::SigmaVanished`] where `sigma_d` vanishes, and those of the discrete Lagrangian.
pub fn legendre_minus<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<PhasePoint<N>, StepError> {
    Ok(states(ld, t, x)?[0])
}

/// The discrete Legendre transform `F+L_d (q0, q1, z0) = (q1, D2 L_d, z0 + L_d)`; paper, section 3.1. With
/// [discrete forces](DiscreteLagrangian::forces), `D2 L_d + F+`.
///
/// # Errors
/// Those of the discrete Lagrangian.
pub fn legendre_plus<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<PhasePoint<N>, StepError> {
    let (jet, [_, p]) = momenta(ld, t, x)?;
    Ok(PhasePoint { q: x.q1, p, z: x.z0 + jet.value })
}

/// The inverse of F-L_d, by Newton's method from a guess of the mean velocity `(q1 - q0)/h`; `t` is the time of the
/// state.
///
/// # Errors
/// Those of a step; [`StepError::Singular`] where F-L_d is not a local diffeomorphism.
pub fn legendre_minus_inverse<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: &SVector<f64, N>,
) -> Result<DiscretePoint<N>, StepError> {
    let step = ld.forward(t, state, guess, &mut Solver::default())?;
    Ok(DiscretePoint { q0: state.q, q1: step.end.q, z0: state.z })
}

/// The inverse of F+L_d, by Newton's method from a guess of the mean velocity; `t` is the time one step before that of
/// the state.
///
/// # Errors
/// Those of a backward step.
pub fn legendre_plus_inverse<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: &SVector<f64, N>,
) -> Result<DiscretePoint<N>, StepError> {
    let step = ld.backward(t, state, guess, &mut Solver::default())?;
    Ok(DiscretePoint { q0: step.end.q, q1: state.q, z0: step.end.z })
}

/// The regularity of a discrete Lagrangian at a point: it is regular where `sigma_d` does not vanish and F-L_d is a
/// local diffeomorphism; paper, section 3.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteRegularity {
    /// `sigma_d`.
    pub sigma: f64,
    /// The singular values of the derivative of F-L_d in `q1`.
    pub fibre: Regularity,
}

/// Computes the [`DiscreteRegularity`] of a discrete Lagrangian at a point.
///
/// # Errors
/// Those of the discrete Lagrangian.
pub fn discrete_regularity<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<DiscreteRegularity, StepError> {
    if const { D::FORCED } {
        let (jet, [minus, _]) = transform_jacobians(ld, t, x)?;
        let fibre = Regularity::of(DMatrix::from_fn(N, N, |i, j| minus[(N + i, N + j)]));
        return Ok(DiscreteRegularity { sigma: jet.first.sigma(), fibre });
    }
    let jet = ld.second_jet(t, x)?;
    Ok(DiscreteRegularity { sigma: jet.first.sigma(), fibre: jet.regularity() })
}
