//! Events: sign changes of functions of the state along a run.

use crate::integration::PieceStart;
use crate::run::observers::crossings::{LastSign, ScaledMotion, TimeScales};
use crate::run::observers::event::{Crossing, Event};
use crate::run::{LastStep, Observer, OutputRequest, RunInfo, StepView, Stop, Terminal};
use crate::solve::sign_changes::Separator;
use crate::{InputError, State, StepError};
use std::ops::ControlFlow;

/// The number of times at which a function is evaluated at the state of a motion at rest: if all values are the same, it
/// depends on the state alone, and has no sign change after that.
const TIMES_AT_REST: usize = 1024;

/// Locates events along a run, each to the round-off of the time, for any integrator.
///
/// All sign changes within a step are found. The functions are evaluated on an interpolant of the motion, at the
/// Chebyshev-Lobatto nodes of the step: `s + 3` nodes, from 5 to 17, for a Gauss step with s stages, 5 for other
/// methods. The Chebyshev coefficients of a function usually prove that it has no zero in the step. Otherwise the step
/// is divided until the sign changes are separated. Each is located on states as accurate as those of the run, see
/// [`LastStep::at`]: where they are computed by steps of the integrator, two such steps are enough if the step resolves
/// the motion.
///
/// The function should be smooth along the motion; kinks and jumps are found by bisection. If it varies so fast that
/// the sign changes within a step cannot be told apart, the run ends with [`StepError::EventUnresolved`]. What no
/// evaluation shows is missed: a pulse that is much narrower than the distance of the nodes. A zero without a sign
/// change is missed too. A function value that is not finite ends the run.
///
/// After the motion has come to rest, only functions that depend on time have events. Those whose values at 1024 times are
/// the same there are taken to depend on the state alone.
///
/// An event is a sign change along the motion. It is counted once, and if a run continues another one, in exactly one
/// of the two:
/// - If a run starts on the surface, where the function is 0 up to round-off, the sign at the start is that of the side
///   that the motion enters next, and this zero is not counted. So a run that starts from the state of a crossing
///   continues to the next one.
/// - At the end of a step on the surface, the side is the one that the motion enters next. If it is a new side, the
///   event is counted, also at the end of the run.
/// - "On the surface" means: within the rounding errors of the time and of the coordinates of the state. A function that stays 0 has no sign until it
///   becomes nonzero; if it is 0 from the start, its first sign is not a sign change.
///
/// Simultaneous events are recorded in the order of their index.
///
/// A terminal event ends the run at its time and state; other events at that time are recorded too. Observers after
/// this one do not see the step in which the event lies.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Event, Events, GaussCollocation, Problem, Steps, Until};
/// let pendulum = Pendulum { gamma: -0.1 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let mut lowest = Events::new([Event::new(|_, x| x.q[0])]);
/// problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.1)).observe(&mut lowest).run(Until::Time(10.0))?;
/// println!("passes its lowest point at {:?}", lowest.crossings.iter().map(|c| c.t).collect::<Vec<_>>());
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Events<'f> {
    /// The sign changes so far, in the order of the run.
    pub crossings: Vec<Crossing>,
    events: Vec<Event<'f>>,
    needs: OutputRequest,
    last_signs: Vec<LastSign>,
    scales: TimeScales,
    /// Interpolated states within the last step.
    interpolated: Vec<State>,
    /// Points that separate the sign changes of a function.
    points: Vec<Separator>,
    /// The time at the end of the last step, and the time derivatives of the state there if they were computed: they
    /// are those at the start of the next step.
    rates: Option<(f64, State)>,
}

impl<'f> Events<'f> {
    /// An observer of these events; crossings refer to them by their index.
    pub fn new(events: impl IntoIterator<Item = Event<'f>>) -> Self {
        let events = events.into_iter().collect();
        let (crossings, last_signs, interpolated, points) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Events {
            crossings,
            events,
            needs: OutputRequest::ACTION,
            last_signs,
            scales: TimeScales::of(&RunInfo::NONE),
            interpolated,
            points,
            rates: None,
        }
    }

    /// For functions that do not depend on the action: it is not computed unless it is requested elsewhere.
    pub fn without_action(self) -> Self {
        Events { needs: OutputRequest { action: false, ..self.needs }, ..self }
    }

    /// The crossings in a step, in the order of the run, and the error that ended the search, if there was one.
    fn in_step(&mut self, step: &mut LastStep<'_>, motion: ScaledMotion<'_>) -> (Vec<Crossing>, Option<StepError>) {
        let (mut found, mut cause) = (Vec::new(), None);
        if let Err(cause) = step.interpolated_states(&mut self.interpolated) {
            return (found, Some(cause));
        }
        let backward = step.span().1 < step.span().0;
        let before = |a: f64, b: f64| if backward { a > b } else { a < b };
        for (index, (event, last_sign)) in self.events.iter_mut().zip(&mut self.last_signs).enumerate() {
            let workspace = (self.interpolated.as_slice(), &mut self.points);
            if let Err(error) = event.in_step(index, (step, motion), workspace, last_sign, &mut found) {
                cause = match (cause.and_then(time_of), time_of(error)) {
                    (Some(first), Some(t)) if !before(t, first) => cause,
                    _ => Some(error),
                };
            }
        }
        if let Some(t) = cause.and_then(time_of) {
            // Only the crossings before the time at which a function is not defined or not resolved.
            found.retain(|crossing| !before(t, crossing.t));
        }
        found.sort_by(|a, b| if backward { b.t.total_cmp(&a.t) } else { a.t.total_cmp(&b.t) });
        // Simultaneous crossings are ordered by their index.
        let mut rest = found.as_mut_slice();
        while let Some(first) = rest.first() {
            let (t, rounding) = (first.t, motion.scales.rounding(first.t));
            let (together, later) = rest.split_at_mut(rest.partition_point(|c| (c.t - t).abs() <= rounding));
            together.sort_by_key(|crossing| crossing.event);
            rest = later;
        }
        (found, cause)
    }

    /// Whether a crossing is simultaneous with an earlier one: its time is the same up to round-off, or a run that
    /// starts at the earlier crossing would not count it.
    fn together(&mut self, first: &Crossing, other: &Crossing, motion: ScaledMotion<'_>) -> bool {
        let event = &mut self.events[other.event];
        (other.t - first.t).abs() <= motion.scales.rounding(first.t)
            || event
                .at(first.t, &first.state)
                .is_ok_and(|value| event.departure_from(motion, &(first.t, first.state.clone()), value).is_some())
    }

    /// Takes the signs at the start of the run, or after a reset.
    fn start_at(&mut self, at: &StepView<'_>, start: &(f64, State)) -> ControlFlow<Stop> {
        self.last_signs.clear();
        self.rates = None;
        let near = at.stepper.last_velocity();
        let motion = ScaledMotion { motion: at.motion, scales: self.scales, near: near.as_ref() };
        for event in &mut self.events {
            match event.at(start.0, &start.1) {
                Ok(value) => {
                    let departure = event.departure_from(motion, start, value);
                    let side = departure.map_or(value, |departure| departure.value);
                    let zero = (side == 0.0).then(|| start.clone());
                    let sign = if side == 0.0 { 0.0 } else { side.signum() };
                    self.last_signs.push(LastSign { value, sign, zero, departure });
                }
                Err(cause) => return ControlFlow::Break(Stop::failed(cause)),
            }
        }
        ControlFlow::Continue(())
    }

    /// Finds the sign changes where the momentum jumps, by which an event may pass its surface.
    fn jump(&mut self, to: &(f64, State)) -> ControlFlow<Stop> {
        self.rates = None;
        let mut found = Vec::new();
        for (index, (event, last_sign)) in self.events.iter_mut().zip(&mut self.last_signs).enumerate() {
            match event.at(to.0, &to.1) {
                Ok(value) => found.extend(event.at_jump(index, last_sign, value, to)),
                Err(cause) => return ControlFlow::Break(Stop::failed(cause)),
            }
        }
        let ends = found.iter().any(|crossing| self.events[crossing.event].terminal);
        self.crossings.extend(found);
        if ends {
            return ControlFlow::Break(Stop { at: Some(to.clone()), ..Stop::here("an event") });
        }
        ControlFlow::Continue(())
    }

    /// Finds the sign changes in a step, or in a piece of one.
    fn piece(&mut self, at: &StepView<'_>, step: &mut LastStep<'_>) -> ControlFlow<Stop> {
        let from = step.span().0;
        step.set_rates_at_start(self.rates.take().filter(|(t, _)| *t == from).map(|(_, rates)| rates));
        let near = at.stepper.last_velocity();
        let motion = ScaledMotion { motion: at.motion, scales: self.scales, near: near.as_ref() };
        let (found, cause) = self.in_step(step, motion);
        let to = step.span().1;
        self.rates = step.take_rates_at_end().map(|rates| (to, rates));
        let mut end: Option<Crossing> = None;
        for crossing in found {
            // An event has only one crossing at the time at which it ends the run.
            if let Some(end) = &end
                && (end.event == crossing.event || !self.together(end, &crossing, motion))
            {
                continue;
            }
            if end.is_none() && self.events[crossing.event].terminal {
                end = Some(crossing.clone());
            }
            self.crossings.push(crossing);
        }
        if let Some(end) = end {
            return ControlFlow::Break(Stop { at: Some((end.t, end.state)), ..Stop::here("an event") });
        }
        match cause {
            Some(cause) => ControlFlow::Break(Stop::failed(cause)),
            None => ControlFlow::Continue(()),
        }
    }
}

/// The time of an error of an event.
fn time_of(error: StepError) -> Option<f64> {
    match error {
        StepError::Event { t } | StepError::EventUnresolved { t } => Some(t),
        _ => None,
    }
}

impl Observer for Events<'_> {
    fn needs(&self) -> OutputRequest {
        self.needs
    }

    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.scales = TimeScales::of(info);
        self.last_signs.clear();
        self.crossings.clear();
        self.rates = None;
        Ok(())
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.start_at(at, &(at.t, at.state.clone()))
    }

    fn follows_rest(&mut self, from: &StepView<'_>, t_end: f64) -> bool {
        let time = |k: usize| from.t + (t_end - from.t) * (k as f64 / TIMES_AT_REST as f64);
        self.events.iter_mut().any(|event| {
            let value = event.value(from.t, &from.state);
            (1..=TIMES_AT_REST).any(|k| event.value(time(k), &from.state) != value)
        })
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if let (Some(rest), Some((from, state))) = (at.at_rest, &at.before) {
            // What depends on time may change as fast as the motion did.
            return rest.steps(*from, at.t).try_for_each(|ends| {
                let ends = ends.map(|t| (t, state.clone()));
                self.piece(at, &mut LastStep::new(ends, at.motion, at.stepper))
            });
        }
        let Some(mut step) = at.last_step() else { return ControlFlow::Continue(()) };
        if at.stepper.pieces().is_empty() {
            return self.piece(at, &mut step);
        }
        for (start, mut piece) in step.pieces() {
            let (from, to) = piece.ends();
            match start {
                PieceStart::Regular | PieceStart::Zero => {}
                PieceStart::Jump => self.jump(from)?,
                PieceStart::Reset => self.start_at(at, from)?,
            }
            if from.0 != to.0 {
                self.piece(at, &mut piece)?;
            }
        }
        ControlFlow::Continue(())
    }

    fn terminal(&self) -> Option<Terminal<'_>> {
        let events: Vec<_> = self.events.iter().filter(|event| event.terminal).map(Event::borrowed).collect();
        (!events.is_empty()).then(|| Box::new(Events { needs: self.needs, ..Events::new(events) }) as Terminal<'_>)
    }
}
