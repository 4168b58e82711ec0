//! Discrete forces of a discrete Lagrangian, and the Legendre transforms with them.

use crate::{DiscreteLagrangian, StepError};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{ChartVector, DiscreteJet, DiscretePoint, Dual, PhasePoint, SecondDiscreteJet, support::seed};

/// The discrete forces F- and F+ of a step, with their derivatives in `(q0, q1, z0)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteForces<const N: usize> {
    /// F-, the force on the start of the step.
    pub minus: SVector<f64, N>,
    /// F+, the force on its end.
    pub plus: SVector<f64, N>,
    /// The derivatives of F- in q0, in q1 and in z0.
    pub minus_slopes: ForceSlopes<N>,
    /// The derivatives of F+ in q0, in q1 and in z0.
    pub plus_slopes: ForceSlopes<N>,
}

/// The derivatives of a discrete force in q0, in q1 and in z0.
pub type ForceSlopes<const N: usize> = (SMatrix<f64, N, N>, SMatrix<f64, N, N>, SVector<f64, N>);

/// The discrete forces with their derivatives, by automatic differentiation.
///
/// # Errors
/// Those of the discrete Lagrangian.
pub fn discrete_forces<const N: usize>(
    ld: &(impl DiscreteLagrangian<N> + ?Sized),
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<DiscreteForces<N>, StepError> {
    type Lifted<const N: usize> = Dual<f64, ChartVector<N>>;
    let lifted: DiscretePoint<N, Lifted<N>> = seed(&ChartVector::from(*x)).into();
    let [minus, plus] = ld.forces(t, &lifted)?;
    let slopes = |f: &SVector<Lifted<N>, N>| {
        (SMatrix::from_fn(|i, j| f[i].d.x[j]), SMatrix::from_fn(|i, j| f[i].d.y[j]), SVector::from_fn(|i, _| f[i].d.z))
    };
    let (minus_slopes, plus_slopes) = (slopes(&minus), slopes(&plus));
    Ok(DiscreteForces { minus: minus.map(|f| f.re), plus: plus.map(|f| f.re), minus_slopes, plus_slopes })
}

/// The momenta `p0 = -(D1 L_d + F-)/sigma_d` and `p1 = D2 L_d + F+` of a step, and the jet of `L_d`.
pub(super) fn momenta<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<(DiscreteJet<N>, [SVector<f64, N>; 2]), StepError> {
    let jet = ld.jet(t, x)?;
    let (mut start, mut end) = (jet.d1, jet.d2);
    if const { D::FORCED } {
        let [minus, plus] = ld.forces(t, x)?;
        start += minus;
        end += plus;
    }
    let p0 = -start / jet.sigma();
    Ok((jet, [p0, end]))
}

/// The linearisations of F-L_d and F+L_d with the discrete forces, and the second jet of `L_d`.
pub(super) fn transform_jacobians<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<(SecondDiscreteJet<N>, [DMatrix<f64>; 2]), StepError> {
    let jet = ld.second_jet(t, x)?;
    let [mut minus, mut plus] = [jet.legendre_minus_jacobian(), jet.legendre_plus_jacobian()];
    if const { D::FORCED } {
        let forces = discrete_forces(ld, t, x)?;
        let sigma = jet.first.sigma();
        let of_sigma = |j: usize| match j {
            _ if j < N => jet.d1z[j],
            _ if j < 2 * N => jet.d2z[j - N],
            _ => jet.dzz,
        };
        let of = |slopes: &ForceSlopes<N>, i: usize, j: usize| match j {
            _ if j < N => slopes.0[(i, j)],
            _ if j < 2 * N => slopes.1[(i, j - N)],
            _ => slopes.2[i],
        };
        for j in 0..=2 * N {
            for i in 0..N {
                minus[(N + i, j)] += (forces.minus[i] * of_sigma(j) / sigma - of(&forces.minus_slopes, i, j)) / sigma;
                plus[(N + i, j)] += of(&forces.plus_slopes, i, j);
            }
        }
    }
    Ok((jet, [minus, plus]))
}

/// The two states of a step by its Legendre transforms.
pub(super) fn states<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<[PhasePoint<N>; 2], StepError> {
    let (jet, [p0, p1]) = momenta(ld, t, x)?;
    if jet.sigma() == 0.0 {
        return Err(StepError::SigmaVanished { sigma: 0.0 });
    }
    Ok([PhasePoint { q: x.q0, p: p0, z: x.z0 }, PhasePoint { q: x.q1, p: p1, z: x.z0 + jet.value }])
}
