//! Whether the steps of a rigid body are contact transformations.

use super::run::Prepared;
use super::steps::of_integrator;
use super::{Body, BodyMotion};
use crate::{Check, MomentumSample, NotContact, RuntimeError, Sample, Statement, StatementResidual};
use contact_geom::groups::Rotations;
use contact_geom::nalgebra::Vector3;
use contact_geom::numbers::max_abs_or_nan;
use discrete_herglotz::AnyIntegrator;
use discrete_herglotz::groups::{GroupDerivatives, GroupMotion, GroupState, group_distance};

/// The collocation with which steps are compared.
const REFERENCE: AnyIntegrator = AnyIntegrator::Gauss { stages: 16 };

/// The largest angle by which a step of the reference turns the body: its iteration converges.
const TURN_OF_REFERENCE: f64 = 0.4;

impl Body {
    /// Checks that the steps of a motion are contact transformations of T\*SO(3) x R: the pullback of
    /// `dz - Pi . (R^-1 dR)` by a step is `sigma_d` times it, by dual numbers through the step, at a number of places along
    /// the motion; with the [momenta](Self::momenta) and their predictions, and the rate at which the steps depart from the
    /// equations of motion. With a torque the statement is that the defect of a step is the virtual work of the torque.
    ///
    /// ```
    /// use herglotz_runtime::{Body, BodyMotion, StepControl};
    /// let body = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() };
    /// let accuracy = StepControl::Accuracy { error: 1e-9, by: None };
    /// let check = body.check(&BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.25], 5.0, accuracy), 4)?;
    /// assert!(check.is_contact() && check.momentum_defect() < 1e-13);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`run`](Self::run), and [`RuntimeError::Argument`] where a step fails.
    pub fn check(&self, motion: &BodyMotion, places: usize) -> Result<Check, RuntimeError> {
        let Prepared { rows, mut state, by, steps, step_size, integrator, .. } = self.prepare(motion)?;
        let of = |error| of_integrator(&error);
        let names = self.momenta()?;
        let momenta = |at: &GroupState<Rotations, 3>| -> Vec<f64> {
            let spatial = at.spatial_momentum();
            let value = |name: &String| match name.as_str() {
                "M1" => spatial[0],
                "M2" => spatial[1],
                "M3" => spatial[2],
                "Pi1" => at.momentum[0],
                "Pi2" => at.momentum[1],
                "Pi3" => at.momentum[2],
                _ => Vector3::from(self.gravity).dot(&spatial),
            };
            names.iter().map(value).collect()
        };
        let at_start = momenta(&state.state());
        let places = places.clamp(1, steps);
        let (mut samples, mut residuals, mut taken) = (Vec::with_capacity(places), Vec::new(), 0);
        for place in 0..places {
            let next = place * (steps - 1) / (places - 1).max(1);
            state.advance(&integrator, next - taken).map_err(of)?;
            taken = next;
            let (t, from) = (state.t(), state.state());
            let step = GroupDerivatives::new(&integrator, t, &from, 1).map_err(of)?;
            // The work is that of a step without parts.
            let whole = !integrator.divides(t, step_size);
            if let Some(work) = integrator.integrator().integrator.virtual_work(t, &from).filter(|_| whole) {
                residuals.push(step.contact_defect_beside(&work.map_err(of)?));
            }
            let mut reference = GroupMotion::<Rotations, 3>::new(t, from).map_err(of)?;
            let turn = rows.lagrangian.velocity(&from.momentum).norm() * step_size.abs();
            // The cast saturates.
            let count = (turn / TURN_OF_REFERENCE).ceil().max(2.0) as usize;
            let fine = self.with_step(REFERENCE, step_size / count as f64)?;
            reference.advance(&fine, count).map_err(of)?;
            let (end, size) = (reference.state(), 1.0 + from.z.abs());
            let apart = group_distance(&step.end, &end) + (step.end.z - end.z).abs() / size;
            let predicted = at_start.iter().map(|start| start * state.log_factor().exp());
            let momenta = momenta(&from).into_iter().zip(predicted);
            samples.push(Sample {
                t,
                sigma: step.log_factor.exp(),
                log_factor: state.log_factor(),
                contact_defect: step.contact_defect(),
                herglotz_defect: apart / step_size.abs(),
                momenta: momenta.map(|(momentum, predicted)| MomentumSample { momentum, predicted }).collect(),
            });
        }
        let not_contact = self.torque.as_ref().map(|_| NotContact::Forced);
        let residual = max_abs_or_nan(residuals);
        let (statement, method) = (Statement::VirtualWork, by.to_string());
        let of_force = not_contact.map(|_| StatementResidual { statement, method, step_size, residual });
        let statements = of_force.into_iter().collect();
        Ok(Check { integrator: by.to_string(), step_size, samples, statements, not_contact })
    }
}
