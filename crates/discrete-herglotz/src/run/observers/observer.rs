//! What looks at a run while it goes on.

use crate::InputError;
use crate::run::observers::output_request::{OutputRequest, RunInfo};
use crate::run::observers::step_view::{StepView, Stop};
use std::ops::ControlFlow;

/// What a run does with its states: it is shown the start, at least the steps that it asks for, and the last one.
///
/// Closures of [`StepView`] observe every step; pairs, triples and vectors of observers observe one after the other.
pub trait Observer<const N: usize> {
    /// What it asks of the run. By default the action.
    fn needs(&self) -> OutputRequest {
        OutputRequest::ACTION
    }

    /// Is told what the run will be, before work starts.
    ///
    /// # Errors
    /// An [`InputError`] where it cannot observe such a run.
    fn prepare(&mut self, _course: &RunInfo) -> Result<(), InputError> {
        Ok(())
    }

    /// The number of the step, counted from 1, at whose end it looks next after so many: those before it may be taken at once. By
    /// default the next one; `usize::MAX` for the last of the run alone.
    fn next(&self, taken: usize) -> usize {
        taken + 1
    }

    /// Sees the start, with no step before it.
    fn start(&mut self, _at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        ControlFlow::Continue(())
    }

    /// Sees the end of a step that it has asked for, or another observer, or of the last one; `Break` ends the run.
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>>;

    /// What ends trial runs where this one ends its run, and does nothing else; `None`, the default, where it ends none. What lies beyond is
    /// then no reason to refuse an accuracy.
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        None
    }
}

/// An observer that only ends runs: see [`Observer::terminal`].
pub type Terminal<'o, const N: usize> = Box<dyn Observer<N> + 'o>;

/// Those of several observers as one.
fn all_terminal<'o, const N: usize>(of: impl IntoIterator<Item = Option<Terminal<'o, N>>>) -> Option<Terminal<'o, N>> {
    let all: Vec<_> = of.into_iter().flatten().collect();
    (!all.is_empty()).then(|| Box::new(all) as Terminal<'o, N>)
}

impl<const N: usize, F: FnMut(&StepView<'_, N>) -> ControlFlow<Stop<N>>> Observer<N> for F {
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self(at)
    }
}

/// Several observers as one.
macro_rules! one_after_the_other {
    ($($name:ident $field:tt),+) => {
        impl<const N: usize, $($name: Observer<N>),+> Observer<N> for ($($name,)+) {
            fn needs(&self) -> OutputRequest {
                OutputRequest::default()$(.and(self.$field.needs()))+
            }
            fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
                $(self.$field.prepare(course)?;)+
                Ok(())
            }
            fn next(&self, taken: usize) -> usize {
                usize::MAX$(.min(self.$field.next(taken)))+
            }
            fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
                $(self.$field.start(at)?;)+
                ControlFlow::Continue(())
            }
            fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
                $(self.$field.step(at)?;)+
                ControlFlow::Continue(())
            }
            fn terminal(&self) -> Option<Terminal<'_, N>> {
                all_terminal([$(self.$field.terminal()),+])
            }
        }
    };
}

one_after_the_other!(A 0, B 1);
one_after_the_other!(A 0, B 1, C 2);

impl<const N: usize, O: Observer<N>> Observer<N> for Vec<O> {
    fn needs(&self) -> OutputRequest {
        self.iter().fold(OutputRequest::default(), |needs, observer| needs.and(observer.needs()))
    }
    fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
        self.iter_mut().try_for_each(|observer| observer.prepare(course))
    }
    fn next(&self, taken: usize) -> usize {
        self.iter().map(|observer| observer.next(taken)).min().unwrap_or(usize::MAX)
    }
    fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.iter_mut().try_for_each(|observer| observer.start(at))
    }
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.iter_mut().try_for_each(|observer| observer.step(at))
    }
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        all_terminal(self.iter().map(Observer::terminal))
    }
}

/// An observer that someone else keeps.
pub(crate) struct Borrowed<'o, O>(pub &'o mut O);

impl<const N: usize, O: Observer<N>> Observer<N> for Borrowed<'_, O> {
    fn needs(&self) -> OutputRequest {
        self.0.needs()
    }
    fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
        self.0.prepare(course)
    }
    fn next(&self, taken: usize) -> usize {
        self.0.next(taken)
    }
    fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.0.start(at)
    }
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.0.step(at)
    }
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        self.0.terminal()
    }
}

impl<const N: usize> Observer<N> for Box<dyn Observer<N> + '_> {
    fn needs(&self) -> OutputRequest {
        (**self).needs()
    }
    fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
        (**self).prepare(course)
    }
    fn next(&self, taken: usize) -> usize {
        (**self).next(taken)
    }
    fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        (**self).start(at)
    }
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        (**self).step(at)
    }
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        (**self).terminal()
    }
}
