//! Discrete symmetries and their dissipated momenta.

use crate::{DiscreteLagrangian, Moment, Needs, Observer, StepError, Stop};
use contact_geom::{DiscretePoint, OneParameterGroup};
use std::ops::ControlFlow;

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
    let jet = ld.jet(t, x)?;
    Ok(group.momentum(&x.q0, &(-jet.d1 / jet.sigma())))
}

/// How far a discrete Lagrangian is from being invariant: `D1 L_d xi(q0) + D2 L_d xi(q1)`, relative to the sum of its
/// absolute terms; paper, section 3.2.
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

/// A momentum at one step of a run, with what the theorem predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentumRow {
    /// Time.
    pub t: f64,
    /// The momentum `J_k = p_k . xi_Q(q_k)`.
    pub momentum: f64,
    /// Its prediction `J_0 sigma_1 ... sigma_k`, by the sum of the logarithms.
    pub predicted: f64,
}

impl MomentumRow {
    /// The deviation from the prediction, relative to it.
    pub fn defect(&self) -> f64 {
        (self.momentum - self.predicted).abs() / self.predicted.abs()
    }
}

/// Observes the momentum of a one-parameter group along a run, and its predicted decay by the product of the `sigma_d`.
#[derive(Clone, Debug)]
pub struct MomentumDecay<G> {
    group: G,
    /// The rows so far, the initial one included.
    pub rows: Vec<MomentumRow>,
}

impl<G> MomentumDecay<G> {
    /// Observes the momentum of this group.
    pub fn new(group: G) -> Self {
        MomentumDecay { group, rows: Vec::new() }
    }
}

impl<const N: usize, G: OneParameterGroup<N>> Observer<N> for MomentumDecay<G> {
    fn needs(&self) -> Needs {
        Needs { action: false, conformal_factor: true }
    }

    fn start(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        self.rows.clear();
        self.step(at)
    }

    fn step(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        let momentum = self.group.momentum(&at.state.q, &at.state.p);
        let factor = at.log_factor.unwrap_or(f64::NAN).exp();
        let predicted = self.rows.first().map_or(momentum, |row| row.momentum * factor);
        self.rows.push(MomentumRow { t: at.t, momentum, predicted });
        ControlFlow::Continue(())
    }
}
