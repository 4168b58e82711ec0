//! An event: a function of the state whose sign changes are located.

use crate::{State, StepError};
use std::cell::RefCell;

/// The sign changes that count, in the direction of the run.
#[derive(Clone, Copy)]
enum Direction {
    Rising,
    Falling,
    Both,
}

/// `g(t, state)`.
type Function<'f> = Box<dyn FnMut(f64, &State) -> f64 + 'f>;

/// A function `g(t, state)` whose sign changes are located: a Poincare section, a collision, a turning point.
pub struct Event<'f> {
    /// In a cell, since trial runs call it too.
    function: RefCell<Function<'f>>,
    direction: Direction,
    pub(crate) terminal: bool,
}

impl<'f> Event<'f> {
    /// All sign changes of a function; they do not end the run.
    pub fn new(function: impl FnMut(f64, &State) -> f64 + 'f) -> Self {
        Event { function: RefCell::new(Box::new(function)), direction: Direction::Both, terminal: false }
    }

    /// Restricts the event to sign changes from negative to positive, in the direction of the run.
    pub fn rising(self) -> Self {
        Event { direction: Direction::Rising, ..self }
    }

    /// Restricts the event to sign changes from positive to negative, in the direction of the run.
    pub fn falling(self) -> Self {
        Event { direction: Direction::Falling, ..self }
    }

    /// The first sign change ends the run.
    pub fn terminal(self) -> Self {
        Event { terminal: true, ..self }
    }

    /// The same event for a trial run.
    pub(crate) fn borrowed(&self) -> Event<'_> {
        let function = |t: f64, x: &State| self.function.try_borrow_mut().map_or(f64::NAN, |mut f| f(t, x));
        Event { function: RefCell::new(Box::new(function)), direction: self.direction, terminal: self.terminal }
    }

    pub(crate) fn value(&mut self, t: f64, state: &State) -> f64 {
        self.function.get_mut()(t, state)
    }

    pub(crate) fn at(&mut self, t: f64, state: &State) -> Result<f64, StepError> {
        let value = self.value(t, state);
        if value.is_finite() { Ok(value) } else { Err(StepError::Event { t }) }
    }

    pub(crate) fn counts(&self, from: f64, to: f64) -> bool {
        from * to < 0.0
            && match self.direction {
                Direction::Both => true,
                Direction::Rising => to > 0.0,
                Direction::Falling => to < 0.0,
            }
    }
}

/// A sign change that was located.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// The time.
    pub t: f64,
    /// The index of the event.
    pub event: usize,
    /// The state there, from which another run can start.
    pub state: State,
}
