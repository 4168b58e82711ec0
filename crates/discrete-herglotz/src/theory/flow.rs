//! The discrete Lagrangian flow Phi_d and the discrete Hamiltonian flow Phi~_d, with their linearisations.

use super::discrete_forces::transform_jacobians;
use super::legendre::{legendre_minus, legendre_minus_inverse, legendre_plus, legendre_plus_inverse};
use crate::{DiscreteLagrangian, StepError};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{DiscretePoint, PhasePoint};

/// `Phi_d = (F-L_d)^-1 o F+L_d`, from `(q0, q1, z0)` at time `t` to `(q1, q2, z1)` at `t + h`; paper, section 3.1.
///
/// # Errors
/// Those of a step.
pub fn discrete_flow<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<DiscretePoint<N>, StepError> {
    let h = ld.step_size();
    legendre_minus_inverse(ld, t + h, &legendre_plus(ld, t, x)?, &((x.q1 - x.q0) / h))
}

/// The linearisation `T Phi_d = (T F-L_d)^-1 T F+L_d`, the first factor at `Phi_d(x)`.
///
/// # Errors
/// [`StepError::Singular`] where F-L_d is not a local diffeomorphism, and those of the discrete Lagrangian.
pub fn discrete_flow_jacobian<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
    image: &DiscretePoint<N>,
) -> Result<DMatrix<f64>, StepError> {
    let [_, plus] = transform_jacobians(ld, t, x)?.1;
    let [minus, _] = transform_jacobians(ld, t + ld.step_size(), image)?.1;
    minus.lu().solve(&plus).ok_or(StepError::Singular { pivot: 0.0 })
}

/// The linearisation `T Phi~_d = T F+L_d (T F-L_d)^-1`, both at the step's point of Q x Q x R.
///
/// # Errors
/// [`StepError::Singular`] where F-L_d is not a local diffeomorphism, and those of the discrete Lagrangian.
pub fn hamiltonian_flow_jacobian<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<DMatrix<f64>, StepError> {
    let [minus, plus] = transform_jacobians(ld, t, x)?.1;
    let transposed = minus.transpose().lu().solve(&plus.transpose());
    transposed.map(|m| m.transpose()).ok_or(StepError::Singular { pivot: 0.0 })
}

/// The paper's three expressions of the discrete Hamiltonian flow Phi~_d.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HamiltonianFlow {
    /// `F+L_d o (F-L_d)^-1`: one implicit solve; the expression that a run uses.
    Direct,
    /// `F+L_d o Phi_d o (F+L_d)^-1`, through the previous step.
    ThroughPlus,
    /// `F-L_d o Phi_d o (F-L_d)^-1`, through the next step.
    ThroughMinus,
}

/// `Phi~_d`, from `(q0, p0, z0)` at time `t` to `(q1, p1, z1)` at `t + h`, by one of its expressions; paper, section
/// 3.1. `guess` is an initial guess of the mean velocity.
///
/// # Errors
/// Those of a step.
pub fn hamiltonian_flow<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: &SVector<f64, N>,
    expression: HamiltonianFlow,
) -> Result<PhasePoint<N>, StepError> {
    let h = ld.step_size();
    match expression {
        HamiltonianFlow::Direct => legendre_plus(ld, t, &legendre_minus_inverse(ld, t, state, guess)?),
        HamiltonianFlow::ThroughPlus => {
            let before = legendre_plus_inverse(ld, t - h, state, guess)?;
            legendre_plus(ld, t, &discrete_flow(ld, t - h, &before)?)
        }
        HamiltonianFlow::ThroughMinus => {
            let step = legendre_minus_inverse(ld, t, state, guess)?;
            legendre_minus(ld, t + h, &discrete_flow(ld, t, &step)?)
        }
    }
}
