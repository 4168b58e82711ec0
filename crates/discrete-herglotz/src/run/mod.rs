//! Runs: one way from a problem and an integrator to a motion.

mod accuracy;
mod any_integrator;
mod checks;
mod explain;
mod observers;
mod outcome;
mod plan;

pub use any_integrator::{AnyIntegrator, UnknownIntegrator};
pub(crate) use checks::energy::may_drift;
pub use checks::energy::{EnergyDrift, EnergyLook};
pub(crate) use observers::checkpoint::digest;
pub use observers::checkpoint::{Checkpoint, CheckpointError, ResumeState};
#[cfg(feature = "csv")]
pub use observers::csv_rows::CsvRows;
pub use observers::events::{Crossing, Event, Events};
pub(crate) use observers::interruption::Interruption;
pub use observers::momentum::{MomentumDecay, MomentumRow};
pub use observers::observer::{LastStep, Observer, OutputRequest, RunInfo, StepView, Stop, Terminal};
pub use observers::progress::Progress;
pub use observers::quotient::Quotient;
pub(crate) use observers::rows;
pub use observers::rows::{Row, Rows};
pub use outcome::Outcome;
pub use plan::Plan;

use crate::integration::check_claims::check_claims_over;
use crate::{DenseStep, GaussCollocation, InputError, Integrator, Problem, StepError};
use accuracy::StepSelection;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, max_or_nan};
use std::sync::Arc;

/// The time steps of a run. They go back in time where the run does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steps {
    /// Steps of this length, made a little shorter so that a whole number of them fills the span; of an integrator in transformed time, steps
    /// of this length in the transformed time, the last one shorter.
    Size(f64),
    /// This many steps; not in transformed time, which counts them itself.
    Count(usize),
}

/// Where a run ends, if no observer ends it before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// At this time, before or after that of the start, or there: then the start is all that is seen.
    Time(f64),
    /// After this time, negative to go back.
    After(f64),
    /// After so many steps of the [size](Steps::Size) that is given; a negative size goes back.
    Steps(usize),
}

/// An integrator for as long as the Lagrangian lives.
type Shared<'p, L, const N: usize> = Arc<dyn Integrator<'p, L, N> + 'p>;

/// How a step is chosen for an accuracy: in a program that asks for none it is not compiled.
type ChooseSteps<'p, L, const N: usize> =
    for<'e> fn(&Request<'p, L, N>, f64, Option<Terminal<'e, N>>) -> Result<StepSelection<'p, L, N>, InputError>;

/// How long the steps of a run are to be.
enum StepControl<'p, L, const N: usize> {
    Given(Steps),
    /// So many steps of this length exactly.
    Exactly(usize, f64),
    For(f64, ChooseSteps<'p, L, N>),
}

impl<L, const N: usize> Clone for StepControl<'_, L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L, const N: usize> Copy for StepControl<'_, L, N> {}

/// What is asked of a run, without its observers.
pub(crate) struct Request<'p, L, const N: usize> {
    problem: &'p Problem<'p, L, N>,
    t_end: f64,
    span: f64,
    integrator: Option<Shared<'p, L, N>>,
    needs: OutputRequest,
    /// What the errors of the coordinates are measured by, where that is given.
    scales: Option<SVector<f64, N>>,
}

/// A [`Problem`] with an integrator, steps and observers.
///
/// From these and the declared structure of the Lagrangian (probed: a false claim is an error) a [`Plan`] takes the cheapest route, and
/// says in words what will be computed and what not.
///
/// ```
/// use contact_geom::{VelocityPoint, systems::Pendulum};
/// use discrete_herglotz::{GaussCollocation, Problem, Until};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0))?;
/// let run = problem.by(GaussCollocation { stages: 16 }).accuracy(1e-9).without_action();
/// println!("{}", run.plan(Until::Time(1000.0))?);
/// let outcome = run.run(Until::Time(1000.0))?;
/// println!("{}: q = {} after {} steps", outcome.status, outcome.q[0], outcome.steps);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Run<'p, 'o, L, const N: usize> {
    problem: &'p Problem<'p, L, N>,
    integrator: Option<Shared<'p, L, N>>,
    length: Option<StepControl<'p, L, N>>,
    needs: OutputRequest,
    scales: Option<SVector<f64, N>>,
    estimated: bool,
    observers: Vec<Box<dyn Observer<N> + 'o>>,
    from: Option<ResumeState>,
}

impl<'p, 'o, L: Lagrangian<N>, const N: usize> Run<'p, 'o, L, N> {
    fn of(problem: &'p Problem<'p, L, N>) -> Self {
        Run {
            problem,
            integrator: None,
            length: None,
            needs: OutputRequest::ACTION,
            scales: None,
            estimated: false,
            observers: Vec::new(),
            from: None,
        }
    }

    /// The same by this integrator.
    pub fn by(self, integrator: impl Integrator<'p, L, N> + 'p) -> Self {
        Run { integrator: Some(Arc::new(integrator)), ..self }
    }

    /// The same by steps of a given length or number.
    pub fn steps(self, steps: Steps) -> Self {
        Run { length: Some(StepControl::Given(steps)), ..self }
    }

    /// The same by steps of one length for the whole run, of time or of the time of the Lagrangian's time transformation, chosen by trial runs so that the
    /// error of (q, p), relative to its size at the time or at the end, is at most this at every tenth of the span, and that of v, relative to the
    /// largest speed of the motion. The trial runs cost a small multiple of the run; what is narrower than the distance of their nodes, about the
    /// step divided by four times the stages, may go unseen.
    ///
    /// Where an observer's event ends the run, the trial runs end there too.
    ///
    /// Where no integrator is named, it is contact Gauss collocation: with 8 stages, with 16 where it is to take many steps whose
    /// accelerations alone are iterated, and in the transformed time that the Lagrangian states where that takes much fewer steps.
    pub fn accuracy(self, wanted: f64) -> Self {
        Run { length: Some(StepControl::For(wanted, accuracy::choose)), ..self }
    }

    /// The same with a scale for each coordinate, where coordinates differ in size or unit: errors are those of `q_i / scales_i`, and of
    /// `v_i / scales_i` relative to the largest such speed of the motion. It holds for an [`accuracy`](Self::accuracy) and for an
    /// [estimate](Self::with_error_estimate).
    pub fn scales(self, scales: [f64; N]) -> Self {
        Run { scales: Some(scales.into()), ..self }
    }

    /// The same with one more observer, which sees what those before it have seen.
    pub fn observe(mut self, observer: &'o mut impl Observer<N>) -> Self {
        self.observers.push(Box::new(observers::observer::Borrowed(observer)));
        self
    }

    /// Without the action in the outcome: where z does not act back on the motion, and no observer asks for it, it is not computed.
    pub fn without_action(self) -> Self {
        Run { needs: OutputRequest { action: false, ..self.needs }, ..self }
    }

    /// With the conformal factor of the motion in the outcome.
    pub fn with_conformal_factor(self) -> Self {
        Run { needs: OutputRequest { conformal_factor: true, ..self.needs }, ..self }
    }

    /// With an estimate of its error in the outcome: of given steps by a run with twice as many of half their length, which costs
    /// twice as much as the run; of steps for an accuracy what the trial runs have found.
    pub fn with_error_estimate(self) -> Self {
        Run { estimated: true, ..self }
    }

    /// Goes on with the run where it was interrupted, to the last bit: problem, integrator, steps, end and requests must be the same. The
    /// observers see what follows, its start included.
    pub fn resume(self, interrupted: ResumeState) -> Self {
        Run { from: Some(interrupted), ..self }
    }

    /// Checks everything, chooses the step and the route.
    ///
    /// # Errors
    /// [`InputError`]: a span that is not finite, a step that is 0 or not finite, no steps or no integrator, a false or a missing claim of structure, an
    /// integrator whose hypothesis the Lagrangian does not meet, an accuracy that it does not reach.
    pub fn plan(&self, until: Until) -> Result<Plan<'p, L, N>, InputError> {
        let needs = self.needs.and(self.observers.needs());
        let problem = self.problem;
        let (t0, Some(length)) = (problem.t0, self.length) else { return Err(InputError::NoSteps) };
        let (t_end, span, length) = match (until, length) {
            (Until::Time(t), _) => (t, t - t0, length),
            (Until::After(span), _) => (t0 + span, span, length),
            (Until::Steps(0), _) => return Err(NO_STEP),
            (Until::Steps(_), StepControl::Given(Steps::Size(h))) if !(h != 0.0 && h.is_finite()) => {
                return Err(InputError::Step { h });
            }
            (Until::Steps(count), StepControl::Given(Steps::Size(h))) => {
                let span = count as f64 * h;
                (t0 + span, span, StepControl::Exactly(count, h))
            }
            (Until::Steps(_), _) => {
                return Err(InputError::Hypothesis {
                    hypothesis: "steps of a given size, to be ended after a number of them",
                });
            }
        };
        if let Some(scales) = self.scales
            && let Some(index) = scales.iter().position(|scale| !(*scale > 0.0 && scale.is_finite()))
        {
            return Err(InputError::Scale { index, scale: scales[index] });
        }
        let request = Request { problem, t_end, span, integrator: self.integrator.clone(), needs, scales: self.scales };
        let terminal = if let StepControl::For(..) = length { self.observers.terminal() } else { None };
        let mut plan = request.plan(length, terminal)?;
        plan.estimated = self.estimated;
        Ok(plan)
    }

    /// Runs it.
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan), and of observers that cannot observe such a run. What goes wrong in mid-run is the outcome's status.
    pub fn run(mut self, until: Until) -> Result<Outcome<N>, InputError> {
        self.plan(until)?.observed_by(&mut self.observers, self.from.as_ref())
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Problem<'a, L, N> {
    /// A run of it by an integrator.
    pub fn by<'p, 'o>(&'p self, integrator: impl Integrator<'p, L, N> + 'p) -> Run<'p, 'o, L, N> {
        Run::of(self).by(integrator)
    }

    /// A run of it by given steps of contact Gauss collocation with eight stages.
    pub fn steps<'o>(&self, steps: Steps) -> Run<'_, 'o, L, N> {
        self.by(GaussCollocation { stages: 8 }).steps(steps)
    }

    /// A run of it to a relative error of (q, p) and v, by an integrator that is chosen for it; see [`Run::accuracy`].
    pub fn accuracy<'o>(&self, wanted: f64) -> Run<'_, 'o, L, N> {
        Run::of(self).accuracy(wanted)
    }
}

impl<'p, L: Lagrangian<N>, const N: usize> Request<'p, L, N> {
    fn plan(
        &self,
        length: StepControl<'p, L, N>,
        terminal: Option<Terminal<'_, N>>,
    ) -> Result<Plan<'p, L, N>, InputError> {
        let Request { problem, span, .. } = *self;
        if !span.is_finite() {
            return Err(InputError::Span { span });
        }
        if span == 0.0 {
            return self.plan_of_the_start(length);
        }
        // Beyond its rest no error relative to the motion can be told.
        if let StepControl::For(..) = length
            && let Some(t_end) = self.time_of_rest()
        {
            let request = Request { t_end, span: t_end - problem.t0, integrator: self.integrator.clone(), ..*self };
            let mut plan = request.plan(length, terminal)?;
            plan.rests_until = Some(self.t_end);
            return Ok(plan);
        }
        if let Some(integrator) = &self.integrator {
            integrator.check(problem.lagrangian)?;
            let info = integrator.info();
            if info.in_transformed_time {
                self.dt_dtau()?;
            }
            // A step for an accuracy is a root of that order.
            if info.order == 0 {
                return Err(InputError::Hypothesis { hypothesis: "an order of at least one" });
            }
        }
        // trial runs look at the equations of motion along the whole span.
        let times = if let StepControl::For(..) = length { 4 } else { 16 };
        check_claims_over(problem.lagrangian, problem.t0, span, &problem.start, times)?;
        let choice = match length {
            StepControl::For(wanted, choose) => choose(self, wanted, terminal)?,
            StepControl::Given(steps) => self.given(steps)?,
            StepControl::Exactly(count, h) => StepSelection { h, ..self.given(Steps::Count(count))? },
        };
        check_count(choice.count as f64)?;
        let plan = Plan::new(self, &choice)?;
        // trial runs have looked already.
        if plan.error().is_none() {
            plan.probe_first_steps()?;
        }
        Ok(plan)
    }

    /// The plan of a run that ends where it starts: no step is taken.
    fn plan_of_the_start(&self, length: StepControl<'p, L, N>) -> Result<Plan<'p, L, N>, InputError> {
        let (integrator, error) = match (length, &self.integrator) {
            (StepControl::For(wanted, _), _) if !(wanted > 0.0 && wanted.is_finite()) => {
                return Err(InputError::Tolerance { wanted });
            }
            (StepControl::For(..), None) => (Arc::new(GaussCollocation { stages: 8 }) as Shared<'p, L, N>, Some(0.0)),
            (StepControl::For(..), Some(integrator)) => (integrator.clone(), Some(0.0)),
            (StepControl::Given(steps), _) => (self.given(steps)?.integrator, None),
            (StepControl::Exactly(count, _), _) => (self.given(Steps::Count(count))?.integrator, None),
        };
        integrator.check(self.problem.lagrangian)?;
        // Its stepper has a step, though it takes none.
        let h = f64::EPSILON * max_or_nan(self.problem.t0.abs(), 1.0);
        Plan::new(self, &StepSelection { integrator, count: 0, h, error, ended: None })
    }

    /// Given steps of a named integrator.
    fn given(&self, steps: Steps) -> Result<StepSelection<'p, L, N>, InputError> {
        let Some(integrator) = self.integrator.clone() else { return Err(InputError::NoIntegrator) };
        let rate = if integrator.info().in_transformed_time { Some(self.dt_dtau()?) } else { None };
        let span = self.span;
        let of = |count: usize, integrator| StepSelection {
            integrator,
            count,
            h: span / count as f64,
            error: None,
            ended: None,
        };
        match (steps, rate) {
            (Steps::Count(0), _) => Err(NO_STEP),
            (Steps::Count(_), Some(_)) => Err(InputError::Hypothesis { hypothesis: SIZED }),
            (Steps::Count(count), None) => Ok(of(count, integrator)),
            (Steps::Size(h), _) if !(h > 0.0 && h.is_finite()) => Err(InputError::Step { h }),
            // A step that fits the span up to rounding is not made shorter.
            (Steps::Size(h), _) => {
                let count = (span.abs() / (h * rate.unwrap_or(1.0)) * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0);
                check_count(count)?;
                let choice = of(count as usize, integrator);
                Ok(if rate.is_some() { StepSelection { h: h.copysign(span), ..choice } } else { choice })
            }
        }
    }

    /// The rate of the Lagrangian's time transformation at the start.
    fn dt_dtau(&self) -> Result<f64, InputError> {
        let rate = self.problem.lagrangian.dt_dtau(&self.problem.start.q);
        if rate > 0.0 && rate.is_finite() { Ok(rate) } else { Err(InputError::TimeTransformation { rate }) }
    }

    /// The same for the final (q, p) alone.
    fn bare(&self) -> Self {
        Request { needs: OutputRequest::default(), integrator: self.integrator.clone(), ..*self }
    }
}

/// A velocity of the motion near a state; that of the start where none is known.
pub(crate) type Near<const N: usize> = Option<SVector<f64, N>>;

/// A motion as observers ask it for what its states do not hold.
pub(crate) trait Motion<const N: usize> {
    /// The velocity at a state: the one next to another, where several belong to its momentum.
    fn velocity(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<SVector<f64, N>, StepError>;

    /// The energy there.
    fn energy(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<f64, StepError>;

    /// The rates `(qdot, pdot, zdot)` there.
    fn rates(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<PhasePoint<N>, StepError>;

    /// What tells the run from others.
    fn fingerprint(&self) -> u64;

    /// The state at a time of the step that starts at a time and a state, and `sigma_d` from there to it. The curve of the whole step, if it is
    /// known, spares work.
    fn inside(
        &self,
        from: &(f64, PhasePoint<N>),
        t: f64,
        near: Near<N>,
        curve: Option<&DenseStep<N>>,
    ) -> Result<(PhasePoint<N>, f64), StepError>;
}

/// Runs have steps.
const NO_STEP: InputError = InputError::Count { what: "the number of steps", least: 1, found: 0 };

/// What an integrator in transformed time needs.
const SIZED: &str =
    "steps of a given size in its transformed time, or for a wanted accuracy, since it counts them itself";

/// The largest number of steps: `t0 + k h` then still tells times a thousandth of a step apart.
const MOST_STEPS: f64 = (1u64 << 42) as f64;

fn check_count(count: f64) -> Result<(), InputError> {
    if count <= MOST_STEPS {
        return Ok(());
    }
    let remedy = "take longer steps, or a shorter span";
    Err(InputError::TooMany { what: "the number of steps", found: count, most: MOST_STEPS, remedy })
}
