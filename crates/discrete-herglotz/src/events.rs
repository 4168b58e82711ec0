//! Events: where functions of the state change sign along a run.

use crate::{DenseStep, GaussStepper, Halt, InputError, Stepper};
use contact_geom::{Lagrangian, PhasePoint};

/// Which changes of sign count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Either.
    #[default]
    Both,
}

/// `g(t, state)`.
type Function<'f, const N: usize> = dyn FnMut(f64, &PhasePoint<N>) -> f64 + 'f;

/// A function `g(t, state)` whose changes of sign are to be found: a section of Poincare, a collision, a turning point.
pub struct Event<'f, const N: usize> {
    function: Box<Function<'f, N>>,
    direction: Direction,
    terminal: bool,
}

impl<'f, const N: usize> Event<'f, N> {
    /// All changes of sign of a function, which do not end the run.
    pub fn new(function: impl FnMut(f64, &PhasePoint<N>) -> f64 + 'f) -> Self {
        Event { function: Box::new(function), direction: Direction::Both, terminal: false }
    }

    /// Only those in a direction.
    pub fn in_direction(self, direction: Direction) -> Self {
        Event { direction, ..self }
    }

    /// The first one ends the run.
    pub fn terminal(self) -> Self {
        Event { terminal: true, ..self }
    }
}

/// A change of sign that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing<const N: usize> {
    /// The time.
    pub t: f64,
    /// The index of the event.
    pub event: usize,
    /// The state there.
    pub state: PhasePoint<N>,
}

/// How a run with events ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventStatus {
    /// All steps were taken.
    Completed,
    /// A terminal event ended the run, at the last of its crossings.
    Terminated {
        /// The index of the event.
        event: usize,
    },
    /// The function of an event is not finite.
    Undefined {
        /// The index of the event.
        event: usize,
        /// The time at which its function was taken.
        t: f64,
    },
    /// A step could not be taken.
    Failed(Halt),
}

/// What a run with events found.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRun<const N: usize> {
    /// The changes of sign, in the order of time.
    pub crossings: Vec<Crossing<N>>,
    /// How it ended.
    pub status: EventStatus,
    /// The time of its end: that of the crossing where a terminal event ended it.
    pub t: f64,
    /// The state at its end.
    pub state: PhasePoint<N>,
}

/// The function of an event at the last point seen.
#[derive(Clone, Copy)]
struct Seen<const N: usize> {
    value: f64,
    /// The last sign that was not 0; 0 before there was one.
    sign: f64,
    /// Where the function has vanished since then.
    zero: Option<(f64, PhasePoint<N>)>,
}

/// Takes up to `steps` steps and finds the events on the way, each to round-off of the time.
///
/// A step is looked at in `s + 2` parts: of two changes of sign within one part neither is seen, so a function that changes
/// faster than the motion needs a shorter step. A function that vanishes at the start of the run has no sign there, and the
/// first that it takes is none of its changes. Where the curve of the run is meant, see [`DenseStep`]: states at events have
/// the order s of the curve.
///
/// A terminal event ends the run with its own time and state; the stepper stands at the end of the step that it is in.
///
/// ```
/// use contact_geom::{PhasePoint, systems::Pendulum};
/// use discrete_herglotz::{Event, Gauss, run_with_events};
/// let gauss = Gauss::new(Pendulum { gamma: -0.1 }, 8, 0.1)?;
/// let mut stepper = gauss.stepper(0.0, PhasePoint::new([1.0], [0.0], 0.0), [0.0].into())?;
/// let lowest = Event::new(|_, x: &PhasePoint<1>| x.q[0]);
/// let run = run_with_events(&mut stepper, 100, &mut [lowest])?;
/// println!("passes its lowest point at {:?}", run.crossings.iter().map(|c| c.t).collect::<Vec<_>>());
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
///
/// # Errors
/// [`InputError::Count`] if `steps` is 0. Bad luck in mid-run is an [`EventStatus`]: what was found before is kept.
pub fn run_with_events<L: Lagrangian<N>, const N: usize>(
    stepper: &mut GaussStepper<'_, L, N>,
    steps: usize,
    events: &mut [Event<'_, N>],
) -> Result<EventRun<N>, InputError> {
    if steps == 0 {
        return Err(InputError::Count { what: "the number of steps", least: 1, found: 0 });
    }
    let mut run =
        EventRun { crossings: Vec::new(), status: EventStatus::Completed, t: stepper.time(), state: stepper.state() };
    let mut seen = Vec::with_capacity(events.len());
    for (i, event) in events.iter_mut().enumerate() {
        match event.at(i, run.t, &run.state) {
            Ok(value) => {
                let zero = (value == 0.0).then_some((run.t, run.state));
                seen.push(Seen { value, sign: sign(value), zero });
            }
            Err(status) => return Ok(EventRun { status, ..run }),
        }
    }
    for taken in 0..steps {
        if let Err(Halt { cause, .. }) = stepper.advance(1) {
            return Ok(EventRun { status: EventStatus::Failed(Halt { taken, cause }), ..run });
        }
        // There is one after each step that was taken.
        let Some(curve) = stepper.dense() else { continue };
        let parts = curve.stages() + 2;
        let mut ended = None;
        for part in 0..parts {
            let ends = [part, part + 1].map(|k| k as f64 / parts as f64);
            let (t, state) = if part + 1 == parts {
                (stepper.time(), stepper.state())
            } else {
                (curve.time(ends[1]), curve.at_fraction(ends[1]))
            };
            let found = run.crossings.len();
            for (i, (event, seen)) in events.iter_mut().zip(&mut seen).enumerate() {
                match event.between(i, &curve, ends, seen, (t, &state)) {
                    Ok(crossing) => run.crossings.extend(crossing),
                    Err(status) => ended = Some(status),
                }
            }
            run.crossings[found..].sort_by(|a, b| a.t.total_cmp(&b.t));
            let terminal = run.crossings[found..].iter().position(|c| events[c.event].terminal);
            if let Some(last) = terminal.map(|k| found + k) {
                run.crossings.truncate(last + 1);
                let Crossing { t, event, state } = run.crossings[last];
                return Ok(EventRun { status: EventStatus::Terminated { event }, t, state, ..run });
            }
            if let Some(status) = ended {
                return Ok(EventRun { status, ..run });
            }
            (run.t, run.state) = (t, state);
        }
    }
    Ok(run)
}

/// The sign of a number, 0 for 0.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

impl<const N: usize> Event<'_, N> {
    fn at(&mut self, event: usize, t: f64, state: &PhasePoint<N>) -> Result<f64, EventStatus> {
        let value = (self.function)(t, state);
        if value.is_finite() { Ok(value) } else { Err(EventStatus::Undefined { event, t }) }
    }

    /// The change of sign between the point last seen and the next one, if there is one that counts.
    fn between(
        &mut self,
        event: usize,
        curve: &DenseStep<N>,
        ends: [f64; 2],
        seen: &mut Seen<N>,
        (t, state): (f64, &PhasePoint<N>),
    ) -> Result<Option<Crossing<N>>, EventStatus> {
        let value = self.at(event, t, state)?;
        let before = std::mem::replace(&mut seen.value, value);
        if value == 0.0 {
            seen.zero = seen.zero.or(Some((t, *state)));
            return Ok(None);
        }
        let (old, new, zero) = (seen.sign, sign(value), seen.zero.take());
        seen.sign = new;
        let counts = match self.direction {
            Direction::Both => true,
            Direction::Rising => new > 0.0,
            Direction::Falling => new < 0.0,
        };
        if old * new >= 0.0 || !counts {
            return Ok(None);
        }
        let (t, state) = match zero {
            Some(at) => at,
            None => {
                let root = bracketed_root(ends, [before, value], |tau| {
                    self.at(event, curve.time(tau), &curve.at_fraction(tau))
                })?;
                (curve.time(root), curve.at_fraction(root))
            }
        };
        Ok(Some(Crossing { t, event, state }))
    }
}

/// A root of a function of `[0, 1]` between two points with values of opposite signs, to round-off, by the ITP method of
/// Oliveira and Takahashi (ACM Transactions on Mathematical Software 47, 2021): the secant, truncated towards the middle and
/// projected so that it never takes more evaluations than bisection by more than one.
fn bracketed_root<E>(
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
