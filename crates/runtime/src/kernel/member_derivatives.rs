//! Derivatives of the members of an ensemble.

use super::DERIVATIVES;
use super::ensemble_of::invalid_start;
use super::sensitivity::{covector, loss_gradient, sensitivity_of, state};
use super::sized::Sized;
use crate::full::{FULL, not_compiled};
use crate::{BatchLoss, Ensemble, Interrupt, LossGradient, MotionState, RuntimeError, Sensitivity, StepControl};
use discrete_herglotz::ensemble::{EnsembleError, Lagrangians};
use discrete_herglotz::sensitivity::{SensitivityError, Variable};
use discrete_herglotz::{InputError, Until};
use formula_lagrangian::FormulaLagrangian;

/// The number of members whose Lagrangians are in memory at once.
const MEMBERS_PER_BLOCK: usize = 1024;

pub(super) fn gradients<const N: usize>(
    system: &Sized<FormulaLagrangian<N>, N>,
    ensemble: &Ensemble<'_>,
    times: &[f64],
    loss: &BatchLoss<'_>,
    interrupt: Option<&Interrupt>,
) -> Result<Vec<Result<LossGradient, RuntimeError>>, RuntimeError> {
    if const { !FULL } {
        return Err(not_compiled(DERIVATIVES));
    }
    let n = system.0.formula().dimension();
    let found = each_block(system, ensemble, interrupt, |members, first| {
        let of_states = |i: usize, states: &[MotionState]| {
            let states: Vec<MotionState> = states.iter().map(|of| state(of, n)).collect();
            let (value, covectors) = loss(first + i, &states);
            (value, covectors.iter().map(|of| covector(of, n, N)).collect())
        };
        Ok(members.gradient_at(times, of_states, Until::Time(ensemble.end))?.members)
    })?;
    Ok(found.into_iter().map(|member| Ok(loss_gradient(member?, n))).collect())
}

pub(super) fn sensitivities<const N: usize>(
    system: &Sized<FormulaLagrangian<N>, N>,
    ensemble: &Ensemble<'_>,
    variables: &[Variable],
    times: &[f64],
    interrupt: Option<&Interrupt>,
) -> Result<Vec<Result<Sensitivity, RuntimeError>>, RuntimeError> {
    if const { !FULL } {
        return Err(not_compiled(DERIVATIVES));
    }
    let n = system.0.formula().dimension();
    let found = each_block(system, ensemble, interrupt, |members, _| {
        members.tangent_at(variables, times, Until::Time(ensemble.end))
    })?;
    Ok(found.into_iter().map(|member| Ok(sensitivity_of(&member?, n))).collect())
}

/// Calls a function with ensembles of consecutive members, and the index of the first of each.
fn each_block<R, const N: usize>(
    system: &Sized<FormulaLagrangian<N>, N>,
    ensemble: &Ensemble<'_>,
    interrupt: Option<&Interrupt>,
    mut work: impl FnMut(
        &discrete_herglotz::Ensemble<'_, Lagrangians<'_, FormulaLagrangian<N>, N>>,
        usize,
    ) -> Result<Vec<Result<R, SensitivityError>>, EnsembleError>,
) -> Result<Vec<Result<R, SensitivityError>>, RuntimeError> {
    if ensemble.count == 0 {
        return Err(EnsembleError::Empty.into());
    }
    if let Some(varied) = &ensemble.varied {
        let mut lagrangian = system.0.clone();
        varied.names.iter().try_for_each(|name| lagrangian.set(name, 0.0))?;
    }
    let mut results = Vec::with_capacity(ensemble.count);
    while results.len() < ensemble.count {
        if interrupt.is_some_and(Interrupt::is_wanted) {
            return Err(InputError::Interrupted.into());
        }
        let first = results.len();
        let count = MEMBERS_PER_BLOCK.min(ensemble.count - first);
        let own: Option<Vec<Option<FormulaLagrangian<N>>>> = ensemble.varied.as_ref().map(|varied| {
            let with = |i: usize| {
                let (mut lagrangian, values) = (system.0.clone(), (varied.values)(first + i));
                varied.names.iter().zip(&values).try_for_each(|(name, value)| lagrangian.set(name, *value)).ok()?;
                Some(lagrangian)
            };
            (0..count).map(with).collect()
        });
        let start = |i: usize| system.start_of_member(&(ensemble.start)(first + i));
        let many = match &own {
            None => discrete_herglotz::Ensemble::new(&system.0, ensemble.t0, count, start),
            // A member with invalid parameters gets an invalid start, so that it is refused.
            Some(own) => discrete_herglotz::Ensemble::of(ensemble.t0, count, |i| match own.get(i) {
                Some(Some(lagrangian)) => (lagrangian, start(i)),
                _ => (&system.0, invalid_start()),
            }),
        };
        let many = match ensemble.step_control {
            StepControl::Accuracy { error, by: None } => many.accuracy(error),
            StepControl::Accuracy { error, by: Some(by) } => many.by(by).accuracy(error),
            StepControl::Steps { by, steps } => many.by(by).steps(steps),
        };
        let many = many.threads(ensemble.threads).with_interrupt(interrupt.map(Interrupt::for_integrators));
        results.extend(work(&many, first)?);
    }
    Ok(results)
}
