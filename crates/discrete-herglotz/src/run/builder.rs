//! A run as it is put together, from a problem to its outcome.

use crate::run::accuracy;
use crate::run::integrate::integrate;
use crate::run::observers::observer::{Borrowed, Observer};
use crate::run::observers::output_request::OutputRequest;
use crate::run::planning::NO_STEP;
use crate::run::request::{Request, Shared, StepControl, Steps, Until};
use crate::run::{Outcome, Plan, ResumeState};
use crate::{GaussCollocation, InputError, Integrator, Problem};
use contact_geom::Lagrangian;
use contact_geom::nalgebra::SVector;
use std::sync::Arc;

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
        self.observers.push(Box::new(Borrowed(observer)));
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
        integrate(&self.plan(until)?, &mut self.observers, self.from.as_ref())
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
