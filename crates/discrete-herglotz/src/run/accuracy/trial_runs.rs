//! Trial runs: a motion that is computed with a given number of steps, recorded at a few common times, and sampled for
//! defects between its nodes.

use crate::gauss::routes::transformed::StatedTransformation;
use crate::gauss::{DefectSample, SAMPLE_SETS, UNDERFLOWN};
use crate::integration::check_claims::violated_claim;
use crate::run::accuracy::noise::{DECAYED, all_together};
use crate::run::accuracy::track::{Track, norm};
use crate::run::accuracy::velocities::Velocities;
use crate::run::discretization::Discretization;
use crate::run::request::{Request, Shared, StepSelection};
use crate::switching::{DividedGauss, Reach, SwitchingStepper, has_switching_functions};
use crate::{
    InputError, StepError, StepFailure, Stepper,
    gauss::{GaussRoute, GaussStepper, TransformedStepper},
};
use crate::{Interrupt, Problem, StepperOptions};
use contact_geom::{Defect, Lagrangian, numbers::max_or_nan};

/// The budget of all trial runs of a plan, in evaluations of L at one stage: some seconds.
pub(crate) const BUDGET: u64 = 1 << 26;

/// The budget of runs that are expected to reach their end, as those of long motions: so the total budget grows with
/// the cost of the run itself.
pub(crate) const RESERVE: u64 = 1 << 29;

/// The defect between the nodes above which a step does not resolve the motion: its momenta would have an error of a
/// twentieth.
const RESOLVED: f64 = 0.05;

/// The defect, in units of the largest momentum, below which it is round-off: some hundred units, for the sums in the
/// forces.
const AT_REST: f64 = 1e-13;

/// The round-off of a defect, in units of the round-off of a force.
const ROUNDINGS: f64 = 64.0;

/// The same bound for the values of L, whose polynomials have to approximate twice the frequencies.
const RESOLVED_VALUE: f64 = 0.2;

/// The ratio of the defect to the expected defect above which a narrow feature lies between the nodes; smooth motions
/// stay below it.
const NARROW: f64 = 30.0;

/// The smallest number of sample points over the span: features wider than their distance are detected.
const POINTS: usize = 2000;

/// The number of steps between two checks of budget and progress.
const CHUNK: usize = 1024;

/// The number of these checks between two checks for an interrupt, if steps are taken one by one.
const LOOKS: usize = 16;

/// The number of parts of a span at whose ends runs are compared.
const PARTS: usize = 10;

/// The smallest reduction of the number of steps for which a time transformation is tried: each of its steps costs
/// about as much as this number of equal steps with the same error. For Kepler orbits this holds for eccentricities
/// above one half.
const PROFIT: f64 = 3.5;

/// The number of steps that may need Newton's method before other stages are tried, and their fraction of all steps. If
/// a coarse run stays below both, a run with twice as many steps rarely needs Newton's method.
const FEW_NEWTON: f64 = 2.0;
const PART_NEWTON: f64 = 0.25;

/// The times of a span at which runs are compared.
#[derive(Clone, Debug)]
pub(crate) enum ComparisonGrid {
    /// Ends of steps of a run with `base` steps, which divides the numbers of steps of all others.
    Steps { base: usize, at: Vec<usize> },
    /// The ends of the tenths of a span, on which steps in transformed time are forced to end.
    Times,
}

impl ComparisonGrid {
    /// The ends of the tenths of a span, each moved to the end of the step that contains it; the ends of all steps if
    /// there are fewer than ten.
    pub fn of(base: usize) -> Self {
        let parts = base.min(PARTS);
        ComparisonGrid::Steps { base, at: (1..=parts).map(|i| (i * base).div_ceil(parts)).collect() }
    }

    /// Equal parts of a span: ten, or the number of steps if that is smaller.
    pub fn equal(steps: usize) -> Self {
        ComparisonGrid::of(steps.min(PARTS))
    }

    /// The smallest number of steps, not below `steps`, that the grid divides.
    pub fn whole(&self, steps: f64) -> usize {
        let base = if let ComparisonGrid::Steps { base, .. } = self { *base } else { 1 };
        (steps / base as f64).ceil().max(1.0) as usize * base
    }

    /// The number of steps and the time at the i-th point of the grid, for a run with `count` steps over a span: the
    /// run stops at whichever it reaches first.
    fn stop(&self, i: usize, count: usize, t0: f64, span: f64) -> Option<(usize, f64)> {
        match self {
            ComparisonGrid::Steps { base, at } => {
                at.get(i).map(|mark| (mark * (count / base), f64::INFINITY.copysign(span)))
            }
            ComparisonGrid::Times => (i < PARTS).then(|| (usize::MAX, t0 + span * ((i + 1) as f64 / PARTS as f64))),
        }
    }
}

/// The end of a trial run.
#[derive(Clone, Debug)]
pub(crate) enum TrialEnd<const N: usize> {
    /// The run reached the end of the span.
    Followed(Track<N>),
    /// A step does not resolve the motion, after this part of the span.
    Unresolved { part: f64 },
    /// The same, with the defect of a narrow feature.
    Narrow { part: f64 },
    /// Another integrator is less expensive.
    SwitchReason(SwitchReason),
    /// A step failed.
    Halted { part: f64, cause: StepError },
    /// The budget is exhausted.
    Exhausted,
    /// The run was interrupted.
    Interrupted,
}

/// The less expensive alternative to the steps of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SwitchReason {
    /// Steps in the transformed time of the Lagrangian, of which far fewer are needed.
    TimeTransformation,
    /// Steps of fewer stages, since the present ones need Newton's method.
    FewerStages,
    /// Divided steps where the motion is fast, since the number of equal steps is a large multiple of that required at
    /// the start.
    Divided,
}

/// A defect relative to a size; unchanged if the size is 0.
fn relative_to(defect: f64, size: f64) -> f64 {
    if defect == 0.0 || size == 0.0 { defect } else { defect / size }
}

/// The defect samples of a run so far.
#[derive(Default)]
struct DefectHistory {
    before: Option<DefectSample>,
    /// The largest momentum, and the largest quantity to which defects of the values of L are relative.
    size: f64,
    kinetic: f64,
    /// The largest absolute defects of the momenta and of the values of L. They are compared with the largest sizes
    /// along the whole run: in a motion that comes to rest only round-off is left, and a motion that starts at rest
    /// reaches its size later.
    of_momentum: f64,
    of_value: f64,
}

impl DefectHistory {
    /// Adds the defect sample of the next step; returns whether the step resolves the motion.
    fn resolves(&mut self, look: &DefectSample) -> bool {
        let before = self.before.replace(*look).filter(|_| !look.follows_a_jump);
        let jump = before.map_or(0.0, |before| before.jump_to(look));
        (self.size, self.kinetic) = (max_or_nan(self.size, look.size), max_or_nan(self.kinetic, look.kinetic));
        let of_value = max_or_nan(look.of_value, jump);
        // A motion at rest crosses no jump, and values of L that have underflowed carry no information.
        let told = of_value != 0.0 && (self.kinetic >= UNDERFLOWN || self.kinetic.is_nan());
        let of_value = if told { of_value } else { 0.0 };
        let of_momentum = look.defect * if look.size > 0.0 { look.size } else { 1.0 };
        self.of_momentum = max_or_nan(self.of_momentum, of_momentum);
        self.of_value = max_or_nan(self.of_value, of_value);
        // Written so that a NaN counts as unresolved.
        (look.defect <= RESOLVED || of_momentum <= AT_REST * self.size || look.is_underflown())
            && relative_to(of_value, self.kinetic) <= RESOLVED_VALUE
    }

    /// The largest defect, relative to the largest momentum and to the size for defects of values.
    fn defect(&self) -> f64 {
        max_or_nan(relative_to(self.of_momentum, self.size), relative_to(self.of_value, self.kinetic))
    }
}

/// The estimate of the steps that a time transformation would save, compared with equal steps.
#[derive(Default)]
struct Uneven {
    steps: f64,
    /// The sum of the reciprocal rates, which is the span of tau in units of the step, and the largest of them.
    sum: f64,
    largest: f64,
}

impl Uneven {
    /// Adds the rate at the end of the next step; returns by which factor fewer steps of the time transformation cover
    /// the same span, if they are all as short in tau as the shortest of the equal steps.
    fn profit(&mut self, rate: f64) -> f64 {
        let speed = 1.0 / rate;
        (self.steps, self.sum) = (self.steps + 1.0, self.sum + speed);
        self.largest = max_or_nan(self.largest, speed);
        self.largest * self.steps / self.sum
    }
}

/// The trial runs of a request, with the rest of their budget.
pub(crate) struct TrialRuns<'t, 'p, L, const N: usize> {
    pub request: &'t Request<'p, L, N>,
    pub left: u64,
    /// The rest of the reserve for runs that are expected to reach their end.
    pub reserve: u64,
    /// The requested error.
    pub wanted: f64,
    /// Whether runs with equal steps end if a time transformation would take far fewer.
    pub watches_transformation: bool,
    /// Whether runs end if many of their steps need Newton's method.
    pub watches_newton: bool,
    /// Whether a search ends if it requires many times more steps than the start of the motion.
    pub watches_uneven: bool,
}

impl<'t, 'p, L: Lagrangian<N>, const N: usize> TrialRuns<'t, 'p, L, N> {
    /// The trial runs of a request, with the whole budget.
    pub fn new(request: &'t Request<'p, L, N>, wanted: f64) -> Self {
        let (watches_transformation, watches_newton, watches_uneven) = (false, false, false);
        TrialRuns {
            request,
            left: BUDGET,
            reserve: RESERVE,
            wanted,
            watches_transformation,
            watches_newton,
            watches_uneven,
        }
    }

    /// Computes the motion by contact Gauss collocation, with a defect sample between the nodes of each step: with
    /// `closely` at so many points that they cover the span densely, otherwise at one set of points per step. With
    /// `narrow` the run also ends at features that are narrower than the steps.
    pub fn gauss(
        &mut self,
        stages: usize,
        count: usize,
        marks: &ComparisonGrid,
        closely: bool,
        narrow: bool,
    ) -> Result<TrialEnd<N>, InputError> {
        let (problem, h) = (self.request.problem, self.step(count, marks));
        let points = if closely { POINTS.div_ceil(stages * count).min(SAMPLE_SETS) } else { 1 };
        let course = TrialSettings { count, marks, points, narrow, price: EvaluationCost::of::<N>(stages) };
        if const { L::HINTS.time_transformation } && matches!(marks, ComparisonGrid::Times) {
            let mut stepper =
                match TransformedStepper::new(problem, stages, h, StatedTransformation(problem.lagrangian)) {
                    Ok(stepper) => stepper,
                    Err(error) => return halted_at_the_start(error),
                };
            let ending = self.watch(&mut stepper, &course, 1, |run, sets| (run.look(sets), 0))?;
            return Ok(ending.with_tau(stepper.tau()));
        }
        let options = StepperOptions::default();
        if const { L::HINTS.switching_functions }
            && has_switching_functions(problem.lagrangian, problem.t0, &problem.start)?
        {
            let make = |problem: &Problem<'p, L, N>, h: f64, _: bool| GaussStepper::new(problem, stages, h, options);
            let mut stepper = match SwitchingStepper::new(problem, h, Reach::Inside, make) {
                Ok(stepper) => stepper.keeping_parts(),
                Err(error) => return halted_at_the_start(error),
            };
            return self.watch(&mut stepper, &course, 1, |run, sets| {
                let parts = run.last_step();
                let looks = parts.iter().map(|part| part.look(sets)).reduce(|a, b| Some(a?.joined(b?)));
                let look = looks.flatten().map(|look| if run.has_switched() { look.after_a_jump() } else { look });
                (look, parts.iter().map(GaussStepper::newton_steps).sum())
            });
        }
        let mut stepper = match GaussStepper::new(problem, stages, h, options) {
            Ok(stepper) => stepper,
            Err(error) => return halted_at_the_start(error),
        };
        // For a linear motion the defect between the nodes contains no more than the order does.
        let linear = stepper.route() == GaussRoute::Linear;
        let (stride, points) = if linear { (CHUNK, 0) } else { (1, course.points) };
        let course = TrialSettings { points, ..course };
        self.watch(&mut stepper, &course, stride, |run, sets| (run.look(sets), run.newton_steps()))
    }

    /// Computes the motion by Gauss collocation with steps that are divided where their defect exceeds the bound of the
    /// integrator.
    pub fn divided(
        &mut self,
        integrator: DividedGauss,
        count: usize,
        marks: &ComparisonGrid,
    ) -> Result<TrialEnd<N>, InputError> {
        let (problem, h) = (self.request.problem, self.step(count, marks));
        let mut stepper = match integrator.run(problem, h, StepperOptions::default()) {
            Ok(stepper) => stepper,
            Err(error) => return halted_at_the_start(error),
        };
        // The integrator samples the defect of each step, which costs twice its stages.
        let look = |run: &_, _: f64| (None, 2 * Stepper::evaluations(run));
        self.follow(&mut stepper, count, marks, 1, look).unless_interrupted()
    }

    /// The step size with which `count` steps fill the span; in transformed time, if the rate kept its value at the
    /// start.
    pub fn step(&self, count: usize, marks: &ComparisonGrid) -> f64 {
        let Problem { lagrangian, start, .. } = self.request.problem;
        let h = self.request.span / count as f64;
        if let ComparisonGrid::Times = marks { h / lagrangian.dt_dtau(&start.q) } else { h }
    }

    /// Computes the motion with defect samples: `look` samples the last step at a number of sets of points, and also
    /// counts the steps that needed Newton's method.
    fn watch<R: Stepper<N>>(
        &mut self,
        run: &mut R,
        course: &TrialSettings<'_>,
        stride: usize,
        look: impl Fn(&R, usize) -> (Option<DefectSample>, u64),
    ) -> Result<TrialEnd<N>, InputError> {
        let TrialSettings { count, marks, points, narrow, price } = course;
        let Problem { lagrangian, start, .. } = *self.request.problem;
        let (floor, h) = (max_or_nan(0.1 * self.wanted, 1e-11), (self.request.span / *count as f64).abs());
        let Self { watches_transformation, watches_newton, .. } = *self;
        let (mut looks, mut cost, mut seen, mut uneven) = (0, 0, DefectHistory::default(), Uneven::default());
        let ending = self.follow(run, *count, marks, stride, |run, part| {
            let (look, newton_steps) = look(run, *points);
            cost = run.evaluations() + newton_steps * price.newton;
            let spent = |looks: u64| cost + looks * price.look;
            if const { L::HINTS.time_transformation }
                && watches_transformation
                && uneven.profit(lagrangian.dt_dtau(&run.state().q)) > PROFIT
            {
                return (Some(TrialEnd::SwitchReason(SwitchReason::TimeTransformation)), spent(looks));
            }
            if watches_newton && newton_steps as f64 > FEW_NEWTON + PART_NEWTON * part * *count as f64 {
                return (Some(TrialEnd::SwitchReason(SwitchReason::FewerStages)), spent(looks));
            }
            let ending = look.and_then(|look| {
                looks += *points as u64 + 1;
                if !seen.resolves(&look) {
                    return Some(TrialEnd::Unresolved { part });
                }
                let narrow = *narrow
                    && !look.is_underflown()
                    && look.defect > NARROW * look.expected + floor
                    && look.of_momenta > ROUNDINGS * self.request.noise(run.time(), &run.state()).force * h;
                narrow.then_some(TrialEnd::Narrow { part })
            });
            (ending, spent(looks))
        });
        // A large defect may be due to a false claim of structure.
        if let TrialEnd::Narrow { .. } | TrialEnd::Unresolved { .. } = ending
            && let Some(Defect { claim, size }) = violated_claim(lagrangian, run.time(), &run.state(), &start.v)
        {
            return Err(InputError::FalseClaim { claim, size });
        }
        Ok(match ending {
            TrialEnd::Followed(track) => TrialEnd::Followed(Track { defect: seen.defect(), cost, ..track }),
            other => other.unless_interrupted()?,
        })
    }

    /// Computes the motion with the given integrator.
    pub fn own(
        &mut self,
        integrator: &Shared<'p, L, N>,
        count: usize,
        marks: &ComparisonGrid,
    ) -> Result<TrialEnd<N>, InputError> {
        let choice = StepSelection {
            integrator: integrator.clone(),
            count,
            h: self.step(count, marks),
            error: None,
            ended: None,
        };
        let stepper = Discretization::new(&self.request.bare(), &choice).and_then(|steps| steps.stepper(false));
        let mut stepper = match stepper {
            Ok(stepper) => stepper,
            Err(error) => return halted_at_the_start(error),
        };
        let price = integrator.info().cost_per_evaluation;
        let look = |run: &(dyn Stepper<N> + '_), _: f64| (None, run.evaluations().saturating_mul(price));
        self.follow(&mut *stepper, count, marks, CHUNK, look).unless_interrupted()
    }

    /// Takes `count` steps, at most `stride` at a time. After each of these chunks `look` is called with the completed
    /// fraction of the span; it may end the run, and returns the cost so far, which is deducted from the budget.
    fn follow<R: Stepper<N> + ?Sized>(
        &mut self,
        run: &mut R,
        count: usize,
        marks: &ComparisonGrid,
        stride: usize,
        mut look: impl FnMut(&R, f64) -> (Option<TrialEnd<N>>, u64),
    ) -> TrialEnd<N> {
        let &Request { problem, span, .. } = self.request;
        let t0 = problem.t0;
        let (mut states, mut noise, mut taken, mut spent) =
            (Vec::with_capacity(PARTS), Vec::with_capacity(PARTS), 0, 0);
        let mut reach = norm(&[problem.state.q, problem.state.p]);
        let (mut velocities, mut seen) = (Vec::with_capacity(PARTS), Velocities::new(problem, self.request.scales));
        let (mut ending, mut looks) = (None, 0_usize);
        while ending.is_none()
            && let Some((steps, time)) = marks.stop(states.len(), count, t0, span)
        {
            // Single steps take little time, so that not every one is followed by this check.
            let asks = stride > 1 || looks.is_multiple_of(LOOKS);
            if asks && self.request.problem.interrupt.is_some_and(Interrupt::is_wanted) {
                ending = Some(TrialEnd::Interrupted);
                break;
            }
            looks += 1;
            // Few steps at first, so that the velocity is sampled at more than one phase of an oscillation.
            let chunk = stride.min(taken.max(1)).min(steps - taken);
            let (done, cause) = match run.advance_until(chunk, time) {
                Ok(done) => (done, None),
                Err(StepFailure { taken, cause }) => (taken, Some(cause)),
            };
            taken += done;
            let part = (run.time() - t0) / span;
            let by_look;
            (by_look, spent) = look(run, part);
            ending = cause.map(|cause| TrialEnd::Halted { part, cause }).or(by_look);
            let marked = taken == steps || (run.time() - time) * span >= 0.0;
            let x = run.state();
            if marked || stride > 1 {
                let v = seen.at(run.time(), &x, run.last_velocity());
                velocities.extend(marked.then_some(v));
            } else {
                seen.pass(run.time(), &x.q);
            }
            if marked {
                let state = [x.q, x.p];
                let size = norm(&state);
                reach = max_or_nan(reach, size);
                let decayed = size < DECAYED * reach;
                let of_all = || all_together(taken) * self.request.noise(run.time(), &x).displacement;
                noise.push(if decayed { of_all() } else { 0.0 });
                states.push(state);
            }
            // A run continues on the reserve if it is expected to end within it.
            if spent > self.left && spent as f64 > part * self.reserve as f64 {
                ending = Some(TrialEnd::Exhausted);
            }
        }
        self.left = self.left.saturating_sub(spent);
        self.reserve = self.reserve.saturating_sub(spent);
        let (speed, scales) = (seen.speed(taken), self.request.scales);
        let track = Track { states, noise, velocities, speed, scales, defect: 0.0, cost: spent, tau: span };
        ending.unwrap_or(TrialEnd::Followed(track))
    }
}

/// The settings of a run with defect samples.
struct TrialSettings<'m> {
    count: usize,
    marks: &'m ComparisonGrid,
    /// The number of sets of points of a defect sample.
    points: usize,
    /// Whether the run ends at features that are narrower than the steps.
    narrow: bool,
    price: EvaluationCost,
}

impl<const N: usize> TrialEnd<N> {
    /// Returns the end itself, or the error by which an interrupt ends the whole search.
    fn unless_interrupted(self) -> Result<Self, InputError> {
        if let TrialEnd::Interrupted = self { Err(InputError::Interrupted) } else { Ok(self) }
    }

    /// Sets the span in transformed time.
    fn with_tau(self, tau: f64) -> Self {
        if let TrialEnd::Followed(track) = self { TrialEnd::Followed(Track { tau, ..track }) } else { self }
    }
}

/// The cost of parts of a run, in evaluations of L at one stage.
struct EvaluationCost {
    /// A step that needs Newton's method: a few solutions of the dense equations of all stages, with second derivatives
    /// at each.
    newton: u64,
    /// A defect sample at as many points as there are stages, including the maps to the points.
    look: u64,
}

impl EvaluationCost {
    fn of<const N: usize>(stages: usize) -> Self {
        let (unknowns, stages) = ((stages * (N + 2)) as u64, stages as u64);
        // An evaluation takes as long as about 32 products; second derivatives are not computed in SIMD lanes.
        EvaluationCost { newton: 4 * (unknowns.pow(3) / 96 + 8 * stages * (2 * N as u64 + 1)), look: 2 * stages }
    }
}

/// A failure of the first step leads to a refinement; invalid input ends the search.
fn halted_at_the_start<const N: usize>(error: InputError) -> Result<TrialEnd<N>, InputError> {
    match error {
        InputError::Sigma { sigma } => Ok(TrialEnd::Halted { part: 0.0, cause: StepError::SigmaVanished { sigma } }),
        InputError::FirstStep(cause) => Ok(TrialEnd::Halted { part: 0.0, cause }),
        bad => Err(bad),
    }
}
