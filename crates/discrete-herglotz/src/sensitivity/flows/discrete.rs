//! Steps of a custom discrete Lagrangian, and steps under constraints.

use super::SubFlows;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::integration::{SharedIntegrator, StepEnds, SystemProblem};
use crate::sensitivity::parametric_system::{ExplicitDerivatives, Quantities, Quantity};
use crate::system::products::times;
use crate::{Components, Point, StepError, Vector};

/// Steps whose derivative in the state is computed by the integrator: for a custom discrete Lagrangian that of the discrete
/// Hamiltonian flow, by the implicit function theorem and the second jet. How it depends on parameters and on the step
/// size is known where the integrator computes derivatives along variations of the Lagrangian.
pub(super) struct DiscreteSteps<'a> {
    pub problem: SystemProblem<'a>,
    pub integrator: SharedIntegrator<'a>,
    /// Whether it computes these.
    pub varies: bool,
}

impl DiscreteSteps<'_> {
    /// The derivatives of a step in each parameter, in its time and in its length.
    fn sources(&self, step: &StepEnds, of: &mut dyn Quantities) -> Result<Vec<Components>, StepError> {
        let StepEnds { t, h, start, end } = step;
        let system = &self.problem.system;
        let along = |parameter, variation: &mut dyn FnMut(f64, &Point) -> (f64, Components)| {
            let step = (*t, start, end);
            let source = self.integrator.step_variation(&self.problem, *h, step, parameter, variation)?;
            source.ok_or(StepError::NonFinite)
        };
        // The value with the gradient, which contains the force.
        let varied = |of: &mut dyn Quantities, quantity: Quantity, s: f64, x: &Point| {
            let ExplicitDerivatives { l, mut gradient, force } = of.at(quantity, s, x);
            gradient.x += force;
            (l, gradient)
        };
        let mut sources = Vec::with_capacity(of.count() + 2);
        for quantity in (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]) {
            let parameter = if let Quantity::Parameter(k) = quantity { Some(k) } else { None };
            sources.push(along(parameter, &mut |s, x| varied(of, quantity, s, x))?);
        }
        // In the length: see `Integrator::step_variation`.
        let of_length = along(None, &mut |s, x| {
            let (l, mut slope) = (system.value(s, x), system.gradient(s, x));
            if system.hints().forced {
                slope.x += system.applied_force(s, x);
            }
            let second = system.hessian(s, x);
            let (of_time, slope_of_time) = varied(of, Quantity::Time, s, x);
            let gradient = Components {
                x: slope.x - times(&second.qv, &x.v),
                y: -times(&second.vv, &x.v),
                z: slope.z - second.vz.dot(&x.v),
            };
            let later = s - t;
            (l - x.v.dot(&slope.y) + later * of_time, gradient.plus(&slope_of_time.scale(later)))
        })?;
        sources.push(of_length.scale(h.recip()));
        Ok(sources)
    }
}

impl SubFlows for DiscreteSteps<'_> {
    fn linearise(
        &self,
        step: &StepEnds,
        of: Option<&mut (dyn Quantities + '_)>,
        flows: &mut Vec<SubFlow>,
    ) -> Result<(), StepError> {
        let StepEnds { t, h, start, end } = step;
        let n = start.q.len();
        let jacobian = self.integrator.step_jacobian(&self.problem, *h, (*t, start, end))?;
        let matrix = jacobian.filter(|m| m.shape() == (2 * n + 1, 2 * n + 1)).ok_or(StepError::NonFinite)?;
        let mut state = TangentMatrix::identity(n);
        // The coordinates are in the order q, p, z.
        for j in 0..=2 * n {
            let column = |from: usize| Vector::from_fn(n, |i| matrix[(from + i, j)]);
            state.set_column(j, Components { x: column(0), y: column(n), z: matrix[(2 * n, j)] });
        }
        let none = || Vector::repeat(n, f64::NAN);
        let unknown = Components { x: none(), y: none(), z: f64::NAN };
        let sources = match of {
            None => Vec::new(),
            Some(of) if self.varies => self.sources(step, of)?,
            Some(of) => vec![unknown; of.count() + 2],
        };
        flows.push(SubFlow { state, sources, start: 0.0, duration: 1.0 });
        Ok(())
    }

    fn only_in_start(&self) -> bool {
        !self.varies
    }
}
