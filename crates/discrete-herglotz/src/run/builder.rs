//! The builder of a run: integrator, steps, observers and requests.

use crate::integration::SystemProblem;
use crate::integration::{SharedIntegrator, bound};
use crate::run::accuracy;
use crate::run::integrate::integrate;
use crate::run::observers::observer::{Borrowed, Observer};
use crate::run::observers::output_request::OutputRequest;
use crate::run::planning::NO_STEP;
use crate::run::request::{Request, SelectSteps, StepControl, Steps, Until};
use crate::run::{Outcome, Plan, ResumeState};
use crate::switching::{Collocation, CollocationByPoints, CollocationOf, CollocationSteppers};
use crate::{GaussCollocation, InputError, Integrator, Problem, Vector};
use contact_geom::{GeometryError, Lagrangian};
use std::sync::Arc;

/// The builder of a run: a [`Problem`] with an integrator, steps and observers.
///
/// From these and the declared structure of the Lagrangian a [`Plan`] selects the least expensive route, and describes
/// what will be computed and what is skipped. The declared structure is checked at sample points; a false claim is an
/// error.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
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
pub struct Run<'p, 'o, P = SystemProblem<'p>> {
    pub(crate) problem: &'p P,
    system: SystemProblem<'p>,
    /// The collocation steppers of a system whose steps may have parts.
    parts: Option<Collocation<'p>>,
    integrator: Option<SharedIntegrator<'p>>,
    length: Option<StepControl<'p>>,
    needs: OutputRequest,
    scales: Option<Vector>,
    estimated: bool,
    observers: Vec<Box<dyn Observer + 'o>>,
    from: Option<ResumeState>,
}

impl<'p, 'o, P> Run<'p, 'o, P> {
    fn of(problem: &'p P, system: SystemProblem<'p>, parts: Option<Collocation<'p>>) -> Self {
        Run {
            problem,
            system,
            parts,
            integrator: None,
            length: None,
            needs: OutputRequest::ACTION,
            scales: None,
            estimated: false,
            observers: Vec::new(),
            from: None,
        }
    }

    /// The same run without the type of its problem, and so without its derivatives.
    pub(crate) fn without_type(self) -> Run<'p, 'o, ()> {
        let Run { system, parts, integrator, length, needs, scales, estimated, observers, from, .. } = self;
        Run { problem: &(), system, parts, integrator, length, needs, scales, estimated, observers, from }
    }

    fn within(self, wanted: f64, select_steps: SelectSteps<'p>, collocation: Collocation<'p>) -> Self {
        Run { length: Some(StepControl::Accuracy(wanted, select_steps, collocation)), ..self }
    }

    /// Sets the size or the number of the steps.
    pub fn steps(self, steps: Steps) -> Self {
        Run { length: Some(StepControl::Given(steps)), ..self }
    }

    /// Sets a scale for each coordinate, for coordinates that differ in size or unit: errors are then those of the
    /// scaled coordinates `q_i/scales_i`, and of the scaled velocities `v_i/scales_i` relative to the largest such
    /// speed of the motion. The scales apply to [`accuracy`](Self::accuracy) and to the [error
    /// estimate](Self::with_error_estimate).
    pub fn scales(self, scales: impl Into<Vector>) -> Self {
        Run { scales: Some(scales.into()), ..self }
    }

    /// Adds an observer; observers are called in the order in which they were added.
    pub fn observe(mut self, observer: &'o mut impl Observer) -> Self {
        self.observers.push(Box::new(Borrowed(observer)));
        self
    }

    /// Omits the action from the outcome. It is not computed if z does not act back on the motion and no observer
    /// requests it.
    pub fn without_action(self) -> Self {
        Run { needs: OutputRequest { action: false, ..self.needs }, ..self }
    }

    /// Includes the conformal factor of the motion in the outcome.
    pub fn with_conformal_factor(self) -> Self {
        Run { needs: OutputRequest { conformal_factor: true, ..self.needs }, ..self }
    }

    /// Computes the states between the ends of steps, as those of [`Rows`](crate::Rows) and
    /// [`Events`](crate::run::Events), by steps of the integrator that end there, so that the map to each of them is
    /// conformally contact like a step; for collocation, which otherwise takes them from polynomials in less time.
    pub fn with_exact_states(self) -> Self {
        Run { needs: OutputRequest { exact: true, ..self.needs }, ..self }
    }

    /// Includes an error estimate in the outcome. For given steps it is computed by a run with twice as many steps of
    /// half the size, which costs twice as much as the run itself; for a requested accuracy it is the error found by
    /// the trial runs.
    pub fn with_error_estimate(self) -> Self {
        Run { estimated: true, ..self }
    }

    /// Continues an interrupted run, with bitwise the same result as an uninterrupted one: problem, integrator, steps,
    /// end and requests must be the same. The observers see the continued part, including its start.
    pub fn resume(self, interrupted: ResumeState) -> Self {
        Run { from: Some(interrupted), ..self }
    }

    /// Checks the input and selects the step and the route.
    ///
    /// # Errors
    /// [`InputError`]: a span that is not finite, a step that is 0 or not finite, missing steps or a missing
    /// integrator, a false or a missing claim of structure, an integrator whose hypotheses the Lagrangian does not
    /// satisfy, an accuracy that cannot be reached.
    pub fn plan(&self, until: Until) -> Result<Plan<'p>, InputError> {
        let needs = self.needs.and(self.observers.needs());
        let (t0, n, Some(length)) = (self.system.t0, self.system.start.q.len(), self.length.clone()) else {
            return Err(InputError::NoSteps);
        };
        let (t_end, span, length) = match (until, &length) {
            (Until::Time(t), _) => (t, t - t0, length),
            (Until::After(span), _) => (t0 + span, span, length),
            (Until::Steps(0), _) => return Err(NO_STEP),
            (Until::Steps(_), StepControl::Given(Steps::Size(h))) if !(*h != 0.0 && h.is_finite()) => {
                return Err(InputError::Step { h: *h });
            }
            (Until::Steps(count), StepControl::Given(Steps::Size(h))) => {
                let span = count as f64 * h;
                (t0 + span, span, StepControl::Exactly(count, *h))
            }
            (Until::Steps(_), _) => {
                return Err(InputError::Hypothesis {
                    hypothesis: "steps of a given size for a run that ends after a number of steps",
                });
            }
        };
        if let Some(scales) = &self.scales
            && scales.len() != n
        {
            return Err(GeometryError::WrongSize { what: "scales", expected: n, found: scales.len() }.into());
        }
        if let Some(scales) = &self.scales
            && let Some(index) = scales.iter().position(|scale| !(*scale > 0.0 && scale.is_finite()))
        {
            return Err(InputError::Scale { index, scale: scales[index] });
        }
        let (integrator, scales, parts) = (self.integrator.clone(), self.scales.clone(), self.parts.clone());
        let ends_only = self.from.is_none() && self.observers.sees_only_the_ends();
        let request =
            Request { problem: self.system.clone(), t_end, span, integrator, needs, scales, parts, ends_only };
        let terminal = if let StepControl::Accuracy(..) = length { self.observers.terminal() } else { None };
        let mut plan = request.plan(length, terminal)?;
        plan.estimated = self.estimated;
        Ok(plan)
    }

    /// Performs the run.
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan), and those of observers that cannot observe the run. A failure during the run is
    /// reported as the status of the outcome.
    pub fn run(mut self, until: Until) -> Result<Outcome, InputError> {
        integrate(&self.plan(until)?, &mut self.observers, self.from.as_ref())
    }
}

impl<'p, P> Run<'p, '_, P> {
    /// The same run with the action, on which its derivatives depend.
    ///
    /// # Errors
    /// [`InputError::Hypothesis`] for a resumed run.
    pub(crate) fn differentiable(self) -> Result<Self, InputError> {
        if self.from.is_some() {
            return Err(InputError::Hypothesis {
                hypothesis: "a run from its start, since a resumed run has no derivatives",
            });
        }
        Ok(Run { needs: OutputRequest { action: true, derivatives: true, ..self.needs }, ..self })
    }

    /// Performs the run of a plan with one more observer, called after the others.
    pub(crate) fn observed(mut self, plan: &Plan<'p>, observer: &mut impl Observer) -> Result<Outcome, InputError> {
        let mut observers = std::mem::take(&mut self.observers);
        // It is the first to see a step, also one in which another observer ends the run.
        observers.insert(0, Box::new(Borrowed(observer)));
        integrate(plan, &mut observers, self.from.as_ref())
    }
}

impl<'p, L: Lagrangian<N>, const N: usize> Run<'p, '_, Problem<'p, L, N>> {
    /// A run of the problem without an integrator and without steps.
    pub(crate) fn typed(problem: &'p Problem<'p, L, N>) -> Self {
        // Written so that collocation is not compiled for a Lagrangian whose steps have no parts.
        let parts: Option<Collocation<'p>> = if const { L::HINTS.switching_functions } {
            Some(Arc::new(CollocationOf(problem.lagrangian)))
        } else {
            None
        };
        Run::of(problem, problem.of_system(), parts)
    }

    /// Sets the integrator.
    pub fn by(self, integrator: impl Integrator<'p, L, N> + 'p) -> Self {
        Run { integrator: Some(bound(integrator, self.problem.lagrangian)), ..self }
    }

    /// Requests an error instead of a step size. Trial runs select one step size for the whole run, in time or in the
    /// transformed time of the Lagrangian, such that at every tenth of the span the error of (q, p), relative to its
    /// size at that time or at the end, is at most `wanted`, and so is the error of v, relative to the largest speed of
    /// the motion. The trial runs cost a small multiple of the run. Features of the motion that are narrower than the
    /// distance of their nodes, about the step divided by four times the number of stages, may be missed.
    ///
    /// Of a system that is known to be smooth, as a formula without kinks, two runs with numbers of steps in the ratio 2 : 3
    /// suffice in most cases. The run is one of them, and is not computed again where only its end is
    /// [observed](Observer::sees_only_the_ends).
    ///
    /// If an observer's event ends the run, the trial runs end there too.
    ///
    /// If no integrator is given, contact Gauss collocation is used: with 8 stages; with 16 stages for many steps whose
    /// stage equations are iterated in the accelerations only; and in the transformed time of the Lagrangian if this
    /// takes far fewer steps.
    pub fn accuracy(self, wanted: f64) -> Self {
        let collocation = Arc::new(CollocationOf::<L, N>(self.problem.lagrangian));
        self.within(wanted, accuracy::select_steps, collocation)
    }

    /// Requests an error of a run whose steps are equal: its plan is refused where divided steps would be far fewer.
    pub(crate) fn accuracy_of_equal_steps(self, wanted: f64) -> Self {
        let collocation = Arc::new(CollocationOf::<L, N>(self.problem.lagrangian));
        self.within(wanted, accuracy::select_equal_steps, collocation)
    }
}

impl<'p> Run<'p, '_> {
    /// Sets the number of stages of contact Gauss collocation.
    pub fn by(self, integrator: GaussCollocation) -> Self {
        Run { integrator: Some(CollocationByPoints.gauss(integrator.stages)), ..self }
    }

    /// Requests an error instead of a step size, as in a run of a [`Problem`]. If no number of stages is given, there are 8,
    /// or the steps are divided where the motion is fast.
    pub fn accuracy(self, wanted: f64) -> Self {
        self.within(wanted, accuracy::select_steps, Arc::new(CollocationByPoints))
    }
}

impl<'a> SystemProblem<'a> {
    fn run<'p, 'o>(&'p self) -> Run<'p, 'o> {
        let switches = self.system.hints().switching_functions;
        Run::of(self, self.clone(), switches.then(|| Arc::new(CollocationByPoints) as Collocation<'p>))
    }

    /// A run of the problem with contact Gauss collocation.
    pub fn by<'p, 'o>(&'p self, integrator: GaussCollocation) -> Run<'p, 'o> {
        self.run().by(integrator)
    }

    /// A run with given steps of contact Gauss collocation with eight stages.
    pub fn steps<'p, 'o>(&'p self, steps: Steps) -> Run<'p, 'o> {
        self.by(GaussCollocation { stages: 8 }).steps(steps)
    }

    /// A run to a requested relative error of (q, p) and v.
    pub fn accuracy<'p, 'o>(&'p self, wanted: f64) -> Run<'p, 'o> {
        self.run().accuracy(wanted)
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Problem<'a, L, N> {
    /// A run of the problem with an integrator.
    pub fn by<'p, 'o>(&'p self, integrator: impl Integrator<'p, L, N> + 'p) -> Run<'p, 'o, Problem<'p, L, N>> {
        Run::typed(self).by(integrator)
    }

    /// A run with given steps of contact Gauss collocation with eight stages.
    pub fn steps<'p, 'o>(&'p self, steps: Steps) -> Run<'p, 'o, Problem<'p, L, N>> {
        self.by(GaussCollocation { stages: 8 }).steps(steps)
    }

    /// A run to a requested relative error of (q, p) and v, with an integrator that is selected for it; see
    /// [`Run::accuracy`].
    pub fn accuracy<'p, 'o>(&'p self, wanted: f64) -> Run<'p, 'o, Problem<'p, L, N>> {
        Run::typed(self).accuracy(wanted)
    }
}
