//! The builder of an ensemble, and its run.

use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Member, Tally};
use crate::ensemble::shards;
use crate::ensemble::single::Common;
use crate::ensemble::step_control::StepControl;
use crate::ensemble::task::{MEMBERS_PER_SHARD, Task};
use crate::numbers::instructions::Instructions;
use crate::run::rows;
use crate::{InputError, Integrator, Interrupt, Problem, Rows, Start, Steps, Until};
use contact_geom::Lagrangian;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// The number of steps for which one is added to the largest number of the checked members: an eighth, since other
/// members may need more. The few that need still more have a run of their own.
const STEPS_PER_EXTRA_STEP: usize = 8;

/// The largest number of members of an ensemble that get all checks of a run before it starts: errors that all members
/// share, or that depend on the index, show in them, and the checks of all members would cost as much as their steps.
const MAX_CHECKED_MEMBERS: usize = 4;

/// The Lagrangian and the start of a member, as a function of its index.
type MemberOf<'a, L, const N: usize> = Box<dyn Fn(usize) -> (&'a L, Start<N>) + Sync + 'a>;

/// Many motions with one integrator and the same steps.
///
/// If the [integrator](Integrator::batch_kernel) has a kernel for them, the motions are placed in the SIMD lanes of
/// vector registers, so that a whole pack takes a step together: for every [`SplittingScheme`](crate::SplittingScheme) if the Lagrangian is
/// separable with linear drag, and for [`GaussCollocation`](crate::GaussCollocation) if it is separable with a constant rate. All other members,
/// and those that a lane cannot finish (a state that is not finite, an iteration that does not converge, a formula that
/// branches), have a run of their own. Packs are distributed over threads in shards. The fold is called with the
/// members in the order of their index, on the calling thread, while others are computed, so that memory does not grow
/// with the number of members. The start of a member should be a function of its index, for example with a random
/// number generator that is seeded with it.
///
/// The result of a member depends bitwise on that member only: not on the number of threads, the register width, the
/// other members or the order. For splittings it is bitwise that of a single run, if L consists of sums, products,
/// quotients and square roots. The sine and cosine in lanes are accurate to 2 units in the last place, those of the
/// standard library to one, so that with them a member differs from a single run by the effect of this round-off. For
/// collocation both are accurate up to round-off.
///
/// Not all checks of a single run are made: the claims of structure are checked for some members, among them the first
/// and the last, and not along all motions; a start and a final state must be finite. In lanes, whether the steps
/// resolve the motion is checked at one drift of each step of a splitting, and from the accelerations of each step of
/// collocation. A member with a suspect step also has a run of its own, from which its
/// [`unresolved`](crate::ensemble::Ending::unresolved) is taken; its state is that of the lane.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Ensemble, SplittingScheme, Steps, Until};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let start = |i: usize| VelocityPoint::new([0.001 * i as f64], [0.5], 0.0);
/// let ensemble = Ensemble::new(&pendulum, 0.0, 1000, start).by(SplittingScheme::BLANES_MOAN_6).steps(Steps::Size(0.25));
/// let mut farthest = 0.0f64;
/// let tally = ensemble.run(Until::Time(10.0), |member| {
///     if let Ok(ending) = member.ending {
///         farthest = farthest.max(ending.state.q[0]);
///     }
/// })?;
/// println!("{} of {} completed, farthest {farthest}", tally.completed, tally.members);
/// # Ok::<(), discrete_herglotz::ensemble::EnsembleError>(())
/// ```
pub struct Ensemble<'a, L, const N: usize> {
    pub(crate) members: MemberOf<'a, L, N>,
    /// Whether all members have one Lagrangian.
    pub(crate) shared: bool,
    pub(crate) count: usize,
    pub(crate) t0: f64,
    pub(crate) integrator: Option<Box<dyn Integrator<'a, L, N> + Sync + 'a>>,
    pub(crate) length: Option<StepControl<L, N>>,
    pub(crate) action: bool,
    /// The number of steps from one recorded row to the next.
    pub(crate) rows: Option<usize>,
    pub(crate) check_resolution: bool,
    pub(crate) threads: Option<usize>,
    pub(crate) instructions: Instructions,
    pub(crate) checkpoint: Option<PathBuf>,
    pub(crate) interrupt: Option<Interrupt<'a>>,
    pub(crate) progress: Option<Box<dyn Fn(f64) + 'a>>,
}

impl<'a, L: Lagrangian<N>, const N: usize> Problem<'a, L, N> {
    /// An ensemble of motions of this Lagrangian from the same initial time; the start of each is a function of its
    /// index.
    pub fn ensemble<X: Into<Start<N>>>(
        &self,
        count: usize,
        start: impl Fn(usize) -> X + Sync + 'a,
    ) -> Ensemble<'a, L, N>
    where
        L: Sync,
    {
        Ensemble::new(self.lagrangian, self.t0, count, start)
    }
}

impl<'a, L: Lagrangian<N> + Sync, const N: usize> Ensemble<'a, L, N> {
    /// An ensemble of motions of one Lagrangian from the time `t0`; the start of each is a function of its index.
    pub fn new<X: Into<Start<N>>>(
        lagrangian: &'a L,
        t0: f64,
        count: usize,
        start: impl Fn(usize) -> X + Sync + 'a,
    ) -> Self {
        let members = move |index: usize| (lagrangian, start(index).into());
        Ensemble { shared: true, ..Self::of(t0, count, members) }
    }

    /// An ensemble of motions from the time `t0`: the Lagrangian and the start of each are functions of its index, as
    /// in a parameter study. Consecutive members with the same Lagrangian share registers.
    pub fn of<X: Into<Start<N>>>(t0: f64, count: usize, member: impl Fn(usize) -> (&'a L, X) + Sync + 'a) -> Self {
        let members = move |index: usize| {
            let (lagrangian, start) = member(index);
            (lagrangian, start.into())
        };
        Ensemble {
            members: Box::new(members),
            shared: false,
            count,
            t0,
            integrator: None,
            length: None,
            action: true,
            rows: None,
            check_resolution: true,
            threads: None,
            instructions: Instructions::new(),
            checkpoint: None,
            interrupt: None,
            progress: None,
        }
    }

    /// Sets the integrator.
    pub fn by(self, integrator: impl Integrator<'a, L, N> + Sync + 'a) -> Self {
        Ensemble { integrator: Some(Box::new(integrator)), ..self }
    }

    /// Sets the size or the number of the steps.
    pub fn steps(self, steps: Steps) -> Self {
        Ensemble { length: Some(StepControl::Given(steps)), ..self }
    }

    /// Sets the number of threads; the default is the number of processors.
    pub fn threads(self, threads: usize) -> Self {
        Ensemble { threads: Some(threads), ..self }
    }

    /// Omits the action: it is not computed if z does not act back on the motion.
    pub fn without_action(self) -> Self {
        Ensemble { action: false, ..self }
    }

    /// Omits the check in lanes whether the steps resolve the motion. For steps that are known not to resolve it, each
    /// member would otherwise have a run of its own.
    pub fn without_resolution_check(self) -> Self {
        Ensemble { check_resolution: false, ..self }
    }

    /// Records states of each member in its [rows](Member::rows): the start, the state after every `steps` steps, and
    /// the end, as [`Rows::every`] does. They are recorded in lanes too. Only the rows of members in progress are kept
    /// in memory: of eight shards of 384 members for each thread.
    pub fn rows_every(self, steps: usize) -> Self {
        Ensemble { rows: Some(steps), ..self }
    }

    /// Keeps a file of the completed shards. If the file exists, the ensemble is resumed: the fold is called again with
    /// the members of these shards, bitwise the same, and the others are computed. A process that is killed loses the
    /// shards in progress. Members that failed are run again to find the cause.
    pub fn checkpoint(self, path: impl Into<PathBuf>) -> Self {
        Ensemble { checkpoint: Some(path.into()), ..self }
    }

    /// Sets a function that is called on the calling thread with the completed fraction of the members.
    pub fn progress(self, report: impl Fn(f64) + 'a) -> Self {
        Ensemble { progress: Some(Box::new(report)), ..self }
    }

    /// Sets an interrupt that is polled during the run: when it requests the end, the members in progress and those
    /// that follow end at their current state, with [`Status::Stopped`](crate::Status::Stopped) by an [`INTERRUPTION`](crate::INTERRUPTION), or
    /// with [`InputError::Interrupted`] if they have not started.
    pub fn with_interrupt(self, interrupt: Interrupt<'a>) -> Self {
        Ensemble { interrupt: Some(interrupt), ..self }
    }

    /// Restricts the run to these instructions.
    #[cfg(test)]
    pub(crate) fn only(self, instructions: Instructions) -> Self {
        Ensemble { instructions, ..self }
    }

    /// Runs the ensemble, and calls the fold with each completed member, in the order of the index, on this thread.
    ///
    /// # Errors
    /// [`EnsembleError`]: no members or threads; an error for which the run of every member is refused, or a false
    /// claim of structure that was found at some of them; a checkpoint of another ensemble, a damaged one, or one that
    /// cannot be written. If a single member cannot start, or its motion fails, the fold is called with the cause, and
    /// the other members continue.
    pub fn run(&self, until: Until, mut fold: impl FnMut(&Member<N>)) -> Result<Tally, EnsembleError> {
        let sharded = self.in_shards(until)?;
        let threads = self.some_threads()?;
        let mut merge = self.merge(&sharded, &mut fold)?;
        // Several processes may have left gaps in a checkpoint.
        let missing = merge.missing();
        let mut error = None;
        shards::in_order(
            threads,
            missing.len(),
            |i| (missing[i], sharded.task.shard(missing[i])),
            |(index, shard)| match merge.add_shard(index, shard) {
                Ok(()) => ControlFlow::Continue(()),
                Err(cause) => {
                    error = Some(cause);
                    ControlFlow::Break(())
                }
            },
        );
        error.map_or(Ok(merge.tally()), Err)
    }

    /// Reports how many of the shards are completed.
    pub(crate) fn report_progress(&self, done: usize, shards: usize) {
        if let Some(report) = &self.progress {
            report(done as f64 / shards as f64);
        }
    }

    /// The number of threads; at least one.
    pub(crate) fn some_threads(&self) -> Result<usize, EnsembleError> {
        let processors = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        match self.threads.unwrap_or_else(processors) {
            0 => Err(EnsembleError::Threads),
            threads => Ok(threads),
        }
    }

    /// Members distributed over the ensemble, among them the first and the last.
    pub(crate) fn sample(&self) -> impl Iterator<Item = usize> + use<L, N> {
        let (count, sample) = (self.count, self.count.min(MAX_CHECKED_MEMBERS));
        (0..sample).map(move |i| i * (count - 1) / (sample - 1).max(1))
    }

    /// Checks the common input of all members, and all input of some of them.
    pub(crate) fn task(&self, until: Until) -> Result<Task<'_, 'a, L, N>, EnsembleError> {
        if self.count == 0 {
            return Err(EnsembleError::Empty);
        }
        let refused = |cause| EnsembleError::Member { index: 0, cause };
        let Some(integrator) = self.integrator.as_deref() else { return Err(refused(InputError::NoIntegrator)) };
        let Some(length) = self.length else { return Err(refused(InputError::NoSteps)) };
        let common = Common { t0: self.t0, length, until, action: self.action, rows: self.rows };
        if let Some(stride) = self.rows {
            Rows::every(stride).map_err(refused)?;
        }
        let (mut planned, mut refused) = (None, None);
        for index in self.sample() {
            let (lagrangian, start) = (self.members)(index);
            match common.plan(integrator, lagrangian, start, self.interrupt) {
                Ok(plan) if planned.is_some_and(|(_, largest): (usize, (f64, usize))| plan.1 <= largest.1) => {}
                Ok(plan) => planned = Some((index, plan)),
                Err(cause @ (InputError::FalseClaim { .. } | InputError::Interrupted)) => {
                    return Err(EnsembleError::Member { index, cause });
                }
                Err(cause) => refused = refused.or(Some(EnsembleError::Member { index, cause })),
            }
        }
        let Some((index, mut plan)) = planned else { return Err(refused.unwrap_or(EnsembleError::Empty)) };
        let refused = |cause| EnsembleError::Member { index, cause };
        if length.requested_error().is_some() && integrator.batch_kernel().is_some() {
            let length = StepControl::Given(Steps::Count(plan.1 + plan.1.div_ceil(STEPS_PER_EXTRA_STEP)));
            let (lagrangian, start) = (self.members)(index);
            plan = Common { length, ..common }.plan(integrator, lagrangian, start, self.interrupt).map_err(refused)?;
        }
        rows::check(common.rows_of(plan.1).saturating_mul(self.count.min(MEMBERS_PER_SHARD))).map_err(refused)?;
        let (members, count, instructions, check_resolution) = (
            &*self.members,
            self.count,
            self.instructions,
            self.check_resolution && length.requested_error().is_none(),
        );
        let mut task = Task {
            members,
            count,
            instructions,
            check_resolution,
            integrator,
            common,
            plan,
            interrupt: self.interrupt,
            kernels: None,
            fingerprint: 0,
        };
        task.fingerprint = task.fingerprint_of(self.sample());
        if self.shared {
            let (lagrangian, start) = members(index);
            task.kernels = Some(task.kernels_of(lagrangian, start.state(lagrangian, self.t0).as_ref()));
        }
        Ok(task)
    }
}
