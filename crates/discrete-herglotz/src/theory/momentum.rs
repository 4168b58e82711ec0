//! Discrete symmetries and their dissipated momenta.

use super::discrete_forces::momenta;
use crate::{DiscreteLagrangian, StepError};
use contact_geom::{DiscretePoint, OneParameterGroup};

/// The discrete momentum `J_d(xi) = p0 . xi_Q(q0)` with `p0 = -D1 L_d / sigma_d`; paper, section 3.2, with the physical
/// sign of the errata, `J_d = -eta-(xi)`.
///
/// # Errors
/// Those of the discrete Lagrangian.
pub fn discrete_momentum<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    group: &impl OneParameterGroup<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, StepError> {
    let (_, [p0, _]) = momenta(ld, t, x)?;
    Ok(group.momentum(&x.q0, &p0))
}

/// The defect of infinitesimal invariance of a discrete Lagrangian, `|D1 L_d xi(q0) + D2 L_d xi(q1)|`, relative to the
/// sum of the absolute values of its terms; paper, section 3.2.
///
/// # Errors
/// Those of the discrete Lagrangian.
pub fn discrete_symmetry_defect<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    group: &impl OneParameterGroup<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, StepError> {
    let jet = ld.jet(t, x)?;
    let (xi0, xi1) = (group.generator(&x.q0), group.generator(&x.q1));
    let size = jet.d1.abs().dot(&xi0.abs()) + jet.d2.abs().dot(&xi1.abs());
    let defect = (jet.d1.dot(&xi0) + jet.d2.dot(&xi1)).abs();
    Ok(if size == 0.0 { 0.0 } else { defect / size })
}
