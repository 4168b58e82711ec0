//! Gradients of functions of the end of a run, by the adjoint.

use crate::integration::{Motion, PartPoint, WholeStep};
use crate::run::discretization::Discretization;
use crate::run::{Outcome, Plan, Row, Rows, Run, Until};
use crate::sensitivity::columns::Covector;
use crate::sensitivity::gradient_parts::PartCovectors;
use crate::sensitivity::kept_states::{BLOCK, KeptStates, for_each_block};
use crate::sensitivity::parametric_system::{Differentiable, DifferentiableProblem, Quantity};
use crate::sensitivity::row_times::{SameTime, check_times};
use crate::sensitivity::step_maps::Direction;
use crate::sensitivity::step_tangent::{RowTangent, StepTangent, TakenStep};
use crate::sensitivity::tangent::{no_tangent, projected_start};
use crate::sensitivity::time_jumps::TimeJumps;
use crate::sensitivity::velocity_dependence::VelocityDependence;
use crate::sensitivity::{EndCovector, Loss, MotionState, SensitivityError};
use crate::system::products::times;
use crate::{InputError, Point, Problem, SecondDerivatives, State, Status, StepError, Stepper, Vector};
use contact_geom::{GeometryError, Parametric};
use std::ops::Range;

/// The gradient of a number that depends on the end of a run, with respect to all variables of the run; see
/// [`Variable`](crate::sensitivity::Variable) for what is fixed.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient {
    /// In the initial position.
    pub q: Vector,
    /// In the initial velocity, or in the initial momentum if the start was given by it.
    pub rate: Vector,
    /// In the initial action.
    pub z: f64,
    /// In the parameters, in the order of [`Parametric::parameter_names`](contact_geom::Parametric::parameter_names);
    /// NaN for a parameter in which the steps of a splitting are not differentiable, because its hypotheses hold only for
    /// one value. For a [`CustomMethod`](crate::CustomMethod), parameters and times are NaN: its discrete Lagrangian is
    /// differentiated in the state alone.
    pub parameters: Vec<f64>,
    /// In the time of the start, for a fixed end time and a fixed number of steps.
    pub t0: f64,
    /// In the time of the end, for a fixed number of steps.
    pub t_end: f64,
    /// The largest component of the derivative in the state along the run divided by that at the start, at least one:
    /// round-off of the gradient is amplified by it.
    pub growth: f64,
}

/// A run with the gradient of a loss of its end.
#[derive(Clone, Debug, PartialEq)]
pub struct LossGradient {
    /// The outcome of the run.
    pub outcome: Outcome,
    /// The value of the loss and its gradient; `None` if the run was not completed, for the reason that the status of
    /// the outcome gives.
    pub loss: Option<(f64, Gradient)>,
}

/// A run that was performed and of which gradients can be computed, any number of them.
///
/// The stages of collocation steps are kept as long as they take at most 32 MiB. Of other runs states are kept at intervals,
/// and the steps between them are taken again, so that the stages are bitwise those of the run and the memory does not grow
/// with the number of steps.
pub struct RecordedRun<'p> {
    problem: Differentiable<'p>,
    plan: Plan<'p>,
    outcome: Outcome,
    kept: KeptStates,
}

impl<'p, L: Parametric<N>, const N: usize> Run<'p, '_, Problem<'p, L, N>> {
    /// Performs the run, and computes the value and the gradient of a loss of its end by the adjoint. The gradient is
    /// that of the discrete run, to round-off: of the steps that were given, or that were chosen for an accuracy, which
    /// are not differentiated themselves.
    ///
    /// ```
    /// use contact_examples::systems::Pendulum;
    /// use contact_geom::{Scalar, VelocityPoint};
    /// use discrete_herglotz::{Problem, Steps, Until, sensitivity::{EndState, Loss}};
    /// struct Miss;
    /// impl Loss<1> for Miss {
    ///     fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
    ///         (end.q[0] - 0.5).powi(2)
    ///     }
    /// }
    /// let pendulum = Pendulum { gamma: -0.01 };
    /// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0))?;
    /// let run = problem.steps(Steps::Size(0.5)).gradient(&Miss, Until::Time(10.0))?;
    /// if let Some((value, gradient)) = run.loss {
    ///     println!("{value}, in v0 {}, in gamma {}", gradient.rate[0], gradient.parameters[0]);
    /// }
    /// # Ok::<(), discrete_herglotz::sensitivity::SensitivityError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`record`](Self::record) and of [`RecordedRun::pullback`]; [`SensitivityError::Loss`] where the loss or
    /// its derivative is not finite.
    pub fn gradient(self, loss: &impl Loss<N>, until: Until) -> Result<LossGradient, SensitivityError> {
        self.gradient_of(|end| end.differentiate(loss), until)
    }
}

impl<'p> Run<'p, '_> {
    /// The gradient of a loss, as of a run of a [`Problem`].
    ///
    /// # Errors
    /// The same; [`InputError::Geometry`](crate::InputError::Geometry) for a loss of another number of coordinates.
    pub fn gradient<const N: usize>(self, loss: &impl Loss<N>, until: Until) -> Result<LossGradient, SensitivityError> {
        check_length("the argument of the loss", N, self.problem.system.dimension())?;
        self.gradient_of(|end| end.differentiate(loss), until)
    }
}

impl<'p, P: DifferentiableProblem<'p>> Run<'p, '_, P> {
    /// Performs the run and keeps what its gradients need.
    ///
    /// # Errors
    /// Those of [`run`](Self::run), and [`SensitivityError::NoTangent`].
    pub fn record(self, until: Until) -> Result<RecordedRun<'p>, SensitivityError> {
        let run = self.differentiable()?;
        let problem = run.problem.differentiable();
        let plan = run.plan(until)?;
        // An integrator without a tangent is refused before the run.
        let has_stages = StepTangent::new(&problem, &plan.steps, Direction::Backward)?.has_stages();
        let mut kept = KeptStates::new(has_stages);
        let outcome = run.observed(&plan, &mut kept)?;
        Ok(RecordedRun { problem, plan, outcome, kept })
    }

    /// Performs the run, and computes the value and the gradient of a loss of its end, which is given as a function with its
    /// partial derivatives, by the adjoint; see [`gradient`](Run::gradient).
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient).
    pub fn gradient_of(
        self,
        loss: impl FnOnce(&MotionState) -> (f64, EndCovector),
        until: Until,
    ) -> Result<LossGradient, SensitivityError> {
        let recorded = self.record(until)?;
        let Some(end) = recorded.end() else { return Ok(LossGradient { outcome: recorded.outcome, loss: None }) };
        let (value, covector) = loss(&end);
        if !(value.is_finite() && covector.is_finite()) {
            return Err(SensitivityError::Loss { value });
        }
        let gradient = recorded.pullback(&covector)?;
        Ok(LossGradient { outcome: recorded.outcome, loss: Some((value, gradient)) })
    }
}

impl<'p, P: DifferentiableProblem<'p>> Run<'p, '_, P> {
    /// The same for a loss of the states at these times, which are in the order of the run: a function with its partial
    /// derivatives in each of them. The times are fixed, except the end of the run.
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient) and of [`RecordedRun::pullback_at`].
    pub fn gradient_at(
        self,
        times: &[f64],
        loss: impl FnOnce(&[MotionState]) -> (f64, Vec<EndCovector>),
        until: Until,
    ) -> Result<LossGradient, SensitivityError> {
        let run = self.differentiable()?;
        let problem = run.problem.differentiable();
        let plan = run.plan(until)?;
        // An integrator without a tangent is refused before the run.
        let has_stages = StepTangent::new(&problem, &plan.steps, Direction::Backward)?.has_stages();
        let kept = KeptStates::new(has_stages);
        let mut both = (kept, Rows::at(times.iter().copied())?.with_velocity());
        let outcome = run.observed(&plan, &mut both)?;
        let (kept, rows) = both;
        if outcome.status != Status::Completed {
            return Ok(LossGradient { outcome, loss: None });
        }
        let recorded = RecordedRun { problem, plan, outcome, kept };
        let state = |Row { t, q, v, p, z, .. }: Row| {
            let v = v.unwrap_or_else(|| Vector::repeat(q.len(), f64::NAN));
            MotionState { t, q, v, p, z: z.unwrap_or(f64::NAN) }
        };
        let states: Vec<MotionState> = rows.rows.into_iter().map(state).collect();
        let (value, covectors) = loss(&states);
        if !(value.is_finite() && covectors.iter().all(EndCovector::is_finite)) {
            return Err(SensitivityError::Loss { value });
        }
        let gradient = recorded.pullback_at(times, &covectors)?;
        Ok(LossGradient { outcome: recorded.outcome, loss: Some((value, gradient)) })
    }
}

impl RecordedRun<'_> {
    /// The outcome of the run.
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// The end of a completed run; `None` if it was not completed.
    pub fn end(&self) -> Option<MotionState> {
        let Outcome { status, t, v, .. } = &self.outcome;
        let v = v.as_ref().filter(|_| *status == Status::Completed)?;
        Some(MotionState::at(*t, &self.outcome.state(), v))
    }

    /// The gradient of a number with these partial derivatives in the end state.
    ///
    /// # Errors
    /// [`SensitivityError::Step`] where the adjoint of a step cannot be computed, as for a run that was not completed;
    /// [`InputError::Geometry`](crate::InputError::Geometry) for derivatives in another number of coordinates.
    pub fn pullback(&self, covector: &EndCovector) -> Result<Gradient, SensitivityError> {
        let mut all = self.pullbacks(std::slice::from_ref(covector))?;
        all.pop().ok_or(SensitivityError::Step { step: 0, cause: StepError::NonFinite })
    }

    /// The gradients of several numbers; the steps are taken again only once.
    ///
    /// # Errors
    /// Those of [`pullback`](Self::pullback).
    pub fn pullbacks(&self, covectors: &[EndCovector]) -> Result<Vec<Gradient>, SensitivityError> {
        self.pull(covectors, &[], &[])
    }

    /// The gradient of a number with these partial derivatives in the states at these times, which are in the order of
    /// the run. The times are fixed, except the end of the run.
    ///
    /// # Errors
    /// Those of [`pullback`](Self::pullback); [`InputError::Times`](crate::InputError::Times),
    /// [`InputError::Count`](crate::InputError::Count) where there are fewer covectors than times.
    pub fn pullback_at(&self, times: &[f64], covectors: &[EndCovector]) -> Result<Gradient, SensitivityError> {
        let steps = &self.plan.steps;
        let span = (steps.problem.t0, steps.t_end);
        check_times(times, span)?;
        if covectors.len() != times.len() {
            let (found, least) = (covectors.len(), times.len());
            return Err(InputError::Count { what: "the number of covectors", least, found }.into());
        }
        let (mut end, mut inner) = (EndCovector::zero(self.problem.dimension()), times.len());
        if let (Some(t), Some(last)) = (times.last(), covectors.last())
            && SameTime::of_span(span).is(*t, self.outcome.t)
        {
            (end, inner) = (last.clone(), inner - 1);
        }
        let mut all = self.pull(&[end], &times[..inner], &covectors[..inner])?;
        all.pop().ok_or(SensitivityError::Step { step: 0, cause: StepError::NonFinite })
    }

    /// Carries covectors of the end back to the start, and adds those of rows to the first of them.
    fn pull(
        &self,
        of_end: &[EndCovector],
        times: &[f64],
        of_rows: &[EndCovector],
    ) -> Result<Vec<Gradient>, SensitivityError> {
        let (problem, steps) = (&self.problem, &self.plan.steps);
        for covector in of_end.iter().chain(of_rows) {
            check_size(covector, problem.dimension())?;
        }
        let failed = |step: usize, cause: StepError| SensitivityError::Step { step, cause };
        let end = self.end().ok_or_else(|| failed(self.outcome.steps, StepError::NonFinite))?;
        let x = Point { q: end.q.clone(), v: end.v.clone(), z: end.z };
        let of_velocity =
            VelocityDependence::at(problem, end.t, &x, &end.p).map_err(|e| failed(self.outcome.steps, e))?;
        // The derivatives in the end time for a fixed state (q, p, z).
        let mut explicit_times = Vec::with_capacity(of_end.len());
        let mut all: Vec<Covector> = Vec::with_capacity(of_end.len());
        for covector in of_end {
            let (of_state, parameters, time) = of_velocity.pull(covector);
            explicit_times.push(time);
            all.push(Covector::new(of_state, parameters));
        }
        let mut engine = StepTangent::new(problem, steps, Direction::Backward)?;
        let (jumps, same) = (TimeJumps::new(problem, steps), SameTime::of_span((steps.problem.t0, steps.t_end)));
        let mut rows = RowCovectors { problem, steps, jumps: &jumps, same, times, of_rows, tangent: RowTangent::new() };
        if let (Some(from), Some(first)) = (self.outcome.rests_from, all.first_mut()) {
            rows.add_at_rest(from, &end, first).map_err(|cause| failed(self.outcome.steps, cause))?;
        }
        let mut of_parts = PartCovectors { problem, steps, jumps: &jumps, tangent: RowTangent::new() };
        let has_stages = engine.has_stages();
        let mut pull_back = |range: Range<usize>, block: &[TakenStep]| {
            for (k, step) in range.zip(block).rev() {
                match step {
                    TakenStep::Whole(step) => {
                        engine.pull(step, k, &mut all).map_err(|cause| failed(k, cause))?;
                        if let Some(first) = all.first_mut() {
                            rows.add(&mut engine, step, k, first).map_err(|cause| failed(k, cause))?;
                        }
                    }
                    TakenStep::Parts(parts) => of_parts.pull(&mut engine, (parts, k), &mut all, &mut rows)?,
                }
                of_parts.pull_at_start(step, k, &mut all, &mut rows).map_err(|cause| failed(k, cause))?;
            }
            Ok(())
        };
        if let Some(stages) = self.kept.stages() {
            stages.for_each_backward(|k, step| pull_back(k..k + 1, std::slice::from_ref(step)))?;
        } else {
            let mut stepper = self.plan.stepper()?;
            let mut block: Vec<TakenStep> = Vec::with_capacity(BLOCK);
            let mut work = |stepper: &mut dyn Stepper, range: Range<usize>| {
                block.clear();
                for k in range.clone() {
                    let before = (stepper.time(), stepper.state());
                    stepper.advance(1).map_err(|failure| failed(k, failure.cause))?;
                    let step = TakenStep::last_of(&*stepper, has_stages, steps.h, before);
                    block.push(step.ok_or_else(|| no_tangent(&self.plan, ""))?);
                }
                pull_back(range, &block)
            };
            for (range, words) in self.kept.backward() {
                for_each_block(&mut *stepper, range, words, &mut work, &failed)?;
            }
        }
        if let Some(start) = projected_start(problem, &self.plan)? {
            all.iter_mut().for_each(|covector| start.pull(covector));
        }
        let taken = self.outcome.steps;
        let gradients = all.iter().zip(explicit_times);
        Ok(gradients.map(|(covector, time)| gradient(problem, covector, time, taken)).collect())
    }
}

/// Checks the number of coordinates of a covector.
///
/// # Errors
/// Those of [`check_length`].
fn check_size(covector: &EndCovector, n: usize) -> Result<(), InputError> {
    let EndCovector { q, v, p, .. } = covector;
    let vectors = [("q of a covector", q), ("v of a covector", v), ("p of a covector", p)];
    vectors.into_iter().try_for_each(|(what, vector)| check_length(what, vector.len(), n))
}

/// Checks that there are n coordinates.
///
/// # Errors
/// [`InputError::Geometry`] if not.
fn check_length(what: &'static str, found: usize, n: usize) -> Result<(), InputError> {
    if found == n { Ok(()) } else { Err(GeometryError::WrongSize { what, expected: n, found }.into()) }
}

/// The covectors of rows that are not yet added, from the last to the first.
pub(super) struct RowCovectors<'r, 'p> {
    problem: &'r Differentiable<'p>,
    steps: &'r Discretization<'p>,
    jumps: &'r TimeJumps<'r, 'p>,
    same: SameTime,
    times: &'r [f64],
    of_rows: &'r [EndCovector],
    tangent: RowTangent<'p>,
}

impl<'p> RowCovectors<'_, 'p> {
    /// Adds the covectors of the rows after the time at which the motion has come to rest to that of its end, whose state is
    /// theirs: since the tangent has come to rest with it, the covector of the end is also that of this time.
    fn add_at_rest(&mut self, from: f64, end: &MotionState, to: &mut Covector) -> Result<(), StepError> {
        let MotionState { q, v, p, z, .. } = end;
        while let Some(t) = self.times.last().copied() {
            let is_later = if self.steps.h < 0.0 { t < from } else { t > from };
            if self.same.is(t, from) || !is_later {
                break;
            }
            let state = State { q: q.clone(), p: p.clone(), z: *z };
            let Some(row) = self.take(&PartPoint { t, state, v: v.clone() })? else { break };
            to.add_multiple(1.0, &row);
        }
        Ok(())
    }

    /// Adds the covectors of the rows after the start of a step, the k-th of the run, to that at its start; `engine` is the
    /// tangent of whole steps.
    fn add(
        &mut self,
        engine: &mut StepTangent<'p>,
        step: &WholeStep,
        k: usize,
        to: &mut Covector,
    ) -> Result<(), StepError> {
        let of_start = self.add_within(engine, step, to)?;
        to.add_time(of_start, k);
        Ok(())
    }

    /// Adds the covectors of the rows after the start of a step, or of a part of one, to that at its start. Returns the
    /// derivative in the time of this start.
    pub fn add_within(
        &mut self,
        engine: &mut StepTangent<'p>,
        step: &WholeStep,
        to: &mut Covector,
    ) -> Result<f64, StepError> {
        let problem = self.problem;
        let (start, _) = step.start();
        let mut of_start = 0.0;
        while let Some(t) = self.times.last().copied() {
            let passed = if step.length() < 0.0 { t <= start } else { t >= start };
            if self.same.is(t, start) || !passed {
                break;
            }
            let (short, state, v) = self.steps.shortened(step, t)?;
            let Some(mut row) = self.take(&PartPoint { t, state, v })? else { break };
            self.tangent.pull(engine, problem, &short, std::slice::from_mut(&mut row))?;
            let [of_its_start, of_length] = row.take_times();
            to.add_multiple(1.0, &row);
            // The length of the step decreases as its start moves.
            of_start += of_its_start - of_length;
        }
        Ok(of_start)
    }

    /// Whether a time is that of the last row that is not yet added.
    pub fn is_next(&self, t: f64) -> bool {
        self.times.last().is_some_and(|row| self.same.is(*row, t))
    }

    /// Adds the covector of a row at the start of a step, the k-th of the run.
    pub fn add_at_start(&mut self, at: &PartPoint, k: usize, to: &mut Covector) -> Result<(), StepError> {
        if !self.is_next(at.t) {
            return Ok(());
        }
        let v = self.steps.velocity(at.t, &at.state, Some(&at.v))?;
        let at = PartPoint { t: at.t, state: at.state.clone(), v };
        let Some(row) = self.take(&at)? else { return Ok(()) };
        let rates = self.steps.rates(self.jumps.before(at.t), &at.state, Some(&at.v))?;
        to.add_at_fixed_time(&row.state(), &row.parameters, &rates, k);
        Ok(())
    }

    /// The covector of a row at a point, if there is one at its time.
    pub fn take_at(&mut self, at: &PartPoint) -> Result<Option<Covector>, StepError> {
        if self.is_next(at.t) { self.take(at) } else { Ok(None) }
    }

    /// The covector of the last row, at its point.
    fn take(&mut self, at: &PartPoint) -> Result<Option<Covector>, StepError> {
        let (Some((_, times)), Some((covector, of_rows))) = (self.times.split_last(), self.of_rows.split_last()) else {
            return Ok(None);
        };
        (self.times, self.of_rows) = (times, of_rows);
        let (of_state, parameters, _) =
            VelocityDependence::at(self.problem, at.t, &at.point(), &at.state.p)?.pull(covector);
        Ok(Some(Covector::new(of_state, parameters)))
    }
}

/// The gradient in the variables of the start from that in the initial state `(q, p, z)`; `explicit` is the derivative in
/// the end time for a fixed end state.
fn gradient(of: &Differentiable<'_>, covector: &Covector, explicit: f64, steps: usize) -> Gradient {
    let size = covector.size();
    let of_step = covector.step / steps.max(1) as f64;
    let mut gradient = Gradient {
        q: covector.q.clone(),
        rate: covector.p.clone(),
        z: covector.z,
        parameters: covector.parameters.clone(),
        t0: covector.time - of_step,
        t_end: of_step + explicit,
        growth: if covector.largest > size { covector.largest / size } else { 1.0 },
    };
    let problem = &of.problem;
    if !problem.from_momentum {
        // p = L_v(t, q, v, z; theta).
        let (t0, p) = (problem.t0, &covector.p);
        let SecondDerivatives { qv, vv, vz, .. } = problem.system.hessian(t0, &problem.start);
        gradient.q += &times(&qv, p);
        gradient.rate = times(&vv, p);
        gradient.z += vz.dot(p);
        let (mut quantities, at) = (of.stages.quantities(), (&problem.start, &problem.state.p));
        for (k, sum) in gradient.parameters.iter_mut().enumerate() {
            *sum += quantities.of_momentum(Quantity::Parameter(k), t0, at).dot(p);
        }
        gradient.t0 += quantities.of_momentum(Quantity::Time, t0, at).dot(p);
    }
    gradient
}
