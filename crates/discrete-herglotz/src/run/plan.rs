//! The plan of a run: the route, and the one loop of all runs.

use crate::error::first;
use crate::gauss::FEW_STAGES;
use crate::integration::check_claims::violated_claim;
use crate::run::accuracy::StepSelection;
use crate::run::accuracy::ended::Before;
use crate::run::accuracy::rest::REST;
use crate::run::checks::claims::ClaimMonitor;
use crate::run::checks::energy::{EnergyMonitor, EnergySums};
use crate::run::observers::checkpoint::digest;
use crate::run::{
    Motion, Near, Observer, Outcome, OutputRequest, Request, ResumeState, RunInfo, Shared, StepView, Stop,
};
use crate::switching::{has_switching_functions, of_integrator};
use crate::{
    DenseStep, InputError, MethodInfo, PlanEntry, Problem, Status, StepError, Stepper, StepperOptions, SuspectInterval,
    UnresolvedStep, legendre_inverse,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{Defect, Derivatives, Lagrangian, PhasePoint, Structure, VelocityPoint};

/// The steps that are tried, and probed, before a run.
const FIRST_STEPS: usize = 64;

/// The steps between two probes of the claims in long runs: so many that a probe costs less than one in a hundred.
const PROBES: usize = 1 << 14;

/// The step after which the claims are probed next: every power of two, and the multiples of [`PROBES`].
fn next_probe(taken: usize) -> usize {
    (taken + 1).checked_next_power_of_two().unwrap_or(usize::MAX).min((taken / PROBES + 1) * PROBES)
}

/// The next step, counted from 0, that is compared with two halves: each that ends at a power of two, and the last.
fn halved_step(taken: usize, count: usize) -> usize {
    (taken + 1).checked_next_power_of_two().unwrap_or(count).min(count) - 1
}

/// The unknowns of a collocation step up to which the one matrix of a linear motion is never dear, and the part of their cube that is the number
/// of steps from which on it is worth its price: it is solved for in twice the working precision.
const MATRIX: (usize, usize) = (32, 1024);

/// A problem for so many steps of an integrator: where they are too few for the matrix of a linear motion its stages are solved like those of others.
pub(crate) fn for_steps<'p, L, const N: usize>(
    problem: &Problem<'p, L, N>,
    integrator: &MethodInfo,
    steps: usize,
) -> Problem<'p, L, N> {
    let unknowns = integrator.collocation.unwrap_or(0) * N;
    let worth_it = unknowns <= MATRIX.0 || unknowns.pow(3) / MATRIX.1 <= steps;
    let structure = Structure { quadratic: problem.structure.quadratic && worth_it, ..problem.structure };
    Problem { structure, ..*problem }
}

/// The steps by which a run may pass the end that trial runs have met: the errors of both.
const PASSED: usize = 2;

/// The stepper of an integrator, with steps that end on kinks and jumps where the Lagrangian states them.
fn stepper_of<'p, L: Lagrangian<N>, const N: usize>(
    integrator: &Shared<'p, L, N>,
    switches: bool,
    problem: &Problem<'p, L, N>,
    h: f64,
    wants: StepperOptions,
) -> Result<Box<dyn Stepper<N> + 'p>, InputError> {
    if const { L::HAS_SWITCHING_FUNCTIONS } && switches && !integrator.info().divides {
        return of_integrator(integrator.clone(), problem, h, wants);
    }
    integrator.stepper(problem, h, wants)
}

/// A run after its checks, with step and route chosen; made by [`Run::plan`](crate::run::Run::plan). Printed, it says what will be computed and
/// what is skipped.
pub struct Plan<'p, L, const N: usize> {
    pub(crate) problem: &'p Problem<'p, L, N>,
    pub(crate) t_end: f64,
    /// Negative where the run goes back.
    pub(crate) h: f64,
    pub(crate) count: usize,
    /// The steps after which an observer is to end the run.
    ended: Option<usize>,
    error: Option<f64>,
    integrator: Shared<'p, L, N>,
    pub(crate) info: MethodInfo,
    pub(crate) needs: OutputRequest,
    /// What errors of the coordinates are measured by, where that is given.
    pub(crate) scales: Option<SVector<f64, N>>,
    /// What its steps compute and skip, as the stepper says.
    pub(crate) work_summary: Vec<PlanEntry>,
    /// Whether `sigma_d` is the same in all steps.
    pub(crate) constant_rate: bool,
    /// Whether the Lagrangian states switching functions.
    pub(crate) switches: bool,
    /// Whether the error of given steps is estimated.
    pub(crate) estimated: bool,
    /// The end that was requested, where it ends before since the motion is at rest from there on.
    pub(crate) rests_until: Option<f64>,
}

impl<'p, L: Lagrangian<N>, const N: usize> Plan<'p, L, N> {
    /// Finds the route of a request.
    pub(crate) fn new(request: &Request<'p, L, N>, choice: &StepSelection<'p, L, N>) -> Result<Self, InputError> {
        let Request { problem, t_end, needs, scales, .. } = *request;
        let StepSelection { integrator, count, h, error, ended } = choice.clone();
        let switches = has_switching_functions(problem.lagrangian, problem.t0, &problem.start)?;
        let info = integrator.info();
        if switches && info.in_transformed_time {
            let hypothesis = "a Lagrangian without kinks and jumps, since its steps are equal in transformed time";
            return Err(InputError::Hypothesis { hypothesis });
        }
        let stepper =
            stepper_of(&integrator, switches, &for_steps(problem, &info, count), h, StepperOptions::default())?;
        Ok(Plan {
            problem,
            t_end,
            h,
            count,
            ended,
            error,
            info,
            needs,
            scales,
            work_summary: stepper.work_summary(),
            constant_rate: stepper.has_constant_rate(),
            switches,
            integrator,
            estimated: false,
            rests_until: None,
        })
    }

    /// The time step, negative where the run goes back; in transformed time, in its time.
    pub fn step_size(&self) -> f64 {
        self.h
    }

    /// The number of steps; in transformed time with steps of a given size, as many as its rate at the start lets expect. An
    /// observer may end the run before.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The number of steps that are to be expected: where trial runs have met an event that ends the run, those until then.
    fn expected(&self) -> usize {
        self.ended.map_or(self.count, |ended| self.count.min(ended.saturating_add(1)))
    }

    /// What is known of the integrator, where none was named the one that was chosen.
    pub fn integrator(&self) -> &MethodInfo {
        &self.info
    }

    /// The error of (q, p) and v that the trial runs found, or predict; `None` where no accuracy was asked for.
    pub fn error(&self) -> Option<f64> {
        self.error
    }

    /// A stepper at the start, to be driven by hand: in transformed time with [`Stepper::advance_until`], which ends where the span
    /// does. A splitting's does not watch whether its steps resolve the motion:
    /// that costs up to a third of its time, and is for runs whose steps were not found by trial runs.
    ///
    /// # Errors
    /// Those of the method's start.
    pub fn stepper(&self) -> Result<Box<dyn Stepper<N> + 'p>, InputError> {
        self.make_stepper(&for_steps(self.problem, &self.info, self.count), self.h, false)
    }

    /// A stepper at a start, by steps of h.
    pub(crate) fn make_stepper(
        &self,
        problem: &Problem<'p, L, N>,
        h: f64,
        watched: bool,
    ) -> Result<Box<dyn Stepper<N> + 'p>, InputError> {
        stepper_of(&self.integrator, self.switches, problem, h, StepperOptions { action: self.needs.action, watched })
    }

    /// Whether steps look at themselves between the nodes of their many stages.
    pub(crate) fn many_stages(&self) -> bool {
        self.info.collocation.is_some_and(|stages| stages > FEW_STAGES)
    }

    /// Whether a time is the end of the span, or beyond it.
    fn is_over(&self, t: f64) -> bool {
        if self.h < 0.0 { t <= self.t_end } else { t >= self.t_end }
    }

    /// Runs it with no observer but those of the plan's own outcome.
    ///
    /// # Errors
    /// Those of [`stepper`](Self::stepper). What goes wrong in mid-run is the outcome's status.
    pub fn run(&self) -> Result<Outcome<N>, InputError> {
        self.observed_by(&mut Vec::new(), None)
    }

    /// Runs it under the eyes of observers.
    pub(crate) fn observed_by(
        &self,
        observers: &mut Vec<Box<dyn Observer<N> + '_>>,
        from: Option<&ResumeState>,
    ) -> Result<Outcome<N>, InputError> {
        let in_transformed_time = self.info.in_transformed_time;
        let h = (!in_transformed_time).then_some(self.h);
        let count = (!in_transformed_time || self.error.is_some()).then_some(self.expected());
        let problem = for_steps(self.problem, &self.info, self.count);
        let mut stepper = self.make_stepper(&problem, self.h, self.error.is_none())?;
        if self.needs.saved && stepper.save().is_none() {
            return Err(InputError::Unsaved);
        }
        let t_end = self.rests_until.unwrap_or(self.t_end);
        let course = RunInfo { t0: self.problem.t0, t_end, h, count };
        observers.prepare(&course)?;
        // The logarithm of the product of the sigma_d; in single steps only where they differ.
        let (mut log_factor, single) = (0.0, self.needs.conformal_factor && !self.constant_rate);
        let (mut taken, mut status, mut unresolved) = (0, Status::Completed, None);
        let (mut energy, mut claims) = (EnergyMonitor::of(self), ClaimMonitor::of(self));
        if let Some(from) = from {
            if from.fingerprint != self.fingerprint() || !stepper.restore(&from.words) {
                return Err(InputError::AnotherRun);
            }
            (taken, log_factor, unresolved) = (from.taken, from.log_factor, from.unresolved);
            energy.iter_mut().for_each(|energy| energy.drift.sums = from.energy);
        }
        // Steps that trial runs have found are judged already; those of many stages are looked at between their nodes, and are compared
        // with halves in doubt alone.
        let doubts = self.error.is_none() && !in_transformed_time;
        // Those of other methods than Gauss' were compared with a reference that was looked at; where a motion is proved to be linear a transient that
        // ends within a step is nothing that the order does not show.
        let linear = const { L::PROVED } && self.problem.structure.quadratic;
        let judged = self.error.is_some() && (self.info.collocation.is_none() || linear);
        let seen_by = |stepper: &dyn Stepper<N>| if judged { None } else { stepper.unresolved() };
        let halves = doubts && !self.many_stages();
        let most = if in_transformed_time { usize::MAX } else { self.count };
        let ended = |taken: usize, t: f64| taken == most || in_transformed_time && self.is_over(t);
        // A run may be resumed at its end.
        let mut over = ended(taken, stepper.time());
        let sums =
            |energy: &Option<EnergyMonitor<N>>| energy.as_ref().map(|energy| energy.drift.sums).unwrap_or_default();
        let start = self.moment(&*stepper, None, (log_factor, unresolved, sums(&energy)), (taken, over));
        let mut stop = observers.start(&start).break_value();
        while !over && stop.is_none() {
            // One mark is enough.
            let halved = if halves && unresolved.is_none() { halved_step(taken, most) } else { usize::MAX };
            let next_seen = observers.next(taken).max(taken + 1);
            let next_look = if taken == halved { taken + 1 } else { halved };
            // The step that is seen is taken by itself, so that observers can look into it.
            let next_seen_alone = if next_seen > taken + 1 { next_seen - 1 } else { next_seen };
            let next_energy = energy.as_ref().map_or(usize::MAX, |energy| energy.next(taken));
            let next_claims = claims.as_ref().map_or(usize::MAX, |claims| claims.next(taken));
            let next =
                next_seen_alone.min(next_probe(taken)).min(next_look).min(next_energy).min(next_claims).min(most);
            let chunk = if single { 1 } else { next - taken };
            let alone = taken == halved || next_seen == taken + 1 || next_claims == taken + 1;
            let before = alone.then(|| (stepper.time(), stepper.state()));
            let (done, cause) = match stepper.advance_until(chunk, self.t_end) {
                Ok(done) => (done, None),
                Err(halt) => (halt.taken, Some(halt.cause)),
            };
            if taken == halved
                && let (Some((t, from)), None) = (before, cause)
            {
                let step = SuspectInterval { step: taken, steps: 1, t, from, to: stepper.state() };
                unresolved = first(unresolved, self.unresolved_within(&step));
            }
            taken += done;
            if self.constant_rate {
                log_factor = taken as f64 * stepper.sigma().ln();
            } else if single {
                log_factor += done as f64 * stepper.sigma().ln();
            }
            if let Some(cause) = cause {
                let noted = (log_factor, unresolved, sums(&energy));
                if let Some((end, there)) =
                    self.end_within_a_step(observers, Before { stepper: &*stepper, course, noted, taken })
                {
                    (taken, log_factor, stop) = (taken + 1, there.unwrap_or(log_factor), Some(end));
                    break;
                }
                status = Status::Failed { step: taken, t: stepper.time(), cause };
                break;
            }
            over = ended(taken, stepper.time());
            let probed = over || taken == next_probe(taken - 1);
            // Before the step is seen, so that it is not forgotten by who saves the run there.
            if probed {
                if let Some(Defect { claim, size }) = self.violated_claim(&*stepper) {
                    status = Status::FalseClaim { step: taken, claim, size };
                    break;
                }
                let doubt = stepper.doubt().filter(|_| doubts && unresolved.is_none());
                unresolved = first(unresolved, doubt.and_then(|doubt| self.unresolved_within(&doubt)));
                unresolved = first(unresolved, seen_by(&*stepper));
            }
            if let Some(claims) = &mut claims
                && (taken >= next_claims || over)
                && let Some(Defect { claim, size }) =
                    claims.look(self, &*stepper, before.as_ref().filter(|_| done == 1))
            {
                status = Status::FalseClaim { step: taken, claim, size };
                break;
            }
            if let Some(energy) = &mut energy
                && (taken >= next_energy || over)
                && let Some(defect) = energy.look(self, &*stepper, (log_factor, taken))
            {
                unresolved = first(unresolved, Some(UnresolvedStep { step: taken - 1, defect }));
            }
            // Trial runs have seen nothing of what follows.
            if self.ended.is_some_and(|ended| taken > ended + PASSED) {
                unresolved = first(unresolved, Some(UnresolvedStep { step: taken - 1, defect: f64::INFINITY }));
            }
            let at_rest = if over {
                self.rests_until.is_some()
            } else {
                probed && self.is_at_rest(stepper.time(), &stepper.state())
            };
            over |= at_rest;
            if taken >= next_seen || over {
                let before = if done == 1 { before } else { None };
                let end =
                    self.moment(&*stepper, before, (log_factor, unresolved, sums(&energy)), (taken, over && !at_rest));
                stop = observers.step(&end).break_value();
                // It ends within the step.
                if let Some(Stop { at: Some((t, _)), .. }) = stop
                    && let Ok(StepView { log_factor: Some(there), .. }) = end.inside(t)
                {
                    log_factor = there;
                }
            }
            if at_rest {
                stop = stop.or(Some(Stop::here(REST)));
            }
        }
        let (mut t, mut state) = (stepper.time(), stepper.state());
        let error_estimate = self.estimated.then(|| {
            self.error.unwrap_or_else(|| self.distance_from_halves(taken, t, (&state, stepper.last_velocity())))
        });
        if let Some(Stop { by, cause, at }) = stop {
            (t, state) = at.unwrap_or((t, state));
            status = match cause {
                Some(cause) => Status::Failed { step: taken, t, cause },
                None => Status::Stopped { step: taken, t, by },
            };
        }
        let OutputRequest { action, conformal_factor, .. } = self.needs;
        Ok(Outcome {
            status,
            unresolved: first(unresolved, seen_by(&*stepper)),
            steps: taken,
            t,
            q: state.q,
            p: state.p,
            v: self.velocity(t, &state, stepper.last_velocity()).ok(),
            z: action.then_some(state.z),
            log_factor: conformal_factor.then_some(log_factor),
            error_estimate,
            evaluations: stepper.evaluations(),
            z_or_start: state.z,
        })
    }

    /// What observers see after some steps.
    pub(crate) fn moment<'r>(
        &'r self,
        stepper: &'r dyn Stepper<N>,
        before: Option<(f64, PhasePoint<N>)>,
        (log_factor, unresolved, energy): (f64, Option<UnresolvedStep>, EnergySums),
        (k, last): (usize, bool),
    ) -> StepView<'r, N> {
        let log_factor = self.needs.conformal_factor.then_some(log_factor);
        let (t, state, sigma) = (stepper.time(), stepper.state(), stepper.sigma());
        let motion = self;
        StepView {
            k,
            t,
            state,
            sigma,
            log_factor,
            last,
            unresolved,
            energy,
            before,
            motion,
            stepper,
            in_failed_step: false,
        }
    }

    /// A stepper after one step from a time and a state to another time; it is guessed from the curve of a longer one.
    pub(crate) fn step_to(
        &self,
        (t0, from): &(f64, PhasePoint<N>),
        t: f64,
        near: Near<N>,
        curve: Option<&DenseStep<N>>,
    ) -> Result<Box<dyn Stepper<N> + 'p>, StepError> {
        let v = self.velocity(*t0, from, near)?;
        let guess = |run: &mut dyn Stepper<N>| {
            if let Some(curve) = curve {
                run.guess(curve);
            }
        };
        self.advanced((*t0, from), &v, t - t0, (1, t), guess)
    }

    /// The first claim that is false at the state of a stepper.
    fn violated_claim(&self, stepper: &dyn Stepper<N>) -> Option<Defect> {
        let guess = stepper.last_velocity().unwrap_or(self.problem.start.v);
        violated_claim(self.problem.lagrangian, stepper.time(), &stepper.state(), &guess)
    }

    /// Probes the claims along the first steps.
    ///
    /// # Errors
    /// [`InputError::FalseClaim`] with the first claim that does not hold.
    pub(crate) fn probe_first_steps(&self) -> Result<(), InputError> {
        if const { L::PROVED } {
            return Ok(());
        }
        let mut stepper = self.stepper()?;
        let mut taken = 0;
        while taken < self.count.min(FIRST_STEPS) {
            let steps = next_probe(taken).min(self.count) - taken;
            match stepper.advance_until(steps, self.t_end) {
                Ok(done) if done > 0 => taken += done,
                _ => break,
            }
            if let Some(Defect { claim, size }) = self.violated_claim(&*stepper) {
                return Err(InputError::FalseClaim { claim, size });
            }
        }
        Ok(())
    }
}

impl<L: Lagrangian<N>, const N: usize> Motion<N> for Plan<'_, L, N> {
    fn velocity(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<SVector<f64, N>, StepError> {
        // With a constant mass there is one velocity alone.
        let near = near.filter(|_| !self.problem.structure.constant_mass);
        legendre_inverse(self.problem.lagrangian, t, state, &near.unwrap_or(self.problem.start.v)).map(|x| x.v)
    }

    fn energy(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<f64, StepError> {
        let v = self.velocity(t, state, near)?;
        let energy = v.dot(&state.p) - self.problem.lagrangian.value(t, &state.q, &v, state.z);
        if energy.is_finite() { Ok(energy) } else { Err(StepError::NonFinite) }
    }

    fn rates(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<PhasePoint<N>, StepError> {
        let v = self.velocity(t, state, near)?;
        let (value, g) = self.problem.lagrangian.with_gradient(t, &VelocityPoint { q: state.q, v, z: state.z });
        Ok(PhasePoint { q: v, p: g.x + state.p * g.z, z: value })
    }

    /// Of the start, of L there, of the steps, and of what is computed.
    fn fingerprint(&self) -> u64 {
        let Problem { lagrangian, t0, start, state, .. } = self.problem;
        let (value, slope) = lagrangian.with_gradient(*t0, start);
        let numbers = [*t0, self.t_end, self.h, start.z, value, slope.z];
        let vectors = [&start.q, &start.v, &state.p, &slope.x, &slope.y];
        let numbers = numbers.iter().chain(vectors.into_iter().flat_map(|x| x.iter())).map(|x| x.to_bits());
        let name = self.info.name.bytes().map(u64::from);
        let OutputRequest { action, conformal_factor, .. } = self.needs;
        let counts = [N as u64, self.count as u64, action.into(), conformal_factor.into()];
        digest(&numbers.chain(name).chain(counts).collect::<Vec<u64>>())
    }

    fn inside(
        &self,
        from: &(f64, PhasePoint<N>),
        t: f64,
        near: Near<N>,
        curve: Option<&DenseStep<N>>,
    ) -> Result<(PhasePoint<N>, f64), StepError> {
        let run = self.step_to(from, t, near, curve)?;
        Ok((run.state(), run.sigma()))
    }
}
