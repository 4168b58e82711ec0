//! Events: where functions of the state change sign along a run.

use super::{Course, LastStep, Moment, Motion, Observer, Stop, Terminal};
use crate::{InputError, StepError};
use contact_geom::PhasePoint;
use std::cell::RefCell;
use std::ops::ControlFlow;

/// A time is told to so many of its roundings, and a state to so many of its own: those of the sums of a step, of the iteration that
/// finds it, and of the search for a root.
const ROUNDINGS: f64 = 16.0 * f64::EPSILON;

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
    terminal: bool,
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
    fn borrowed(&self) -> Event<'_, N> {
        let function = |t: f64, x: &PhasePoint<N>| self.function.try_borrow_mut().map_or(f64::NAN, |mut f| f(t, x));
        Event { function: RefCell::new(Box::new(function)), direction: self.direction, terminal: self.terminal }
    }

    fn value(&mut self, t: f64, state: &PhasePoint<N>) -> f64 {
        self.function.get_mut()(t, state)
    }

    fn at(&mut self, t: f64, state: &PhasePoint<N>) -> Result<f64, StepError> {
        let value = self.value(t, state);
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
    /// Where it has the sign, if that is not at the point itself, which is on the surface.
    left: Option<Left>,
}

/// Where a function that begins on its surface has left it: the time, and its value there.
#[derive(Clone, Copy)]
struct Left {
    t: f64,
    value: f64,
}

/// The times of a run, as far as the nearness of a surface depends on them.
#[derive(Clone, Copy)]
struct Pace {
    /// About the length of a step, in the sense of the run.
    h: f64,
    /// What the rounding of times is measured by, beside the time itself.
    span: f64,
}

impl Pace {
    fn of(Course { t0, t_end, h, count }: &Course) -> Self {
        let span = t_end - t0;
        let h = h.unwrap_or(span / count.map_or(64.0, |count| count.max(1) as f64));
        // Of a long run a part, so that what counts as rounding stays far below a step.
        Pace { h, span: span.abs().min(4096.0 * h.abs()) }
    }

    /// The difference of times that is rounding.
    fn rounding(self, t: f64) -> f64 {
        ROUNDINGS * (t.abs() + self.span)
    }
}

/// The motion of a run with its times.
#[derive(Clone, Copy)]
struct Way<'r, const N: usize> {
    motion: &'r dyn Motion<N>,
    pace: Pace,
}

/// Finds events along a run, each to round-off of the time, by any integrator.
///
/// The motion between the ends of a step is looked at in a few parts, `s + 2` of a Gauss step of s stages and four of others: where the
/// function has different signs at two neighbours, or at the ends, the change is found on states as exact as those of the run, by steps of
/// the same integrator that end there. Of two changes of sign within one part neither is seen, so a function that changes faster than
/// the motion needs shorter steps; nor is a root that the function only touches. Where a function is not finite the run ends.
///
/// An event is a change of sign along the motion. It is counted once, and of two runs that join in exactly one:
/// - A run that starts on the surface, where the function is 0 up to rounding, starts on the side to which the motion goes, and does not
///   count that zero. So a run that starts from the state of a crossing goes on to the next one.
/// - A step that ends on the surface ends on the side to which the motion goes. Where that is another side than before, the event is
///   counted there, also at the end of the run.
/// - Up to rounding means: the motion is off the surface by at most the rounding of the time, or the state by that of its coordinates.
///   A function that stays 0 has no side until it is different from 0; if it does so from the start, its first sign is no change.
///
/// Events of one instant are told in the order of their index.
///
/// A terminal event ends the run with its own time and state; the other events of that instant are told too. Observers after
/// this one do not see a step that ends in such an event.
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
    pace: Pace,
}

impl<'f, const N: usize> Events<'f, N> {
    /// These events, which crossings name by their place.
    pub fn new(events: impl IntoIterator<Item = Event<'f, N>>) -> Self {
        let events = events.into_iter().collect();
        Events { crossings: Vec::new(), events, seen: Vec::new(), pace: Pace::of(&Course::NONE) }
    }

    /// The crossings in a step, in the order of the run, and why there are no more.
    fn in_step(&mut self, step: &mut LastStep<'_, N>, way: Way<'_, N>) -> (Vec<Crossing<N>>, Option<StepError>) {
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
            if let Err(error) = event.in_step(index, (step, way), &sketch, seen, &mut found) {
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
        // Those of one instant by their index.
        let mut rest = found.as_mut_slice();
        while let Some(first) = rest.first() {
            let (t, rounding) = (first.t, way.pace.rounding(first.t));
            let (together, later) = rest.split_at_mut(rest.partition_point(|c| (c.t - t).abs() <= rounding));
            together.sort_by_key(|crossing| crossing.event);
            rest = later;
        }
        (found, cause)
    }

    /// Whether a crossing is at the instant of an earlier one: by its time, or since it would be no event of a run that starts there.
    fn together(&mut self, first: &Crossing<N>, other: &Crossing<N>, way: Way<'_, N>) -> bool {
        let event = &mut self.events[other.event];
        (other.t - first.t).abs() <= way.pace.rounding(first.t)
            || event
                .at(first.t, &first.state)
                .is_ok_and(|value| event.leaves(way, (first.t, &first.state), value).is_some())
    }
}

impl<const N: usize> Event<'_, N> {
    /// Its changes of sign in a step of which there is a sketch.
    fn in_step(
        &mut self,
        index: usize,
        (step, way): (&LastStep<'_, N>, Way<'_, N>),
        sketch: &[PhasePoint<N>],
        seen: &mut LastSign<N>,
        found: &mut Vec<Crossing<N>>,
    ) -> Result<(), StepError> {
        let ((start, end), parts) = (step.ends(), sketch.len() + 1);
        let value = self.value(end.0, &end.1);
        let (mut quiet, mut size) = (value * seen.sign > 0.0, seen.value.abs());
        for (k, x) in (1..parts).zip(sketch) {
            // A sketch may leave the domain of the function where the motion does not.
            let there = self.value(step.time(k as f64 / parts as f64), x);
            quiet &= there * seen.sign > 0.0;
            size = size.max(there.abs());
        }
        // What is nearer to its surface than a hundredth of its size in the step may be on it.
        let left = if value.abs() < 0.01 * size { self.leaves(way, (end.0, &end.1), value) } else { None };
        if quiet && seen.zero.is_none() && left.is_none() {
            (seen.value, seen.left) = (value, None);
            return Ok(());
        }
        for k in 1..=parts {
            let tau = k as f64 / parts as f64;
            let (t, state) = if k == parts { end } else { (step.time(tau), step.at(step.time(tau))?) };
            let value = self.value(t, &state);
            let mut from = (k - 1) as f64 / parts as f64;
            if let Some(Left { t, value: there }) = seen.left {
                let fraction = (t - start.0) / (end.0 - start.0);
                if fraction >= tau {
                    // It is still on the surface.
                    continue;
                }
                (from, seen.value, seen.left) = (fraction, there, None);
            }
            if !value.is_finite() {
                found.extend(self.before_its_domain_ends(step, [from, tau], seen)?.map(|(t, state)| Crossing {
                    t,
                    event: index,
                    state,
                }));
                return Err(StepError::Event { t });
            }
            let side = if k == parts { left.map_or(value, |left| left.value) } else { value };
            if let Some((t, state)) = self.between(step, [from, tau], seen, [value, side], (t, &state))? {
                found.push(Crossing { t, event: index, state });
            }
        }
        seen.left = left;
        Ok(())
    }

    /// The change of sign that counts between the point last seen and one where the function is not defined, if there is one.
    fn before_its_domain_ends(
        &mut self,
        step: &LastStep<'_, N>,
        [mut from, mut to]: [f64; 2],
        seen: &mut LastSign<N>,
    ) -> Result<Option<(f64, PhasePoint<N>)>, StepError> {
        loop {
            let tau = 0.5 * (from + to);
            if tau <= from || tau >= to {
                return Ok(None);
            }
            let (t, state) = (step.time(tau), step.at(step.time(tau))?);
            let value = self.value(t, &state);
            if !value.is_finite() {
                to = tau;
                continue;
            }
            let changes = value * seen.sign < 0.0;
            let found = self.between(step, [from, tau], seen, [value, value], (t, &state))?;
            if changes {
                return Ok(found);
            }
            from = tau;
        }
    }

    /// The change of sign between the point last seen and the next one, where the function has a value and a side, if there is one that
    /// counts.
    fn between(
        &mut self,
        step: &LastStep<'_, N>,
        ends: [f64; 2],
        seen: &mut LastSign<N>,
        [value, side]: [f64; 2],
        (t, state): (f64, &PhasePoint<N>),
    ) -> Result<Option<(f64, PhasePoint<N>)>, StepError> {
        let before = std::mem::replace(&mut seen.value, value);
        if side == 0.0 {
            seen.zero = seen.zero.or(Some((t, *state)));
            return Ok(None);
        }
        let (old, zero) = (std::mem::replace(&mut seen.sign, side.signum()), seen.zero.take());
        if !self.counts(old, side) {
            return Ok(None);
        }
        if zero.is_some() {
            return Ok(zero);
        }
        // It is on the surface, and about to leave it.
        if value * before >= 0.0 {
            return Ok(Some((t, *state)));
        }
        let root = bracketed_root(ends, [before, value], |tau| self.at(step.time(tau), &step.at(step.time(tau))?))?;
        Ok(Some((step.time(root), step.at(step.time(root))?)))
    }

    /// Where the function leaves its surface after a point that is on it up to rounding; `None` where it is not on it, or does not leave it
    /// within half a step.
    ///
    /// With g its value, it is on the surface where `|g|` is at most what the motion changes it by in the rounding of the time, and
    /// the rounding of the state. It has left where it is beyond twice that, so that the sign is none of rounding.
    fn leaves(&mut self, Way { motion, pace }: Way<'_, N>, (t, state): (f64, &PhasePoint<N>), g: f64) -> Option<Left> {
        let (rounding, noise) = (pace.rounding(t), self.rounding(t, state, g));
        let shortest = (f64::powi(2.0, -20) * pace.h.abs()).max(64.0 * rounding);
        for ahead in (0..5).map(|k| shortest * f64::powi(16.0, k)).take_while(|ahead| *ahead <= 0.5 * pace.h.abs()) {
            let Some(left) = self.after(motion, (t, state), ahead.copysign(pace.h)) else { continue };
            let window = noise + (left.value - g).abs() * (rounding / ahead);
            let on = g.abs() <= window
                // It may jump.
                || g * left.value < 0.0
                    && self.after(motion, (t, state), rounding.copysign(pace.h)).is_some_and(|x| g * x.value < 0.0);
            if !on {
                return None;
            }
            if left.value.abs() > 2.0 * window {
                return Some(left);
            }
        }
        None
    }

    /// The function on the motion some time after a point, where both are defined.
    fn after(&mut self, motion: &dyn Motion<N>, (t, state): (f64, &PhasePoint<N>), ahead: f64) -> Option<Left> {
        let there = t + ahead;
        let (x, _) = motion.inside(&(t, *state), there).ok()?;
        let value = self.value(there, &x);
        value.is_finite().then_some(Left { t: there, value })
    }

    /// What the rounding of a state changes the function by, each of q, p and z by its own size. Where it is not defined aside, nothing.
    fn rounding(&mut self, t: f64, state: &PhasePoint<N>, g: f64) -> f64 {
        let [q, p, z] = [state.q.amax(), state.p.amax(), state.z.abs()].map(|size| ROUNDINGS * size);
        let mut change =
            |x: PhasePoint<N>| Some((self.value(t, &x) - g).abs()).filter(|d| d.is_finite()).unwrap_or(0.0);
        let mut sum = change(PhasePoint { z: state.z + z, ..*state });
        for i in 0..N {
            let mut aside = *state;
            aside.q[i] += q;
            sum += change(aside);
            aside = *state;
            aside.p[i] += p;
            sum += change(aside);
        }
        sum
    }
}

impl<const N: usize> Observer<N> for Events<'_, N> {
    fn prepare(&mut self, course: &Course) -> Result<(), InputError> {
        self.pace = Pace::of(course);
        self.seen.clear();
        self.crossings.clear();
        Ok(())
    }

    fn start(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        let way = Way { motion: at.motion, pace: self.pace };
        for event in &mut self.events {
            match event.at(at.t, &at.state) {
                Ok(value) => {
                    let left = event.leaves(way, (at.t, &at.state), value);
                    let side = left.map_or(value, |left| left.value);
                    let zero = (side == 0.0).then_some((at.t, at.state));
                    let sign = if side == 0.0 { 0.0 } else { side.signum() };
                    self.seen.push(LastSign { value, sign, zero, left });
                }
                Err(cause) => return ControlFlow::Break(Stop::failed(cause)),
            }
        }
        ControlFlow::Continue(())
    }

    fn step(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        let Some(mut step) = at.last_step() else { return ControlFlow::Continue(()) };
        let way = Way { motion: at.motion, pace: self.pace };
        let (found, cause) = self.in_step(&mut step, way);
        let mut end: Option<Crossing<N>> = None;
        for crossing in found {
            // The event that ends the run has no other crossing at its own instant.
            if end.is_some_and(|end| end.event == crossing.event || !self.together(&end, &crossing, way)) {
                continue;
            }
            self.crossings.push(crossing);
            if self.events[crossing.event].terminal {
                end = end.or(Some(crossing));
            }
        }
        if let Some(end) = end {
            return ControlFlow::Break(Stop { at: Some((end.t, end.state)), ..Stop::here("an event") });
        }
        match cause {
            Some(cause) => ControlFlow::Break(Stop::failed(cause)),
            None => ControlFlow::Continue(()),
        }
    }

    fn terminal(&self) -> Option<Terminal<'_, N>> {
        let events: Vec<_> = self.events.iter().filter(|event| event.terminal).map(Event::borrowed).collect();
        (!events.is_empty()).then(|| Box::new(Events::new(events)) as Terminal<'_, N>)
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
