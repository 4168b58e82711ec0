//! Any system, as derivatives of runs see it: evaluated at one stage after another.

use crate::integration::SolvedStages;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{StageMap, Stages};
use crate::sensitivity::linear_stages::StageTangent;
use crate::sensitivity::parametric_system::{ExplicitDerivatives, ParametricSystem, Quantities, Quantity, StageSystem};
use crate::sensitivity::stage_derivatives::StageDerivatives;
use crate::sensitivity::step_maps::StepMaps;
use crate::sensitivity::switch::Argument;
use crate::{Components, Point, SecondDerivatives, StepError, System, Vector};
use contact_geom::switching::BreakRate;
use pulp::{Simd, WithSimd};
use std::rc::Rc;

/// A [`System`] of any number of coordinates. Its switching functions and resets are differentiated by differences.
pub(crate) struct OfSystem<'a>(pub Rc<dyn System + 'a>);

impl<'a> StageSystem<'a> for OfSystem<'a> {
    fn quantities(&self) -> Box<dyn Quantities + 'a> {
        Box::new(OfQuantities::new(self.0.clone()))
    }

    fn evaluate_stages(
        &self,
        arch: Instructions,
        at: &mut StageDerivatives,
        forward: &StepMaps,
        step: &SolvedStages,
        actions: Option<&StageMap>,
    ) -> Result<(), StepError> {
        arch.dispatch(EvaluateStages { system: &*self.0, at, forward, step, actions })
    }
}

impl<'a> ParametricSystem<'a> for OfSystem<'a> {
    fn parameter_names(&self) -> Vec<String> {
        self.0.parameter_names()
    }

    fn parameters(&self) -> Vec<f64> {
        self.0.parameters()
    }

    fn with_parameters(&self, theta: &[f64], f: &mut dyn FnMut(&dyn System) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
        f(&*self.0.with_parameters(theta)?)
    }

    fn switching_function_along(&self, _along: Argument, _index: usize, _t: f64, _x: &Point) -> Option<f64> {
        None
    }

    fn state_after_switch_along(&self, _along: Argument, _index: usize, _t: f64, _x: &Point) -> Option<Components> {
        None
    }

    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        self.0.break_rates(parameter)
    }
}

/// The derivatives in parameters and time.
pub(super) struct OfQuantities<'a> {
    system: Rc<dyn System + 'a>,
    count: usize,
}

impl<'a> OfQuantities<'a> {
    pub fn new(system: Rc<dyn System + 'a>) -> Self {
        let count = system.parameter_names().len();
        OfQuantities { system, count }
    }
}

impl Quantities for OfQuantities<'_> {
    fn count(&self) -> usize {
        self.count
    }

    fn at(&mut self, quantity: Quantity, t: f64, x: &Point) -> ExplicitDerivatives {
        self.system.in_quantity(quantity, t, x)
    }

    fn of_momentum(&mut self, quantity: Quantity, t: f64, (x, _): (&Point, &Vector)) -> Vector {
        self.at(quantity, t, x).gradient.y
    }

    fn along(
        &mut self,
        _arch: Instructions,
        quantity: Quantity,
        at: &StageDerivatives,
        (w, weights): (&StageTangent, &Stages),
    ) -> f64 {
        let mut sum = 0.0;
        for i in 0..at.s {
            let (t, x) = at.point(i);
            let of = self.at(quantity, t, &x);
            let stage = |w: &[Stages]| w.iter().map(|w| w.0[i]).collect::<Vector>();
            let tangent = Components { x: stage(&w.q), y: stage(&w.v), z: w.z.0[i] };
            let along = of.gradient.dot(&tangent) + of.force.dot(&tangent.x);
            sum += weights.0[i] * (w.r.0[i] * of.l + at.rho.0[i] * along);
        }
        sum
    }
}

/// The derivatives at the stages of a step, as [`ParametricSystem::evaluate_stages`] has them.
struct EvaluateStages<'e> {
    system: &'e dyn System,
    at: &'e mut StageDerivatives,
    forward: &'e StepMaps,
    step: &'e SolvedStages,
    actions: Option<&'e StageMap>,
}

impl WithSimd for EvaluateStages<'_> {
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let EvaluateStages { system, at, forward, step, actions } = self;
        at.set_points::<S>(forward, step);
        for i in 0..step.s {
            at.evaluate_stage_of(system, i)?;
        }
        if let (false, Some(actions)) = (step.knows_l, actions) {
            at.set_actions::<S>(forward, step, actions);
        }
        Ok(())
    }
}

impl StageDerivatives {
    /// Evaluates L and the force with their derivatives at one stage.
    pub(super) fn evaluate_stage_of(&mut self, system: &dyn System, i: usize) -> Result<(), StepError> {
        let ((t, x), n) = (self.point(i), self.q.len());
        let (l, g) = (system.value(t, &x), system.gradient(t, &x));
        let SecondDerivatives { qq, qv, vv, qz, vz, zz } = system.hessian(t, &x);
        let inverse = match &self.form.inverse_mass {
            Some(inverse) => inverse / self.rho.0[i],
            None => (vv * self.rho.0[i]).try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?,
        };
        let finite = inverse.iter().chain(&qq).chain(&qv).chain(&qz).chain(&vz).chain([&zz, &l]).all(|e| e.is_finite());
        if !(finite && g.is_finite()) {
            return Err(StepError::NonFinite);
        }
        self.l.0[i] = l;
        self.l_z.0[i] = g.z;
        self.zz.0[i] = zz;
        for d in 0..n {
            self.l_q[d].0[i] = g.x[d];
            self.l_v[d].0[i] = g.y[d];
            self.qz[d].0[i] = qz[d];
            self.vz[d].0[i] = vz[d];
            for e in 0..n {
                self.inverse_mass[(d, e)].0[i] = inverse[(d, e)];
                self.qq[(d, e)].0[i] = qq[(d, e)];
                self.qv[(d, e)].0[i] = qv[(d, e)];
            }
        }
        let Some(forces) = &mut self.force else { return Ok(()) };
        // A system that may have a force need not have one.
        let Some(applied) = system.force_derivatives(t, &x) else { return Ok(()) };
        for d in 0..n {
            forces.value[d].0[i] = applied.value[d];
            forces.z[d].0[i] = applied.z[d];
            for e in 0..n {
                forces.q[(d, e)].0[i] = applied.q[(d, e)];
                forces.v[(d, e)].0[i] = applied.v[(d, e)];
            }
        }
        Ok(())
    }
}
