//! Steps of a custom discrete Lagrangian, and steps under constraints.

use super::SubFlows;
use super::sources::Sources;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::integration::{QuantityDerivatives, SharedIntegrator, StepEnds, SystemProblem};
use crate::sensitivity::parametric_system::Quantity;
use crate::{Components, Point, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Derivatives, Parametric, VelocityPoint};

/// Steps whose derivative in the state is computed by the integrator: for a custom discrete Lagrangian that of the discrete
/// Hamiltonian flow, by the implicit function theorem and the second jet. How it depends on parameters and on the step
/// size is known where the integrator computes derivatives along variations of the Lagrangian.
pub(super) struct DiscreteSteps<'a, L> {
    pub lagrangian: &'a L,
    pub problem: SystemProblem<'a>,
    pub integrator: SharedIntegrator<'a>,
    /// Whether it computes these.
    pub varies: bool,
}

impl<L> DiscreteSteps<'_, L> {
    /// The derivatives of a step in each parameter, in its time and in its length.
    fn sources<const N: usize>(&self, step: &StepEnds, of: &mut Sources<'_>) -> Result<Vec<ChartVector<N>>, StepError>
    where
        L: Parametric<N>,
    {
        let StepEnds { t, h, start, end } = step;
        let lagrangian = self.lagrangian;
        let along = |variation: &mut dyn FnMut(f64, &VelocityPoint<N>) -> (f64, ChartVector<N>)| {
            let mut variation = |s: f64, x: &Point| {
                let (l, gradient) = variation(s, &x.fixed());
                (l, Components::from(gradient))
            };
            let source = self.integrator.step_variation(&self.problem, *h, (*t, start, end), &mut variation)?;
            source.map(|source| source.fixed::<N>()).ok_or(StepError::NonFinite)
        };
        // The value with the gradient, which contains the force.
        let varied = |of: &mut Sources<'_>, quantity: Quantity, s: f64, x: &VelocityPoint<N>| {
            let QuantityDerivatives { l, mut gradient, force } = of.at(quantity, s, x);
            gradient.x += force;
            (l, gradient)
        };
        let mut sources = Vec::with_capacity(of.count() + 2);
        for quantity in (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]) {
            sources.push(along(&mut |s, x| varied(of, quantity, s, x))?);
        }
        // In the length: see `Integrator::step_variation`.
        let of_length = along(&mut |s, x| {
            let (l, slope) = lagrangian.with_gradient_and_force(s, x);
            let second = lagrangian.hessian(s, x);
            let (of_time, slope_of_time) = varied(of, Quantity::Time, s, x);
            let gradient =
                ChartVector { x: slope.x - second.qv * x.v, y: -(second.vv * x.v), z: slope.z - second.vz.dot(&x.v) };
            let later = s - t;
            (l - x.v.dot(&slope.y) + later * of_time, gradient.plus(slope_of_time.scale(later)))
        })?;
        sources.push(of_length.scale(h.recip()));
        Ok(sources)
    }
}

impl<L: Parametric<N>, const N: usize> SubFlows<N> for DiscreteSteps<'_, L> {
    fn linearise(
        &self,
        step: &StepEnds,
        of: Option<&mut Sources<'_>>,
        flows: &mut Vec<SubFlow<N>>,
    ) -> Result<(), StepError> {
        let StepEnds { t, h, start, end } = step;
        let jacobian = self.integrator.step_jacobian(&self.problem, *h, (*t, start, end))?;
        let matrix = jacobian.filter(|m| m.shape() == (2 * N + 1, 2 * N + 1)).ok_or(StepError::NonFinite)?;
        let mut state = TangentMatrix::identity();
        // The coordinates are in the order q, p, z.
        for j in 0..=2 * N {
            let column = |from: usize| SVector::from_fn(|i, _| matrix[(from + i, j)]);
            state.set_column(j, &ChartVector { x: column(0), y: column(N), z: matrix[(2 * N, j)] });
        }
        let unknown = SVector::from_element(f64::NAN);
        let unknown = ChartVector { x: unknown, y: unknown, z: f64::NAN };
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
