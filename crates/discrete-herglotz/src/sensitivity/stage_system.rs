//! The derivatives of a system that the tangent of a collocation step needs.

use crate::StepError;
use crate::integration::QuantityDerivatives;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{StageMap, Stages};
use crate::sensitivity::fixed_stages::FixedStages;
use crate::sensitivity::linear_stages::StageTangent;
use crate::sensitivity::parameter_derivatives::{ParameterDerivatives, Quantity};
use crate::sensitivity::stage_derivatives::StageDerivatives;
use crate::sensitivity::step_maps::StepMaps;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Derivatives, Parametric, VelocityPoint};
use pulp::{Simd, WithSimd};

/// A Lagrangian as the tangent of a step evaluates it: a few calls in each step, so that the linear algebra of the tangent
/// depends on the dimension alone and is compiled once for all systems.
pub(crate) trait StageSystem<const N: usize> {
    /// The rate `L_z` at a point.
    fn rate_at(&self, t: f64, x: &VelocityPoint<N>) -> f64;

    /// [`StageDerivatives::evaluate`], with an instruction set.
    fn evaluate(
        &self,
        arch: Instructions,
        at: &mut StageDerivatives<N>,
        forward: &StepMaps,
        step: &FixedStages<'_, N>,
        actions: Option<&StageMap>,
    ) -> Result<(), StepError>;

    /// [`ParameterDerivatives::at`].
    fn quantity_at(
        &self,
        of: &mut ParameterDerivatives<N>,
        quantity: Quantity,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> QuantityDerivatives<N>;

    /// The derivative in a quantity over the step: `d(rho L_theta)[w] + rho f_theta . w_q` at the stages, with weights.
    fn quantity_along(
        &self,
        arch: Instructions,
        of: &mut ParameterDerivatives<N>,
        quantity: Quantity,
        at: &StageDerivatives<N>,
        along: (&StageTangent<N>, &Stages),
    ) -> f64;
}

impl<L: Parametric<N>, const N: usize> StageSystem<N> for L {
    fn rate_at(&self, t: f64, x: &VelocityPoint<N>) -> f64 {
        self.rate(t, x)
    }

    fn evaluate(
        &self,
        arch: Instructions,
        at: &mut StageDerivatives<N>,
        forward: &StepMaps,
        step: &FixedStages<'_, N>,
        actions: Option<&StageMap>,
    ) -> Result<(), StepError> {
        arch.dispatch(Evaluation { lagrangian: self, at, forward, step, actions })
    }

    fn quantity_at(
        &self,
        of: &mut ParameterDerivatives<N>,
        quantity: Quantity,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> QuantityDerivatives<N> {
        of.at(self, quantity, t, x)
    }

    fn quantity_along(
        &self,
        arch: Instructions,
        of: &mut ParameterDerivatives<N>,
        quantity: Quantity,
        at: &StageDerivatives<N>,
        (w, weights): (&StageTangent<N>, &Stages),
    ) -> f64 {
        let in_lanes = QuantityAlong { lagrangian: self, of, quantity, at, w, weights };
        if let Some(sum) = arch.dispatch(in_lanes) {
            return sum;
        }
        let mut sum = 0.0;
        for i in 0..at.s {
            let (t, x) = at.point(i);
            let stage = |x: &[Stages; N]| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
            let tangent = ChartVector { x: stage(&w.q), y: stage(&w.v), z: w.z.0[i] };
            sum += weights.0[i] * of.along(self, quantity, (t, &x, at.rho.0[i]), (&tangent, w.r.0[i]));
        }
        sum
    }
}

/// [`StageDerivatives::evaluate`], compiled for one instruction set.
struct Evaluation<'e, L, const N: usize> {
    lagrangian: &'e L,
    at: &'e mut StageDerivatives<N>,
    forward: &'e StepMaps,
    step: &'e FixedStages<'e, N>,
    actions: Option<&'e StageMap>,
}

impl<L: Parametric<N>, const N: usize> WithSimd for Evaluation<'_, L, N> {
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        self.at.evaluate::<S, L>(self.lagrangian, self.forward, self.step, self.actions)
    }
}

/// [`ParameterDerivatives::sum_along`], compiled for one instruction set.
struct QuantityAlong<'e, L, const N: usize> {
    lagrangian: &'e L,
    of: &'e ParameterDerivatives<N>,
    quantity: Quantity,
    at: &'e StageDerivatives<N>,
    w: &'e StageTangent<N>,
    weights: &'e Stages,
}

impl<L: Parametric<N>, const N: usize> WithSimd for QuantityAlong<'_, L, N> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        self.of.sum_along::<S, L>(self.lagrangian, self.quantity, self.at, self.w, self.weights)
    }
}
