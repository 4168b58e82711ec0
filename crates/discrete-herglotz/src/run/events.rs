//! Events: where functions of the state change sign along a run.

use super::{Course, LastStep, Moment, Observer, Stop};
use crate::{InputError, StepError};
use contact_geom::PhasePoint;
use std::ops::ControlFlow;

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
    function: Function<'f, N>,
    direction: Direction,
    terminal: bool,
}

impl<'f, const N: usize> Event<'f, N> {
    /// All changes of sign of a function, which do not end the run.
    pub fn new(function: impl FnMut(f64, &PhasePoint<N>) -> f64 + 'f) -> Self {
        Event { function: Box::new(function), direction: Direction::Both, terminal: false }
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

    fn at(&mut self, t: f64, state: &PhasePoint<N>) -> Result<f64, StepError> {
        let value = (self.function)(t, state);
        if value.is_finite() { Ok(value) } else { Err(StepError::Event { t }) }
    }

    fn counts(&self, from: f64, to: f64) -> bool {
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

/// The function of an event at the last point seen.
#[derive(Clone, Copy)]
struct LastSign<const N: usize> {
    value: f64,
    /// The last sign that was not 0; 0 before there was one.
    sign: f64,
    /// Where the function has vanished since then.
    zero: Option<(f64, PhasePoint<N>)>,
}

/// Finds events along a run, each to round-off of the time, by any integrator.
///
/// The motion between the ends of a step is looked at in a few parts, `s + 2` of a Gauss step of s stages and four of others: where the
/// function has different signs at two neighbours, or at the ends, the change is found on states as exact as those of the run, by steps of
/// the same integrator that end there. Of two changes of sign within one part neither is seen, so a function that changes faster than
/// the motion needs shorter steps; nor is a root that the function only touches. A function that vanishes at the start of the run has
/// no sign there, and the first that it takes is none of its changes; one that vanishes at the very end has not changed its sign. Where a function is not finite the run ends.
///
/// A terminal event ends the run with its own time and state. Observers after this one do not see a step that ends in such an event.
///
/// ```
/// use contact_geom::{VelocityPoint, systems::Pendulum};
/// use discrete_herglotz::{Event, Events, GaussCollocation, Problem, Steps, Until};
/// let pendulum = Pendulum { gamma: -0.1 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let mut lowest = Events::new([Event::new(|_, x| x.q[0])]);
/// problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.1)).observe(&mut lowest).run(Until::Time(10.0))?;
/// println!("passes its lowest point at {:?}", lowest.crossings.iter().map(|c| c.t).collect::<Vec<_>>());
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Events<'f, const N: usize> {
    /// The changes of sign so far, in the order of the run.
    pub crossings: Vec<Crossing<N>>,
    events: Vec<Event<'f, N>>,
    seen: Vec<LastSign<N>>,
}

impl<'f, const N: usize> Events<'f, N> {
    /// These events, which crossings name by their place.
    pub fn new(events: impl IntoIterator<Item = Event<'f, N>>) -> Self {
        Events { crossings: Vec::new(), events: events.into_iter().collect(), seen: Vec::new() }
    }

    /// The crossings in a step, in the order of the run, and why there are no more.
    fn in_step(&mut self, step: &mut LastStep<'_, N>) -> (Vec<Crossing<N>>, Option<StepError>) {
        let (mut found, mut cause) = (Vec::new(), None);
        let parts = step.parts();
        let sketch: Result<Vec<_>, _> = (1..parts).map(|k| step.about(k as f64 / parts as f64)).collect();
        let sketch = match sketch {
            Ok(sketch) => sketch,
            Err(cause) => return (found, Some(cause)),
        };
        let backward = step.span().1 < step.span().0;
        let before = |a: f64, b: f64| if backward { a > b } else { a < b };
        for (index, (event, seen)) in self.events.iter_mut().zip(&mut self.seen).enumerate() {
            if let Err(error) = event.in_step(index, step, &sketch, seen, &mut found) {
                cause = match (cause, error) {
                    (Some(StepError::Event { t: first }), StepError::Event { t }) if !before(t, first) => cause,
                    _ => Some(error),
                };
            }
        }
        if let Some(StepError::Event { t }) = cause {
            // What lies before the place where a function is not defined.
            found.retain(|crossing| !before(t, crossing.t));
        }
        found.sort_by(|a, b| if backward { b.t.total_cmp(&a.t) } else { a.t.total_cmp(&b.t) });
        (found, cause)
    }
}

impl<const N: usize> Event<'_, N> {
    /// Its changes of sign in a step of which there is a sketch.
    fn in_step(
        &mut self,
        index: usize,
        step: &LastStep<'_, N>,
        sketch: &[PhasePoint<N>],
        seen: &mut LastSign<N>,
        found: &mut Vec<Crossing<N>>,
    ) -> Result<(), StepError> {
        let ((_, end), parts) = (step.ends(), sketch.len() + 1);
        let value = self.at(end.0, &end.1)?;
        let times = (1..parts).map(|k| step.time(k as f64 / parts as f64));
        let same = |value: f64| value * seen.sign > 0.0;
        // A sketch may leave the domain of the function where the motion does not.
        let quiet = same(value) && times.zip(sketch).all(|(t, x)| same((self.function)(t, x)));
        if quiet && seen.zero.is_none() {
            seen.value = value;
            return Ok(());
        }
        for k in 1..=parts {
            let tau = k as f64 / parts as f64;
            let (t, state) = if k == parts { end } else { (step.time(tau), step.at(step.time(tau))?) };
            let value = self.at(t, &state)?;
            let from = (k - 1) as f64 / parts as f64;
            if let Some((t, state)) = self.between(step, [from, tau], seen, value, (t, &state))? {
                found.push(Crossing { t, event: index, state });
            }
        }
        Ok(())
    }

    /// The change of sign between the point last seen and the next one, if there is one that counts.
    fn between(
        &mut self,
        step: &LastStep<'_, N>,
        ends: [f64; 2],
        seen: &mut LastSign<N>,
        value: f64,
        (t, state): (f64, &PhasePoint<N>),
    ) -> Result<Option<(f64, PhasePoint<N>)>, StepError> {
        let before = std::mem::replace(&mut seen.value, value);
        if value == 0.0 {
            seen.zero = seen.zero.or(Some((t, *state)));
            return Ok(None);
        }
        let (old, zero) = (std::mem::replace(&mut seen.sign, value.signum()), seen.zero.take());
        if !self.counts(old, value) {
            return Ok(None);
        }
        if zero.is_some() {
            return Ok(zero);
        }
        let root = bracketed_root(ends, [before, value], |tau| self.at(step.time(tau), &step.at(step.time(tau))?))?;
        Ok(Some((step.time(root), step.at(step.time(root))?)))
    }
}

impl<const N: usize> Observer<N> for Events<'_, N> {
    fn prepare(&mut self, _course: &Course) -> Result<(), InputError> {
        self.seen.clear();
        self.crossings.clear();
        Ok(())
    }

    fn start(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        for event in &mut self.events {
            match event.at(at.t, &at.state) {
                Ok(value) => {
                    let zero = (value == 0.0).then_some((at.t, at.state));
                    let sign = if value == 0.0 { 0.0 } else { value.signum() };
                    self.seen.push(LastSign { value, sign, zero });
                }
                Err(cause) => return ControlFlow::Break(Stop::failed(cause)),
            }
        }
        ControlFlow::Continue(())
    }

    fn step(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        let Some(mut step) = at.last_step() else { return ControlFlow::Continue(()) };
        let (found, cause) = self.in_step(&mut step);
        for crossing in found {
            self.crossings.push(crossing);
            if self.events[crossing.event].terminal {
                return ControlFlow::Break(Stop { at: Some((crossing.t, crossing.state)), ..Stop::here("an event") });
            }
        }
        match cause {
            Some(cause) => ControlFlow::Break(Stop::failed(cause)),
            None => ControlFlow::Continue(()),
        }
    }
}

/// A root of a function of `[0, 1]` between two points with values of opposite signs, to round-off, by the ITP method of
/// Oliveira and Takahashi (ACM Transactions on Mathematical Software 47, 2021): the secant, truncated towards the middle and
/// projected so that it never takes more evaluations than bisection by more than one.
pub(crate) fn bracketed_root<E>(
    [mut a, mut b]: [f64; 2],
    [mut below, mut above]: [f64; 2],
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    // The spacing of the numbers below 1.
    let half_width = 0.5 * f64::EPSILON;
    let rising = (above - below).signum();
    let bisections = ((b - a) / (2.0 * half_width)).log2().ceil() as i32;
    let truncation = 0.2 / (b - a);
    for j in 0..=bisections + 1 {
        if b - a <= 2.0 * half_width {
            break;
        }
        let middle = 0.5 * (a + b);
        let radius = (half_width * f64::powi(2.0, bisections + 1 - j) - 0.5 * (b - a)).max(0.0);
        let secant = (above * a - below * b) / (above - below);
        let aside = (middle - secant).signum();
        let shift = truncation * (b - a).powi(2);
        let truncated = if shift <= (middle - secant).abs() { secant + aside * shift } else { middle };
        let x = if (truncated - middle).abs() <= radius { truncated } else { middle - aside * radius };
        let value = f(x)?;
        if value == 0.0 {
            return Ok(x);
        }
        if value * rising > 0.0 {
            (b, above) = (x, value);
        } else {
            (a, below) = (x, value);
        }
    }
    Ok(0.5 * (a + b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// A simple root, a triple one and a jump: each to the spacing of the numbers below 1, in no more evaluations than
    /// bisection and one; the simple one in far fewer.
    #[test]
    fn roots_are_found_to_round_off() {
        let root = |f: &dyn Fn(f64) -> f64| {
            let mut count = 0;
            let found = bracketed_root([0.0, 1.0], [f(0.0), f(1.0)], |x| {
                count += 1;
                Ok::<_, Infallible>(f(x))
            });
            (found.unwrap_or(f64::NAN), count)
        };
        let near = |x: f64, expected: f64| (x - expected).abs() <= f64::EPSILON;
        let (x, count) = root(&|x| x.exp() - 1.5);
        assert!(near(x, 1.5f64.ln()) && count <= 15, "{x}, {count}");
        // `(x - r)^3` vanishes to round-off of x only.
        let (x, count) = root(&|x| (x - 0.3).powi(3));
        assert!(near(x, 0.3) && count <= 54, "{x}, {count}");
        let (x, count) = root(&|x| if x < 0.7 { -1e300 } else { 1e-300 });
        assert!(near(x, 0.7) && count <= 54, "{x}, {count}");
    }
}
