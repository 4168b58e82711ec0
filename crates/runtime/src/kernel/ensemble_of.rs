//! Ensembles of systems that are compiled for a number of coordinates.

use super::ensemble::{Block, ManyMotions, Results};
use super::formula_system::{FormulaSystem, Observed};
use super::observed::{MemberObserver, MemberRecord};
use super::sized::Sized;
use crate::{Ensemble, Interrupt, StepControl};
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::ensemble::{EnsembleError, Member, Tally};
use discrete_herglotz::{Start, Until};
use formula_lagrangian::FormulaError;

impl<L: FormulaSystem<N>, const N: usize> ManyMotions for Sized<L, N> {
    fn system(&self) -> &dyn Observed {
        &self.0
    }

    fn check_parameters(&self, names: &[&str]) -> Result<(), FormulaError> {
        let mut lagrangian = self.0.clone();
        names.iter().try_for_each(|name| lagrangian.set(name, 0.0))
    }

    fn run_block(&self, block: &Block<'_>, results: &mut Results<'_>) -> Result<Tally, EnsembleError> {
        let (Ensemble { t0, end, step_control, varied, threads, .. }, first) = (block.ensemble, block.members.start);
        let start = |i: usize| self.start_of_member(&block.start(i));
        let own: Option<Vec<Option<L>>> = varied.as_ref().map(|varied| {
            let with = |index: usize| {
                let (mut lagrangian, values) = (self.0.clone(), (varied.values)(index));
                varied.names.iter().zip(&values).try_for_each(|(name, value)| lagrangian.set(name, *value)).ok()?;
                Some(lagrangian)
            };
            block.members.clone().map(with).collect()
        });
        let lagrangian = |i: usize| own.as_ref().map_or(Some(&self.0), |own| own.get(i).and_then(Option::as_ref));
        let many = match &own {
            None => discrete_herglotz::Ensemble::new(&self.0, *t0, block.members.len(), start),
            // A member with invalid parameters gets an invalid start, so that it is refused.
            Some(_) => discrete_herglotz::Ensemble::of(*t0, block.members.len(), |i| match lagrangian(i) {
                Some(lagrangian) => (lagrangian, start(i)),
                None => (&self.0, invalid_start()),
            }),
        };
        let refused = |cause| EnsembleError::Member { index: first, cause };
        let by = match *step_control {
            StepControl::Accuracy { by, .. } => by,
            StepControl::Steps { by, .. } => Some(by),
        };
        let many = match (*step_control, self.0.constrained(by).map_err(refused)?) {
            (StepControl::Accuracy { error, .. }, Some(method)) => many.by(method).accuracy(error),
            (StepControl::Steps { steps, .. }, Some(method)) => many.by(method).steps(steps),
            (StepControl::Accuracy { error, by: None }, None) => many.accuracy(error),
            (StepControl::Accuracy { error, by: Some(by) }, None) => {
                many.by(L::by(by).map_err(refused)?).accuracy(error)
            }
            (StepControl::Steps { by, steps }, None) => many.by(L::by(by).map_err(refused)?).steps(steps),
        };
        let many = many.threads(*threads).with_interrupt(block.interrupt.map(Interrupt::for_integrators));
        let mut pass_on = |member: &Member, record: MemberRecord| {
            results.pass_on(block, lagrangian(member.index).unwrap_or(&self.0), member, record);
        };
        if block.observed {
            let observer = |i: usize| block.observer(i, lagrangian(i).map(|system| system as &dyn Observed));
            let many = many.observe(observer, MemberObserver::into_record);
            many.run(Until::Time(*end), |member, record| pass_on(member, record.unwrap_or_default()))
        } else {
            many.run(Until::Time(*end), |member| pass_on(member, MemberRecord::default()))
        }
    }
}

/// An invalid start, which every run refuses.
pub(super) fn invalid_start<const N: usize>() -> Start<N> {
    let none = SVector::repeat(f64::NAN);
    VelocityPoint { q: none, v: none, z: f64::NAN }.into()
}

impl<L: FormulaSystem<N>, const N: usize> Sized<L, N> {
    pub(super) fn start_of_member(&self, start: &crate::Start) -> Start<N> {
        self.start(start).unwrap_or_else(|_| invalid_start())
    }
}
