//! An event: a function of the state whose changes of sign are to be found.

use crate::StepError;
use contact_geom::PhasePoint;
use std::cell::RefCell;

/// Which changes of sign count, in the sense of the run.
#[derive(Clone, Copy)]
enum Direction {
    Rising,
    Falling,
    Both,
}

/// `g(t, state)`.
type Function<'f, const N: usize> = Box<dyn FnMut(f64, &PhasePoint<N>) -> f64 + 'f>;

/// A function `g(t, state)` whose changes of sign are to be found: a section of Poincare, a collision, a turning point.
pub struct Event<'f, const N: usize> {
    /// Trial runs call it as well.
    function: RefCell<Function<'f, N>>,
    direction: Direction,
    pub(crate) terminal: bool,
}

impl<'f, const N: usize> Event<'f, N> {
    /// All changes of sign of a function, which do not end the run.
    pub fn new(function: impl FnMut(f64, &PhasePoint<N>) -> f64 + 'f) -> Self {
        Event { function: RefCell::new(Box::new(function)), direction: Direction::Both, terminal: false }
    }

    /// Those from negative to positive alone, in the sense of the run.
    pub fn rising(self) -> Self {
        Event { direction: Direction::Rising, ..self }
    }

    /// Those from positive to negative alone.
    pub fn falling(self) -> Self {
        Event { direction: Direction::Falling, ..self }
    }

    /// The first one ends the run.
    pub fn terminal(self) -> Self {
        Event { terminal: true, ..self }
    }

    /// The same for a trial run.
    pub(crate) fn borrowed(&self) -> Event<'_, N> {
        let function = |t: f64, x: &PhasePoint<N>| self.function.try_borrow_mut().map_or(f64::NAN, |mut f| f(t, x));
        Event { function: RefCell::new(Box::new(function)), direction: self.direction, terminal: self.terminal }
    }

    pub(crate) fn value(&mut self, t: f64, state: &PhasePoint<N>) -> f64 {
        self.function.get_mut()(t, state)
    }

    pub(crate) fn at(&mut self, t: f64, state: &PhasePoint<N>) -> Result<f64, StepError> {
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

/// A change of sign that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing<const N: usize> {
    /// The time.
    pub t: f64,
    /// The index of the event.
    pub event: usize,
    /// The state there, from which another run can start.
    pub state: PhasePoint<N>,
}
