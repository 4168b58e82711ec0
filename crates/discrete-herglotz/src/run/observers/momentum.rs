//! Momenta of symmetries along a run.

use crate::InputError;
use crate::run::{Observer, OutputRequest, RunInfo, StepView, Stop};
use contact_geom::{GeometryError, OneParameterGroup};
use std::ops::ControlFlow;

/// A momentum at a step of a run, with the prediction of the discrete Noether theorem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentumRow {
    /// Time.
    pub t: f64,
    /// The momentum `J_k = p_k . xi_Q(q_k)`.
    pub momentum: f64,
    /// Its prediction `J_0 sigma_1 ... sigma_k`, computed from the sum of the logarithms.
    pub predicted: f64,
}

impl MomentumRow {
    /// The deviation from the prediction, relative to it.
    pub fn defect(&self) -> f64 {
        (self.momentum - self.predicted).abs() / self.predicted.abs()
    }
}

/// Observes the momentum of a one-parameter group in N coordinates along a run, and its predicted decay by the product of the `sigma_d`.
///
/// The prediction is that for a symmetry of L. Under constraints `c(q) = 0` the group must leave c unchanged as well, and
/// under constraints `omega(q) v = 0` it must be horizontal, `omega xi_Q = 0`: the momenta of other groups change by the
/// force of the constraints, and [`MomentumRow::defect`] is this change.
#[derive(Clone, Debug)]
pub struct MomentumDecay<G, const N: usize> {
    group: G,
    /// The rows so far, the initial one included.
    pub rows: Vec<MomentumRow>,
}

impl<G: OneParameterGroup<N>, const N: usize> MomentumDecay<G, N> {
    /// An observer of the momentum of this group.
    pub fn new(group: G) -> Self {
        MomentumDecay { group, rows: Vec::new() }
    }
}

impl<G: OneParameterGroup<N>, const N: usize> Observer for MomentumDecay<G, N> {
    fn needs(&self) -> OutputRequest {
        OutputRequest { conformal_factor: true, ..OutputRequest::default() }
    }

    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        if info.dimension != N {
            let what = "an element of the configuration space of the group";
            return Err(GeometryError::WrongSize { what, expected: info.dimension, found: N }.into());
        }
        Ok(())
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.rows.clear();
        self.step(at)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        let momentum = self.group.momentum(&at.state.q.fixed(), &at.state.p.fixed());
        let factor = at.log_factor.unwrap_or(f64::NAN).exp();
        let predicted = self.rows.first().map_or(momentum, |row| row.momentum * factor);
        self.rows.push(MomentumRow { t: at.t, momentum, predicted });
        ControlFlow::Continue(())
    }
}
