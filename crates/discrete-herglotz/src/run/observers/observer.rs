//! Observers of a run.

use crate::InputError;
use crate::run::observers::output_request::{OutputRequest, RunInfo};
use crate::run::observers::step_view::{StepView, Stop};
use std::ops::ControlFlow;

/// An observer of a run. It is called at the start, at least at the steps that it requests, and at the last step.
///
/// Pairs, triples and vectors of observers are called in their order.
pub trait Observer {
    /// The quantities that it requests of the run; by default the action.
    fn needs(&self) -> OutputRequest {
        OutputRequest::ACTION
    }

    /// Called with the data of the run before it starts.
    ///
    /// # Errors
    /// An [`InputError`] if it cannot observe the run.
    fn prepare(&mut self, _info: &RunInfo) -> Result<(), InputError> {
        Ok(())
    }

    /// The number of the step, counted from 1, at whose end it is called next after `taken` steps; the steps before
    /// that may be taken together. By default the next step; `usize::MAX` for the last step of the run only.
    fn next(&self, taken: usize) -> usize {
        taken + 1
    }

    /// Whether it sees the motion at the start and at the end of the run alone, and nothing between is lost where the run
    /// takes its steps without it: by default not. A run for an accuracy may then be one of its trial runs.
    fn sees_only_the_ends(&self) -> bool {
        false
    }

    /// Called at the start, before the first step.
    fn start(&mut self, _at: &StepView<'_>) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }

    /// Called at the end of a step that this or another observer has requested, and of the last step; `Break` ends the
    /// run.
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop>;

    /// Whether it must see the time after the motion has come to rest in intervals of the length of a step or of some of
    /// them, rather than at once: by default not. `from` is the view at the time of rest; the state does not change
    /// until `t_end`, and no step is taken.
    fn follows_rest(&mut self, _from: &StepView<'_>, _t_end: f64) -> bool {
        false
    }

    /// An observer that ends trial runs where this one ends its run, and has no other effect; `None`, the default, if
    /// it never ends a run. An accuracy is then not refused because of the motion after that end.
    fn terminal(&self) -> Option<Terminal<'_>> {
        None
    }
}

/// An observer that only ends runs; see [`Observer::terminal`].
pub type Terminal<'o> = Box<dyn Observer + 'o>;

/// Combines the terminal observers of several observers.
fn all_terminal<'o>(of: impl IntoIterator<Item = Option<Terminal<'o>>>) -> Option<Terminal<'o>> {
    let all: Vec<_> = of.into_iter().flatten().collect();
    (!all.is_empty()).then(|| Box::new(all) as Terminal<'o>)
}

/// Implements [`Observer`] for tuples of observers.
macro_rules! one_after_the_other {
    ($($name:ident $field:tt),+) => {
        impl<$($name: Observer),+> Observer for ($($name,)+) {
            fn needs(&self) -> OutputRequest {
                OutputRequest::default()$(.and(self.$field.needs()))+
            }
            fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
                $(self.$field.prepare(info)?;)+
                Ok(())
            }
            fn next(&self, taken: usize) -> usize {
                usize::MAX$(.min(self.$field.next(taken)))+
            }
            fn sees_only_the_ends(&self) -> bool {
                [$(self.$field.sees_only_the_ends()),+].iter().all(|ends| *ends)
            }
            fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
                $(self.$field.start(at)?;)+
                ControlFlow::Continue(())
            }
            fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
                $(self.$field.step(at)?;)+
                ControlFlow::Continue(())
            }
            fn follows_rest(&mut self, from: &StepView<'_>, t_end: f64) -> bool {
                [$(self.$field.follows_rest(from, t_end)),+].contains(&true)
            }
            fn terminal(&self) -> Option<Terminal<'_>> {
                all_terminal([$(self.$field.terminal()),+])
            }
        }
    };
}

one_after_the_other!(A 0, B 1);
one_after_the_other!(A 0, B 1, C 2);

impl<O: Observer> Observer for Vec<O> {
    fn needs(&self) -> OutputRequest {
        self.iter().fold(OutputRequest::default(), |needs, observer| needs.and(observer.needs()))
    }
    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.iter_mut().try_for_each(|observer| observer.prepare(info))
    }
    fn next(&self, taken: usize) -> usize {
        self.iter().map(|observer| observer.next(taken)).min().unwrap_or(usize::MAX)
    }
    fn sees_only_the_ends(&self) -> bool {
        self.iter().all(Observer::sees_only_the_ends)
    }
    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.iter_mut().try_for_each(|observer| observer.start(at))
    }
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.iter_mut().try_for_each(|observer| observer.step(at))
    }
    fn follows_rest(&mut self, from: &StepView<'_>, t_end: f64) -> bool {
        self.iter_mut().any(|observer| observer.follows_rest(from, t_end))
    }
    fn terminal(&self) -> Option<Terminal<'_>> {
        all_terminal(self.iter().map(Observer::terminal))
    }
}

/// An observer that is borrowed from its owner.
pub(crate) struct Borrowed<'o, O>(pub &'o mut O);

impl<O: Observer> Observer for Borrowed<'_, O> {
    fn needs(&self) -> OutputRequest {
        self.0.needs()
    }
    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.0.prepare(info)
    }
    fn next(&self, taken: usize) -> usize {
        self.0.next(taken)
    }
    fn sees_only_the_ends(&self) -> bool {
        self.0.sees_only_the_ends()
    }
    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.0.start(at)
    }
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.0.step(at)
    }
    fn follows_rest(&mut self, from: &StepView<'_>, t_end: f64) -> bool {
        self.0.follows_rest(from, t_end)
    }
    fn terminal(&self) -> Option<Terminal<'_>> {
        self.0.terminal()
    }
}

impl Observer for Box<dyn Observer + '_> {
    fn needs(&self) -> OutputRequest {
        (**self).needs()
    }
    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        (**self).prepare(info)
    }
    fn next(&self, taken: usize) -> usize {
        (**self).next(taken)
    }
    fn sees_only_the_ends(&self) -> bool {
        (**self).sees_only_the_ends()
    }
    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        (**self).start(at)
    }
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        (**self).step(at)
    }
    fn follows_rest(&mut self, from: &StepView<'_>, t_end: f64) -> bool {
        (**self).follows_rest(from, t_end)
    }
    fn terminal(&self) -> Option<Terminal<'_>> {
        (**self).terminal()
    }
}
