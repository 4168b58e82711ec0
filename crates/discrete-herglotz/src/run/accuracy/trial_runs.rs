//! Trial runs: a motion that is computed with a given number of steps, recorded at a few common times, and sampled for
//! defects between its nodes.

use crate::gauss::{CollocationStepper, SAMPLE_SETS};
use crate::integration::check_claims::violated_claim;
use crate::integration::{SharedIntegrator, SystemProblem};
use crate::resolution::thresholds::{MAX_DEFECT_RATIO, MIN_COMPARED_DEFECT, MIN_SAMPLE_POINTS, TRIAL_ROUNDINGS};
use crate::run::accuracy::comparison_grid::ComparisonGrid;
use crate::run::accuracy::defect_history::DefectHistory;
use crate::run::accuracy::equilibrium_round_off::accumulated_roundings;
use crate::run::accuracy::evaluation_cost::EvaluationCost;
use crate::run::accuracy::limits::{
    BUDGET, CHECKS_PER_INTERRUPT_QUERY, COMPARED_PARTS, MAX_DECAYED_SIZE, MAX_NEWTON_FRACTION, MAX_NEWTON_STEPS,
    MAX_UNCHECKED_STEPS, MIN_TRANSFORMATION_GAIN, NEGLIGIBLE_SAMPLED_DEFECT, RESERVE,
};
use crate::run::accuracy::track::{Track, norm};
use crate::run::accuracy::transformation_gain::TransformationGain;
use crate::run::accuracy::trial_end::{SwitchReason, TrialEnd};
use crate::run::accuracy::velocities::Velocities;
use crate::run::discretization::Discretization;
use crate::run::request::{Request, StepSelection};
use crate::switching::Collocation;
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::evaluation_range::EvaluationRange;
use crate::switching::stepper::part_stepper::PartStepper;
use crate::switching::{DividedGauss, has_switching_functions};
use crate::{InputError, Interrupt, StepFailure, Stepper, StepperOptions};
use contact_geom::{Defect, numbers::max_or_nan};

/// The trial runs of a request, with the rest of their budget.
pub(crate) struct TrialRuns<'t, 'p> {
    pub request: &'t Request<'p>,
    pub collocation: Collocation<'p>,
    pub left: u64,
    /// The rest of the reserve for runs that are expected to reach their end.
    pub reserve: u64,
    /// The requested error.
    pub wanted: f64,
    /// Whether runs with equal steps end if a time transformation would take far fewer.
    pub tests_transformation: bool,
    /// Whether runs end if many of their steps need Newton's method, and whether this run does.
    pub tests_newton_steps: bool,
    pub ends_at_newton_steps: bool,
    /// Whether a search ends if it requires many times more steps than the start of the motion.
    pub tests_uneven_steps: bool,
    /// Whether all steps are sampled, since the energy did not follow its law.
    pub samples_all_steps: bool,
    /// The error that the iterations of the steps of a run may add by Gauss collocation, in units of the size of the motion; 0
    /// if they end at round-off. It is the same for all runs of a search.
    pub of_iterations: f64,
    /// The steppers of the last two completed runs of Gauss collocation, with their numbers of stages and of steps.
    pub completed: Vec<CompletedRun<'p>>,
}

/// A trial run that has reached the end of the span.
pub(crate) struct CompletedRun<'p> {
    stages: usize,
    count: usize,
    stepper: Box<dyn Stepper + 'p>,
}

impl<'t, 'p> TrialRuns<'t, 'p> {
    /// The trial runs of a request, with the whole budget.
    pub fn new(request: &'t Request<'p>, wanted: f64, collocation: Collocation<'p>) -> Self {
        let (tests_transformation, tests_newton_steps, tests_uneven_steps) = (false, false, false);
        TrialRuns {
            request,
            collocation,
            left: BUDGET,
            reserve: RESERVE,
            wanted,
            tests_transformation,
            tests_newton_steps,
            ends_at_newton_steps: false,
            tests_uneven_steps,
            samples_all_steps: false,
            of_iterations: 0.0,
            completed: Vec::new(),
        }
    }

    /// The stepper at the end of the run with these stages and this number of steps, if it was one of the last two.
    pub fn take_completed(&mut self, stages: usize, count: usize) -> Option<Box<dyn Stepper + 'p>> {
        let found = self.completed.iter().position(|run| run.stages == stages && run.count == count)?;
        Some(self.completed.swap_remove(found).stepper)
    }

    /// Whether the system is known to be smooth: all of its kinks and jumps are zeros of switching functions or points of
    /// cones, and it has neither.
    pub fn is_smooth(&self) -> Result<bool, InputError> {
        let SystemProblem { system, t0, start, .. } = &self.request.problem;
        let hints = system.hints();
        Ok(hints.proved
            && !system.has_cones()
            && !(hints.switching_functions && has_switching_functions(&**system, *t0, start)?))
    }

    /// Computes the motion by contact Gauss collocation, with a defect sample between the nodes of each step: with
    /// `closely` at so many points that they cover the span densely, otherwise at one set of points per step. With
    /// `narrow` the run also ends at features that are narrower than the steps.
    pub fn gauss(
        &mut self,
        stages: usize,
        count: usize,
        grid: &ComparisonGrid,
        closely: bool,
        narrow: bool,
    ) -> Result<TrialEnd, InputError> {
        let (problem, h) = (&self.request.problem, self.step(count, grid));
        let nodes = stages * count;
        let points = match closely {
            // The nodes of a smooth motion are points at which a narrow feature would be met, and so are those of the second
            // run, without which no run is accepted.
            true if self.is_smooth()? => {
                (MIN_SAMPLE_POINTS / 2).saturating_sub(nodes).div_ceil(nodes).clamp(1, SAMPLE_SETS)
            }
            true => MIN_SAMPLE_POINTS.div_ceil(nodes).min(SAMPLE_SETS),
            false => 1,
        };
        let costs = EvaluationCost::of(stages, problem.system.dimension());
        let settings = TrialSettings { count, grid, points, narrow, costs };
        let hints = problem.system.hints();
        if hints.time_transformation && matches!(grid, ComparisonGrid::Times) {
            let mut stepper = match self.collocation.transformed_stepper(problem, stages, h) {
                Ok(stepper) => stepper,
                Err(error) => return TrialEnd::of_failed_start(error),
            };
            let ending = self.run_with_samples(&mut *stepper, &settings, 1)?;
            return Ok(ending.with_tau(stepper.tau()));
        }
        // The run itself may be one of these, and computes what is requested of it; the energy depends on the action if L
        // does.
        let samples_few = self.samples_few_steps(nodes)?;
        let for_energy = samples_few && !problem.structure.z_free;
        let action = for_energy || self.request.may_be_a_trial_run() && self.request.needs.action;
        let options = StepperOptions { action, tolerance: self.tolerance(count), ..StepperOptions::default() };
        let collocation = self.collocation.clone();
        if hints.switching_functions && has_switching_functions(&*problem.system, problem.t0, &problem.start)? {
            let make = move |problem: &SystemProblem<'p>, h: f64, _: bool| {
                collocation.stepper(problem, stages, h, options).map(PartStepper::Collocation)
            };
            let mut stepper = match SwitchingStepper::new(problem, h, EvaluationRange::Within, Box::new(make)) {
                Ok(stepper) => stepper.keeping_parts(),
                Err(error) => return TrialEnd::of_failed_start(error),
            };
            return self.run_with_samples(&mut stepper, &settings, 1);
        }
        let mut stepper = match collocation.stepper(problem, stages, h, options) {
            Ok(stepper) => stepper,
            Err(error) => return TrialEnd::of_failed_start(error),
        };
        // For a linear motion the defect between the nodes contains no more than the order does.
        let (stride, points) = match stepper.is_linear() {
            true => (MAX_UNCHECKED_STEPS, 0),
            false if samples_few => (count / grid.base(), settings.points),
            false => (1, settings.points),
        };
        let settings = TrialSettings { points, ..settings };
        let ending = self.run_with_samples(&mut *stepper, &settings, stride)?;
        if let TrialEnd::Completed(_) = ending
            && self.request.may_be_a_trial_run()
        {
            self.completed.truncate(1);
            self.completed.insert(0, CompletedRun { stages, count, stepper });
        }
        Ok(ending)
    }

    /// The motion of [`gauss`](Self::gauss), without defect samples: near an equilibrium they see its round-off.
    pub fn gauss_without_samples(
        &mut self,
        stages: usize,
        count: usize,
        grid: &ComparisonGrid,
    ) -> Result<TrialEnd, InputError> {
        let integrator = match grid {
            ComparisonGrid::Times => self.collocation.transformed_gauss(stages),
            ComparisonGrid::Steps { .. } => self.collocation.gauss(stages),
        };
        self.with_integrator(&integrator, count, grid)
    }

    /// Computes the motion by Gauss collocation with steps that are divided where their defect exceeds the bound of the
    /// integrator.
    pub fn divided(
        &mut self,
        integrator: DividedGauss,
        count: usize,
        grid: &ComparisonGrid,
    ) -> Result<TrialEnd, InputError> {
        let (problem, h) = (&self.request.problem, self.step(count, grid));
        let mut stepper = match integrator.run(self.collocation.clone(), problem, h, StepperOptions::default()) {
            Ok(stepper) => stepper,
            Err(error) => return TrialEnd::of_failed_start(error),
        };
        // The integrator samples the defect of each step, which costs twice its stages.
        let cost = |run: &_, _: f64| (None, 2 * Stepper::evaluations(run));
        self.take_steps(&mut stepper, count, grid, 1, cost).unless_interrupted()
    }

    /// The tolerance of the iterations of each of `count` steps.
    pub fn tolerance(&self, count: usize) -> f64 {
        self.of_iterations / count as f64
    }

    /// The step size with which `count` steps fill the span; in transformed time, if the rate kept its value at the
    /// start.
    pub fn step(&self, count: usize, grid: &ComparisonGrid) -> f64 {
        let SystemProblem { system, start, .. } = &self.request.problem;
        let h = self.request.span / count as f64;
        if let ComparisonGrid::Times = grid { h / system.dt_dtau(&start.q) } else { h }
    }

    /// Computes the motion with defect samples of the steps, and counts the steps that needed Newton's method.
    fn run_with_samples(
        &mut self,
        run: &mut (dyn CollocationStepper + '_),
        settings: &TrialSettings<'_>,
        stride: usize,
    ) -> Result<TrialEnd, InputError> {
        let TrialSettings { count, grid, points, narrow, costs } = settings;
        let SystemProblem { system, start, .. } = &self.request.problem;
        let (floor, h) = (
            max_or_nan(NEGLIGIBLE_SAMPLED_DEFECT * self.wanted, MIN_COMPARED_DEFECT),
            (self.request.span / *count as f64).abs(),
        );
        let Self { tests_transformation, tests_newton_steps, ends_at_newton_steps, .. } = *self;
        let tests_newton_steps = tests_newton_steps || ends_at_newton_steps;
        let (mut samples, mut cost) = (0, 0);
        let (mut history, mut gain) = (DefectHistory::default(), TransformationGain::default());
        let ending = self.take_steps(run, *count, grid, stride, |run, part| {
            let (sample, newton_steps) = (run.sample_defect(*points), run.newton_steps());
            cost = run.evaluations() + newton_steps * costs.newton;
            let spent = |samples: u64| cost + samples * costs.sample;
            if tests_transformation && gain.with_step(system.dt_dtau(&run.state().q)) > MIN_TRANSFORMATION_GAIN {
                return (Some(TrialEnd::SwitchReason(SwitchReason::TimeTransformation)), spent(samples));
            }
            if tests_newton_steps && newton_steps as f64 > MAX_NEWTON_STEPS + MAX_NEWTON_FRACTION * part * *count as f64
            {
                return (Some(TrialEnd::SwitchReason(SwitchReason::FewerStages)), spent(samples));
            }
            let ending = sample.and_then(|sample| {
                samples += *points as u64 + 1;
                // Values of L at the ends of steps between which others lie are not compared.
                let sample = if stride > 1 { sample.after_a_jump() } else { sample };
                if !history.resolves(&sample) {
                    return Some(TrialEnd::Unresolved { part });
                }
                let narrow = *narrow
                    && !sample.is_underflown()
                    && sample.defect > MAX_DEFECT_RATIO * sample.expected + floor
                    && sample.of_momenta
                        > TRIAL_ROUNDINGS * self.request.equilibrium_round_off(run.time(), &run.state()).force * h;
                narrow.then_some(TrialEnd::Narrow { part })
            });
            (ending, spent(samples))
        });
        // A large defect may be due to a false claim of structure.
        if let TrialEnd::Narrow { .. } | TrialEnd::Unresolved { .. } = ending
            && let Some(Defect { claim, size }) = violated_claim(&**system, run.time(), &run.state(), &start.v)
        {
            return Err(InputError::FalseClaim { claim, size });
        }
        Ok(match ending {
            TrialEnd::Completed(track) => TrialEnd::Completed(Track { defect: history.defect(), cost, ..track }),
            other => other.unless_interrupted()?,
        })
    }

    /// Computes the motion with the given integrator.
    pub fn with_integrator(
        &mut self,
        integrator: &SharedIntegrator<'p>,
        count: usize,
        grid: &ComparisonGrid,
    ) -> Result<TrialEnd, InputError> {
        let selection = StepSelection::new(integrator.clone(), count, self.step(count, grid), None);
        let stepper = Discretization::new(&self.request.bare(), &selection).and_then(|steps| steps.stepper(false));
        let mut stepper = match stepper {
            Ok(stepper) => stepper,
            Err(error) => return TrialEnd::of_failed_start(error),
        };
        let cost_per_evaluation = integrator.info().cost_per_evaluation;
        let cost = |run: &(dyn Stepper + '_), _: f64| (None, run.evaluations().saturating_mul(cost_per_evaluation));
        self.take_steps(&mut *stepper, count, grid, MAX_UNCHECKED_STEPS, cost).unless_interrupted()
    }

    /// Takes `count` steps, at most `stride` at a time. After each of these chunks `after_chunk` is called with the
    /// completed fraction of the span; it may end the run, and returns the cost so far, which is deducted from the
    /// budget.
    fn take_steps<R: Stepper + ?Sized>(
        &mut self,
        run: &mut R,
        count: usize,
        grid: &ComparisonGrid,
        stride: usize,
        mut after_chunk: impl FnMut(&R, f64) -> (Option<TrialEnd>, u64),
    ) -> TrialEnd {
        let Request { problem, scales, .. } = self.request;
        let (t0, span) = (problem.t0, self.request.span);
        let parts = || Vec::with_capacity(COMPARED_PARTS);
        let (mut states, mut actions, mut round_off, mut taken, mut spent) = (parts(), Vec::new(), Vec::new(), 0, 0);
        let mut largest_size = norm(&[&problem.state.q, &problem.state.p]);
        let (mut velocities, mut speeds) =
            (Vec::with_capacity(COMPARED_PARTS), Velocities::new(problem, scales.as_ref()));
        let (mut ending, mut chunks) = (None, 0_usize);
        while ending.is_none()
            && let Some((steps, time)) = grid.stop(states.len(), count, t0, span)
        {
            let queries = stride > 1 || chunks.is_multiple_of(CHECKS_PER_INTERRUPT_QUERY);
            if queries && problem.interrupt.is_some_and(Interrupt::is_requested) {
                ending = Some(TrialEnd::Interrupted);
                break;
            }
            chunks += 1;
            // Few steps at first, so that the velocity is sampled at more than one phase of an oscillation; and a defect of
            // the first step, which is the largest of a motion that decays.
            let chunk = if stride == MAX_UNCHECKED_STEPS || taken == 0 { stride.min(taken.max(1)) } else { stride };
            let chunk = chunk.min(steps - taken);
            let advanced = match run.run_support_mut() {
                Some(run) => run.advance_until(chunk, time),
                None => run.advance(chunk).map(|()| chunk),
            };
            let (done, cause) = match advanced {
                Ok(done) => (done, None),
                Err(StepFailure { taken, cause }) => (taken, Some(cause)),
            };
            taken += done;
            let part = (run.time() - t0) / span;
            let other_end;
            (other_end, spent) = after_chunk(run, part);
            ending = cause.map(|cause| TrialEnd::StepFailed { part, cause }).or(other_end);
            let on_grid = taken == steps || (run.time() - time) * span >= 0.0;
            let x = run.state();
            if on_grid || stride > 1 {
                let near = run.last_step().and_then(|step| step.last_velocity());
                let v = speeds.at(run.time(), &x, near.as_ref());
                velocities.extend(on_grid.then_some(v));
            } else {
                speeds.record_position(run.time(), &x.q);
            }
            if on_grid {
                let size = norm(&[&x.q, &x.p]);
                largest_size = max_or_nan(largest_size, size);
                let decayed = size < MAX_DECAYED_SIZE * largest_size;
                let of_all_steps =
                    || accumulated_roundings(taken) * self.request.equilibrium_round_off(run.time(), &x).displacement;
                round_off.push(if decayed { of_all_steps() } else { 0.0 });
                states.push([x.q, x.p]);
                actions.push(x.z);
            }
            // A run continues on the reserve if it is expected to end within it.
            if spent > self.left && spent as f64 > part * self.reserve as f64 {
                ending = Some(TrialEnd::Exhausted);
            }
        }
        self.left = self.left.saturating_sub(spent);
        self.reserve = self.reserve.saturating_sub(spent);
        let (speed, scales) = (speeds.speed(taken), scales.clone());
        let track =
            Track { states, actions, round_off, velocities, speed, scales, defect: 0.0, cost: spent, tau: span };
        ending.unwrap_or(TrialEnd::Completed(track))
    }
}

/// The settings of a run with defect samples.
struct TrialSettings<'m> {
    count: usize,
    grid: &'m ComparisonGrid,
    /// The number of sets of points of a defect sample.
    points: usize,
    /// Whether the run ends at features that are narrower than the steps.
    narrow: bool,
    costs: EvaluationCost,
}
