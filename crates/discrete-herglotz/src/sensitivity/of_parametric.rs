//! A Lagrangian with parameters whose number of coordinates is known at compile time, as derivatives of runs see it.

use crate::gauss::system::{CollocationSystem, Typed};
use crate::integration::{OfTyped, QuantityDerivatives, SolvedStages};
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{StageMap, Stages};
use crate::sensitivity::linear_stages::StageTangent;
use crate::sensitivity::parameter_derivatives::ParameterDerivatives;
use crate::sensitivity::parametric_system::{ExplicitDerivatives, ParametricSystem, Quantities, Quantity, StageSystem};
use crate::sensitivity::stage_derivatives::StageDerivatives;
use crate::sensitivity::stage_kernel::StageKernel;
use crate::sensitivity::step_maps::StepMaps;
use crate::sensitivity::switch::{Argument, moving_point};
use crate::{Components, Point, State, StepError, System, Vector};
use contact_geom::nalgebra::SVector;
use contact_geom::switching::BreakRate;
use contact_geom::{ChartVector, Parametric};
use pulp::{Simd, WithSimd};

/// A Lagrangian with parameters, seen without its type.
pub(crate) struct OfParametric<'a, L, const N: usize>(pub &'a L);

impl<const N: usize> From<QuantityDerivatives<N>> for ExplicitDerivatives {
    fn from(of: QuantityDerivatives<N>) -> Self {
        ExplicitDerivatives { l: of.l, gradient: of.gradient.into(), force: of.force.into() }
    }
}

/// The derivatives in parameters and time, with their workspace.
struct OfParameters<'a, L, const N: usize> {
    lagrangian: &'a L,
    of: ParameterDerivatives<N>,
}

impl<L: Parametric<N>, const N: usize> Quantities for OfParameters<'_, L, N> {
    fn count(&self) -> usize {
        self.of.count()
    }

    fn at(&mut self, quantity: Quantity, t: f64, x: &Point) -> ExplicitDerivatives {
        self.of.at(self.lagrangian, quantity, t, &x.fixed()).into()
    }

    fn of_hamiltonian(&mut self, quantity: Quantity, t: f64, state: &State) -> ExplicitDerivatives {
        self.of.of_hamiltonian(self.lagrangian, quantity, t, &state.fixed()).into()
    }

    fn of_momentum(&mut self, quantity: Quantity, t: f64, (x, p): (&Point, &Vector)) -> Vector {
        self.of.of_momentum(self.lagrangian, quantity, t, (&x.fixed(), &p.fixed())).into()
    }

    fn along(
        &mut self,
        arch: Instructions,
        quantity: Quantity,
        at: &StageDerivatives,
        (w, weights): (&StageTangent, &Stages),
    ) -> f64 {
        let in_lanes = QuantityAlong { lagrangian: self.lagrangian, of: &self.of, quantity, at, w, weights };
        if let Some(sum) = arch.dispatch(in_lanes) {
            return sum;
        }
        let mut sum = 0.0;
        for i in 0..at.s {
            let (t, x) = at.point(i);
            let stage = |x: &[Stages]| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
            let tangent = ChartVector { x: stage(&w.q), y: stage(&w.v), z: w.z.0[i] };
            let along = (&tangent, w.r.0[i]);
            sum += weights.0[i] * self.of.along(self.lagrangian, quantity, (t, &x.fixed(), at.rho.0[i]), along);
        }
        sum
    }
}

/// [`ParameterDerivatives::sum_along`], compiled for one instruction set.
struct QuantityAlong<'e, L, const N: usize> {
    lagrangian: &'e L,
    of: &'e ParameterDerivatives<N>,
    quantity: Quantity,
    at: &'e StageDerivatives,
    w: &'e StageTangent,
    weights: &'e Stages,
}

impl<L: Parametric<N>, const N: usize> WithSimd for QuantityAlong<'_, L, N> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        self.of.sum_along::<S, L>(self.lagrangian, self.quantity, self.at, self.w, self.weights)
    }
}

impl<'a, L: Parametric<N>, const N: usize> StageSystem<'a> for OfParametric<'a, L, N> {
    fn quantities(&self) -> Box<dyn Quantities + 'a> {
        Box::new(OfParameters { lagrangian: self.0, of: ParameterDerivatives::new(self.0) })
    }

    fn evaluate_stages(
        &self,
        arch: Instructions,
        at: &mut StageDerivatives,
        forward: &StepMaps,
        step: &SolvedStages,
        actions: Option<&StageMap>,
    ) -> Result<(), StepError> {
        arch.dispatch(StageKernel { lagrangian: self.0, at, forward, step, actions })
    }
}

impl<'a, L: Parametric<N>, const N: usize> ParametricSystem<'a> for OfParametric<'a, L, N> {
    fn parameter_names(&self) -> Vec<String> {
        self.0.parameter_names()
    }

    fn parameters(&self) -> Vec<f64> {
        self.0.parameters()
    }

    fn with_parameters(&self, theta: &[f64], f: &mut dyn FnMut(&dyn System) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
        f(&OfTyped(&self.0.with_parameters(theta)?))
    }

    fn switching_function_along(&self, along: Argument, index: usize, t: f64, x: &Point) -> Option<f64> {
        let (theta, t, x) = moving_point(along, &self.0.parameters(), t, x);
        self.0.switching_function_at(&theta, index, t, &x).map(|g| g.d[0])
    }

    fn state_after_switch_along(&self, along: Argument, index: usize, t: f64, x: &Point) -> Option<Components> {
        let (theta, t, x) = moving_point(along, &self.0.parameters(), t, x);
        let to = self.0.state_after_switch_at(&theta, index, t, &x)?;
        Some(Components { x: to.q.map(|x| x.d[0]).into(), y: to.v.map(|x| x.d[0]).into(), z: to.z.d[0] })
    }

    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        self.0.break_rates(parameter)
    }

    fn hamiltonian(&self) -> Option<Box<dyn CollocationSystem + 'a>> {
        if const { L::HINTS.hamiltonian } { Some(Box::new(Typed::<L, N>(self.0))) } else { None }
    }
}
