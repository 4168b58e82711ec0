//! Ensembles of formulas with any number of coordinates.

use super::ensemble::{Block, ManyMotions, Results};
use super::formula_system::Observed;
use super::many::{ManyCoordinates, gauss};
use super::observed::{MemberObserver, MemberRecord};
use super::sized::initial_state;
use crate::{Ensemble, Interrupt, StepControl};
use discrete_herglotz::ensemble::{EnsembleError, Member, Tally};
use discrete_herglotz::{InitialState, Point, System, Until, Vector};
use formula_lagrangian::FormulaError;

impl ManyMotions for ManyCoordinates {
    fn system(&self) -> &dyn Observed {
        self
    }

    fn check_parameters(&self, names: &[&str]) -> Result<(), FormulaError> {
        self.with_values(names.iter().map(|name| (*name, 0.0))).map(|_| ())
    }

    fn run_block(&self, block: &Block<'_>, results: &mut Results<'_>) -> Result<Tally, EnsembleError> {
        let Ensemble { t0, end, step_control, varied, threads, .. } = block.ensemble;
        let own: Option<Vec<Option<ManyCoordinates>>> = varied.as_ref().map(|varied| {
            let with = |index: usize| {
                let values = (varied.values)(index);
                self.with_values(varied.names.iter().copied().zip(values)).ok()
            };
            block.members.clone().map(with).collect()
        });
        let system = |i: usize| own.as_ref().map_or(Some(self), |own| own.get(i).and_then(Option::as_ref));
        // A member with invalid parameters or an invalid start gets a start that is refused.
        let start = |i: usize| initial_state(self.formula(), &block.start(i)).unwrap_or_else(|_| self.invalid_start());
        let many = discrete_herglotz::Ensemble::of_systems(*t0, block.members.len(), |i| match system(i) {
            Some(system) => (system as &(dyn System + Sync), start(i)),
            None => (self as &(dyn System + Sync), self.invalid_start()),
        });
        let refused = |cause| EnsembleError::Member { index: block.members.start, cause };
        let many = match *step_control {
            StepControl::Accuracy { error, by: None } => many.accuracy(error),
            StepControl::Accuracy { error, by: Some(by) } => many.by(gauss(by).map_err(refused)?).accuracy(error),
            StepControl::Steps { by, steps } => many.by(gauss(by).map_err(refused)?).steps(steps),
        };
        let many = many.threads(*threads).with_interrupt(block.interrupt.map(Interrupt::for_integrators));
        let mut pass_on = |member: &Member, record: MemberRecord| {
            results.pass_on(block, system(member.index).unwrap_or(self), member, record);
        };
        if block.observed {
            let observer = |i: usize| block.observer(i, system(i).map(|system| system as &dyn Observed));
            let many = many.observe(observer, MemberObserver::into_record);
            many.run(Until::Time(*end), |member, record| pass_on(member, record.unwrap_or_default()))
        } else {
            many.run(Until::Time(*end), |member| pass_on(member, MemberRecord::default()))
        }
    }
}

impl ManyCoordinates {
    /// A start that every run refuses.
    fn invalid_start(&self) -> InitialState {
        let none = Vector::repeat(self.dimension(), f64::NAN);
        Point { q: none.clone(), v: none, z: f64::NAN }.into()
    }
}
