//! Runs: one way from a problem and an integrator to a motion.

mod accuracy;
#[cfg(test)]
mod accuracy_tests;
mod events;
mod explain;
mod halved;
mod integrator;
mod jump;
mod observer;
mod outcome;
mod pilot;
mod plan;
mod problem;
mod rows;
#[cfg(test)]
mod tests;

pub use events::{Crossing, Direction, Event, Events};
pub use explain::Item;
pub use integrator::{Integrator, UnknownIntegrator};
pub use observer::{Course, LastStep, Moment, Needs, Observer, Stop};
pub use outcome::Outcome;
pub use plan::Plan;
pub use problem::{Problem, Start};
pub(crate) use problem::{check_time, start_of};
pub use rows::{Row, Rows};

use crate::verified::verified_over;
use crate::{InputError, StepError};
use accuracy::Choice;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint};

/// The time step of a run. Steps go back in time where the run does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steps {
    /// Steps of this length, made a little shorter so that a whole number of them fills the span; of an integrator by a clock, steps
    /// of this length in the clock's time, the last one shorter.
    Size(f64),
    /// This many steps; not by a clock, which counts them itself.
    Count(usize),
    /// One length for the whole run, of time or of the time of the Lagrangian's clock, chosen by pilot runs so that the error of (q, p),
    /// relative to its size at the time or at the end, is at most this at every tenth of the span. The pilot runs cost a small multiple of
    /// the run; what is narrower than the distance of their nodes, about the step divided by four times the stages, may go unseen.
    Accuracy(f64),
}

/// Where a run ends, if no observer ends it before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// At this time, before or after that of the start.
    Time(f64),
    /// After so many steps forward, of the [size](Steps::Size) that is given.
    Steps(usize),
}

/// What is asked of a run, without its observers.
#[derive(Debug)]
struct Task<'p, L, const N: usize> {
    problem: &'p Problem<'p, L, N>,
    span: f64,
    integrator: Option<Integrator>,
    steps: Steps,
    needs: Needs,
}

impl<L, const N: usize> Clone for Task<'_, L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L, const N: usize> Copy for Task<'_, L, N> {}

/// A [`Problem`] with an integrator, steps and observers.
///
/// From these and the declared structure of the Lagrangian (probed: a false claim is an error) a [`Plan`] takes the cheapest route, and
/// says in words what will be computed and what not.
///
/// ```
/// use contact_geom::{VelocityPoint, systems::Pendulum};
/// use discrete_herglotz::{Integrator, Problem, Steps, Until};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0))?;
/// let run = problem.by(Integrator::Gauss { stages: 16 }).steps(Steps::Accuracy(1e-9)).without_action();
/// println!("{}", run.plan(Until::Time(1000.0))?);
/// let outcome = run.run(Until::Time(1000.0))?;
/// println!("{}: q = {} after {} steps", outcome.status, outcome.q[0], outcome.steps);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Run<'p, L, const N: usize> {
    problem: &'p Problem<'p, L, N>,
    integrator: Option<Integrator>,
    steps: Steps,
    needs: Needs,
    observers: Vec<&'p mut dyn Observer<N>>,
}

impl<'p, L: Lagrangian<N>, const N: usize> Run<'p, L, N> {
    fn of(problem: &'p Problem<'p, L, N>) -> Self {
        let needs = Needs { action: true, conformal_factor: false };
        Run { problem, integrator: None, steps: Steps::Accuracy(1e-9), needs, observers: Vec::new() }
    }

    /// The same by this integrator. Where none is named, it is contact Gauss collocation: with stages for the wanted accuracy, and by
    /// the clock that the Lagrangian states where that takes much fewer steps; or with eight stages where steps are given.
    pub fn by(self, integrator: Integrator) -> Self {
        Run { integrator: Some(integrator), ..self }
    }

    /// The same with other steps; at first they are for an accuracy of 1e-9.
    pub fn steps(self, steps: Steps) -> Self {
        Run { steps, ..self }
    }

    /// The same under the eyes of one more observer, which sees what those before it have seen.
    pub fn observe(mut self, observer: &'p mut dyn Observer<N>) -> Self {
        self.observers.push(observer);
        self
    }

    /// Without the action in the outcome: where z does not act back on the motion, and no observer asks for it, it is not computed.
    pub fn without_action(self) -> Self {
        Run { needs: Needs { action: false, ..self.needs }, ..self }
    }

    /// With the conformal factor of the motion in the outcome.
    pub fn with_conformal_factor(self) -> Self {
        Run { needs: Needs { conformal_factor: true, ..self.needs }, ..self }
    }

    /// Checks everything, chooses the step and the route.
    ///
    /// # Errors
    /// [`InputError`]: a span or step that is 0 or not finite, a false or a missing claim of structure, an integrator whose hypothesis
    /// the Lagrangian does not meet, an accuracy that it does not reach.
    pub fn plan(&self, until: Until) -> Result<Plan<'p, L, N>, InputError> {
        let needs = self.observers.iter().fold(self.needs, |needs, observer| needs.and(observer.needs()));
        let Run { problem, integrator, steps, .. } = *self;
        let (span, steps) = match (until, steps) {
            (Until::Time(t), steps) => (t - problem.t0, steps),
            (Until::Steps(0), _) => {
                return Err(InputError::Count { what: "the number of steps", least: 1, found: 0 });
            }
            (Until::Steps(count), Steps::Size(h)) => (count as f64 * h, Steps::Count(count)),
            (Until::Steps(_), _) => {
                return Err(InputError::Hypothesis {
                    hypothesis: "steps of a given size, to be ended after a number of them",
                });
            }
        };
        Task { problem, span, integrator, steps, needs }.plan()
    }

    /// Runs it.
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan), and of observers that cannot observe such a run. Bad luck in mid-run is the outcome's status.
    pub fn run(mut self, until: Until) -> Result<Outcome<N>, InputError> {
        self.plan(until)?.observed_by(&mut self.observers)
    }
}

impl<'p, L: Lagrangian<N>, const N: usize> Task<'p, L, N> {
    fn plan(self) -> Result<Plan<'p, L, N>, InputError> {
        let Task { problem, span, .. } = self;
        if !(span != 0.0 && span.is_finite()) {
            return Err(InputError::Span { span });
        }
        if let Some(integrator) = self.integrator {
            integrator.check(problem.lagrangian)?;
        }
        // Pilot runs look at the equations of motion along the whole span.
        let times = if matches!(self.steps, Steps::Accuracy(_)) { 4 } else { 16 };
        verified_over(problem.lagrangian, problem.t0, span, &problem.start, times)?;
        let given = |count: usize| {
            let h = span / count as f64;
            Choice { integrator: self.integrator.unwrap_or(DEFAULT), count, h, error: None }
        };
        let rate = self.clock_rate()?;
        let choice = match (self.steps, rate) {
            (Steps::Count(0), _) => {
                return Err(InputError::Count { what: "the number of steps", least: 1, found: 0 });
            }
            (Steps::Count(_), Some(_)) => return Err(InputError::Hypothesis { hypothesis: SIZED }),
            (Steps::Count(count), None) => given(count),
            (Steps::Size(h), _) if !(h > 0.0 && h.is_finite()) => return Err(InputError::Step { h }),
            // A step that fits the span up to rounding is not made shorter.
            (Steps::Size(h), _) => {
                let count = (span.abs() / (h * rate.unwrap_or(1.0)) * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0);
                check_count(count)?;
                let choice = given(count as usize);
                if rate.is_some() { Choice { h: h.copysign(span), ..choice } } else { choice }
            }
            (Steps::Accuracy(error), _) => accuracy::choose(self, error)?,
        };
        check_count(choice.count as f64)?;
        let plan = Plan::new(self, &choice)?;
        // Pilot runs have looked already.
        if plan.error().is_none() {
            plan.probe_first_steps()?;
        }
        Ok(plan)
    }

    /// The rate of the clock at the start, where an integrator by a clock is named.
    fn clock_rate(&self) -> Result<Option<f64>, InputError> {
        let Some(Integrator::Clocked { .. }) = self.integrator else { return Ok(None) };
        let rate = self.problem.lagrangian.clock_rate(&self.problem.start.q);
        if rate > 0.0 && rate.is_finite() { Ok(Some(rate)) } else { Err(InputError::Clock { rate }) }
    }

    /// The same for the final (q, p) alone.
    fn bare(self) -> Self {
        Task { needs: Needs::default(), ..self }
    }
}

/// A motion as observers ask it for what its states do not hold.
pub(crate) trait Motion<const N: usize> {
    /// The velocity at a state.
    fn velocity(&self, t: f64, state: &PhasePoint<N>) -> Result<SVector<f64, N>, StepError>;

    /// The energy there.
    fn energy(&self, t: f64, state: &PhasePoint<N>) -> Result<f64, StepError>;

    /// The rates `(qdot, pdot, zdot)` there.
    fn rates(&self, t: f64, state: &PhasePoint<N>) -> Result<PhasePoint<N>, StepError>;

    /// The state at a time of the step that starts at a time and a state.
    fn inside(&self, from: &(f64, PhasePoint<N>), t: f64) -> Result<PhasePoint<N>, StepError>;
}

/// A whole run from t = 0, for tests.
#[cfg(test)]
pub(crate) fn run_of<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    start: contact_geom::VelocityPoint<N>,
    span: f64,
    integrator: Option<Integrator>,
    steps: Steps,
) -> Result<Outcome<N>, InputError> {
    let problem = Problem::new(lagrangian, 0.0, start)?;
    Run { integrator, ..problem.steps(steps) }.run(Until::Time(span))
}

/// The integrator where none is named and steps are given.
const DEFAULT: Integrator = Integrator::Gauss { stages: 8 };

/// What an integrator by a clock needs.
const SIZED: &str =
    "steps of a given size in the time of its clock, or for a wanted accuracy, since it counts them itself";

/// The largest number of steps: `t0 + k h` then still tells times a thousandth of a step apart.
const MOST_STEPS: f64 = (1u64 << 42) as f64;

fn check_count(count: f64) -> Result<(), InputError> {
    if count <= MOST_STEPS {
        return Ok(());
    }
    let remedy = "take longer steps, or a shorter span";
    Err(InputError::TooMany { what: "the number of steps", found: count, most: MOST_STEPS, remedy })
}
