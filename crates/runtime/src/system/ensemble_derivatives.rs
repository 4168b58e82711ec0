//! Derivatives of the members of an ensemble of a system.

use super::derivatives::check_events;
use crate::kernel::of_expression;
use crate::{BatchLoss, Ensemble, Interrupt, LossGradient, MotionState, RuntimeError, Sensitivity, System};
use formula_lagrangian::Expression;
use std::sync::{Mutex, PoisonError};

impl System {
    /// Runs the members of an ensemble on several threads, and computes the value and the gradient of a loss of the
    /// states of each at some times, with respect to its start and its parameters, as [`gradient`](Self::gradient) does
    /// for a motion; in the order of the members. A member that was not completed has a status and no gradient, and one
    /// that cannot start has an error. The results do not depend on the number of threads. Resets are those of the system;
    /// rows, columns and other events of the ensemble, which do not change its motions, are ignored.
    ///
    /// # Errors
    /// No members or threads, an unknown name of a parameter that varies, and terminal events.
    pub fn ensemble_gradient(
        &self,
        ensemble: &Ensemble<'_>,
        times: &[f64],
        loss: &BatchLoss<'_>,
        interrupt: Option<&Interrupt>,
    ) -> Result<Vec<Result<LossGradient, RuntimeError>>, RuntimeError> {
        check_events(ensemble.events)?;
        self.kernel.ensemble_gradient(ensemble, times, loss, interrupt)
    }

    /// The same for an expression of the state at the end, which has the parameters of the member.
    ///
    /// # Errors
    /// Those of [`ensemble_gradient`](Self::ensemble_gradient).
    pub fn ensemble_end_gradient(
        &self,
        ensemble: &Ensemble<'_>,
        loss: &Expression,
        interrupt: Option<&Interrupt>,
    ) -> Result<Vec<Result<LossGradient, RuntimeError>>, RuntimeError> {
        let explicit: Vec<Mutex<Vec<f64>>> = (0..ensemble.count).map(|_| Mutex::default()).collect();
        let of_end = |index: usize, states: &[MotionState]| {
            let Some(end) = states.last() else { return (f64::NAN, Vec::new()) };
            let mut loss = loss.clone();
            if let Some(varied) = &ensemble.varied {
                let values = (varied.values)(index);
                // A value that cannot be set has already caused the member to be refused.
                varied.names.iter().zip(&values).for_each(|(name, value)| drop(loss.set(name, *value)));
            }
            let (value, covector, parameters) = of_expression(&loss, end);
            if let Some(kept) = explicit.get(index) {
                *kept.lock().unwrap_or_else(PoisonError::into_inner) = parameters;
            }
            (value, vec![covector])
        };
        let mut found = self.ensemble_gradient(ensemble, &[ensemble.end], &of_end, interrupt)?;
        for (member, parameters) in found.iter_mut().zip(explicit) {
            let parameters = parameters.into_inner().unwrap_or_else(PoisonError::into_inner);
            if let Ok(LossGradient { loss: Some((_, gradient)), .. }) = member {
                gradient.parameters.iter_mut().zip(&parameters).for_each(|(sum, more)| *sum += more);
            }
        }
        Ok(found)
    }

    /// The states of the members of an ensemble at some times with their derivatives in variables, as
    /// [`sensitivity`](Self::sensitivity) has them; in the order of the members.
    ///
    /// # Errors
    /// Those of [`ensemble_gradient`](Self::ensemble_gradient), and [`RuntimeError::UnknownVariable`].
    pub fn ensemble_sensitivity(
        &self,
        ensemble: &Ensemble<'_>,
        variables: &[&str],
        times: &[f64],
        interrupt: Option<&Interrupt>,
    ) -> Result<Vec<Result<Sensitivity, RuntimeError>>, RuntimeError> {
        let variables = variables.iter().map(|name| self.variable(name)).collect::<Result<Vec<_>, _>>()?;
        check_events(ensemble.events)?;
        self.kernel.ensemble_sensitivity(ensemble, &variables, times, interrupt)
    }
}
