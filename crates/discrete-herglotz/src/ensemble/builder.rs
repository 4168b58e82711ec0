//! An ensemble as it is put together, and its run.

use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Member, Tally};
use crate::ensemble::shards;
use crate::ensemble::single::Common;
use crate::ensemble::step_control::StepControl;
use crate::ensemble::task::{SHARD, Task};
use crate::numbers::instructions::Instructions;
use crate::run::rows;
use crate::{InputError, Integrator, Interrupt, Problem, Rows, Start, Steps, Until};
use contact_geom::Lagrangian;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// The members of an ensemble that get all checks of a run before it begins.
const SAMPLE: usize = 4;

/// A member by its index: its Lagrangian and its start.
type MemberOf<'a, L, const N: usize> = Box<dyn Fn(usize) -> (&'a L, Start<N>) + Sync + 'a>;

/// Many motions, by one integrator and the same steps.
///
/// Where the [integrator](Integrator::batch_kernel) has a kernel for it the motions lie in the lanes of the processor's vector registers, so that a whole
/// pack takes a step together: every [`SplittingScheme`] for separable Lagrangians with linear drag, and [`GaussCollocation`] for those
/// of a constant rate. All other members, and those that a lane cannot finish (what is not finite, an iteration that does not contract, a
/// formula that branches), have a run of their own. Packs are shared among threads, in shards; the fold is given the members in the order of
/// their index, on the thread of the caller, while others are computed, so that the memory does not grow with the count. What a member is
/// drawn from should be a function of its index, as a random number seeded with it.
///
/// A member's bits depend on that member alone: not on the number of threads, the width of the registers, its neighbours or the order. By
/// splittings they are those of a single run, as long as L is made of sums, products, quotients and roots. The sine and the cosine of a lane are within 2
/// units in the last place, as those of the standard library are within one, so that with them a member differs from a single run by what
/// its rounding makes of it. By collocation both are exact but for rounding.
///
/// Of what a single run looks at: the claims of the structure are probed for some members, the first and the last among them, and not along
/// all motions; a start must be finite, a motion must end finite. Whether steps resolve the motion is looked at in lanes at one drift of each
/// step of a splitting, and at the accelerations of each step of collocation. A member with a step in doubt has a run of its own
/// too, and the [`unresolved`](Ending::unresolved) of that; its state is that of the lane.
///
/// ```
/// use contact_geom::{VelocityPoint, systems::Pendulum};
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
    /// The steps from one recorded row to the next.
    pub(crate) rows: Option<usize>,
    pub(crate) watched: bool,
    pub(crate) threads: Option<usize>,
    pub(crate) instructions: Instructions,
    pub(crate) checkpoint: Option<PathBuf>,
    pub(crate) interrupt: Option<Interrupt<'a>>,
    pub(crate) progress: Option<Box<dyn Fn(f64) + 'a>>,
}

impl<'a, L: Lagrangian<N>, const N: usize> Problem<'a, L, N> {
    /// So many motions of it from other starts, at the same time: each a function of its index.
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
    /// So many motions of one Lagrangian from the time `t0`: the start of each is a function of its index.
    pub fn new<X: Into<Start<N>>>(
        lagrangian: &'a L,
        t0: f64,
        count: usize,
        start: impl Fn(usize) -> X + Sync + 'a,
    ) -> Self {
        let members = move |index: usize| (lagrangian, start(index).into());
        Ensemble { shared: true, ..Self::of(t0, count, members) }
    }

    /// So many motions from the time `t0`: Lagrangian and start of each are functions of its index, as in a study of parameters. Those in
    /// sequence that have the same Lagrangian share their registers.
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
            watched: true,
            threads: None,
            instructions: Instructions::new(),
            checkpoint: None,
            interrupt: None,
            progress: None,
        }
    }

    /// The same by this integrator.
    pub fn by(self, integrator: impl Integrator<'a, L, N> + Sync + 'a) -> Self {
        Ensemble { integrator: Some(Box::new(integrator)), ..self }
    }

    /// The same by steps of a given length or number.
    pub fn steps(self, steps: Steps) -> Self {
        Ensemble { length: Some(StepControl::Given(steps)), ..self }
    }

    /// The same on so many threads; as many as there are processors where nothing is said.
    pub fn threads(self, threads: usize) -> Self {
        Ensemble { threads: Some(threads), ..self }
    }

    /// Without the action: where z does not act back on the motion it is not computed.
    pub fn without_action(self) -> Self {
        Ensemble { action: false, ..self }
    }

    /// Without a look in lanes whether the steps resolve the motion. Where they do not, as is known, each member would else have a run of its
    /// own.
    pub fn unwatched(self) -> Self {
        Ensemble { watched: false, ..self }
    }

    /// With the states of each member in its [rows](Member::rows): the start, the state after every so many steps, and the end, as by
    /// [`Rows::every`]. They are recorded in lanes too; at a time there are those of the members under way alone, of eight shards of 384
    /// for each thread.
    pub fn rows_every(self, steps: usize) -> Self {
        Ensemble { rows: Some(steps), ..self }
    }

    /// With a file of the shards that are done. Where it is there already, the ensemble goes on with the others: the fold is given the members of those
    /// again, to the last bit, and the rest is computed. A process that is killed loses the shards under way. Members that have failed
    /// are run again for their cause.
    pub fn checkpoint(self, path: impl Into<PathBuf>) -> Self {
        Ensemble { checkpoint: Some(path.into()), ..self }
    }

    /// With a function that is told, on the thread of the caller, which part of the members is done.
    pub fn progress(self, tell: impl Fn(f64) + 'a) -> Self {
        Ensemble { progress: Some(Box::new(tell)), ..self }
    }

    /// With a question that is asked from time to time: once it is true, the members under way and those that follow end where they are, with a
    /// [`Status::Stopped`] by an [`INTERRUPTION`](crate::INTERRUPTION), or with [`InputError::Interrupted`] where they have not begun.
    pub fn with_interrupt(self, interrupt: Interrupt<'a>) -> Self {
        Ensemble { interrupt: Some(interrupt), ..self }
    }

    /// Only with these instructions.
    #[cfg(test)]
    pub(crate) fn only(self, instructions: Instructions) -> Self {
        Ensemble { instructions, ..self }
    }

    /// Runs it, and hands each member at its end to a fold, in the order of the index, on this thread.
    ///
    /// # Errors
    /// [`EnsembleError`]: no members or threads; what every member's run is refused for, or a false claim of the Lagrangian's structure, found at some
    /// of them; a checkpoint of another ensemble, a damaged one, or one that cannot be written. A member that cannot begin by itself, or
    /// whose motion fails, is handed to the fold with the cause, and the others go on.
    pub fn run(&self, until: Until, mut fold: impl FnMut(&Member<N>)) -> Result<Tally, EnsembleError> {
        let sharded = self.in_shards(until)?;
        let threads = self.some_threads()?;
        let mut merge = self.merge(&sharded)?;
        merge.resume(&mut fold)?;
        // Processes that shared the work may have left gaps in a checkpoint.
        let missing: Vec<usize> = (merge.handed_on()..sharded.count()).filter(|shard| !merge.has(*shard)).collect();
        let mut error = None;
        shards::in_order(
            threads,
            missing.len(),
            |i| (missing[i], sharded.task.shard(missing[i])),
            |(index, shard)| match merge.add_shard(index, shard, &mut fold) {
                Ok(()) => ControlFlow::Continue(()),
                Err(cause) => {
                    error = Some(cause);
                    ControlFlow::Break(())
                }
            },
        );
        error.map_or(Ok(merge.tally()), Err)
    }

    /// Tells how many of the shards are done.
    pub(crate) fn tell(&self, done: usize, shards: usize) {
        if let Some(tell) = &self.progress {
            tell(done as f64 / shards as f64);
        }
    }

    /// The threads, one at least.
    pub(crate) fn some_threads(&self) -> Result<usize, EnsembleError> {
        let processors = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        match self.threads.unwrap_or_else(processors) {
            0 => Err(EnsembleError::Threads),
            threads => Ok(threads),
        }
    }

    /// Members spread over the ensemble, the first and the last among them.
    pub(crate) fn sample(&self) -> impl Iterator<Item = usize> + use<L, N> {
        let (count, sample) = (self.count, self.count.min(SAMPLE));
        (0..sample).map(move |i| i * (count - 1) / (sample - 1).max(1))
    }

    /// Checks what all members have in common, and some of them wholly.
    pub(crate) fn task(&self, until: Until) -> Result<Task<'_, 'a, L, N>, EnsembleError> {
        if self.count == 0 {
            return Err(EnsembleError::Empty);
        }
        let refused = |cause| EnsembleError::Member { index: 0, cause };
        let Some(integrator) = self.integrator.as_deref() else { return Err(refused(InputError::NoIntegrator)) };
        let Some(length) = self.length else { return Err(refused(InputError::NoSteps)) };
        let common = Common { t0: self.t0, length, until, action: self.action, rows: self.rows };
        if let Some(stride) = self.rows {
            Rows::<N>::every(stride).map_err(refused)?;
        }
        let (mut planned, mut refused) = (None, None);
        for index in self.sample() {
            let (lagrangian, start) = (self.members)(index);
            match common.plan(integrator, lagrangian, start, self.interrupt) {
                Ok(plan) if planned.is_some_and(|(_, most): (usize, (f64, usize))| plan.1 <= most.1) => {}
                Ok(plan) => planned = Some((index, plan)),
                Err(cause @ (InputError::FalseClaim { .. } | InputError::Interrupted)) => {
                    return Err(EnsembleError::Member { index, cause });
                }
                Err(cause) => refused = refused.or(Some(EnsembleError::Member { index, cause })),
            }
        }
        let Some((index, mut plan)) = planned else { return Err(refused.unwrap_or(EnsembleError::Empty)) };
        let refused = |cause| EnsembleError::Member { index, cause };
        if length.wanted().is_some() && integrator.batch_kernel().is_some() {
            let length = StepControl::Given(Steps::Count(plan.1 + plan.1.div_ceil(8)));
            let (lagrangian, start) = (self.members)(index);
            plan = Common { length, ..common }.plan(integrator, lagrangian, start, self.interrupt).map_err(refused)?;
        }
        rows::check(common.rows_of(plan.1).saturating_mul(self.count.min(SHARD))).map_err(refused)?;
        let (members, count, instructions, watched) =
            (&*self.members, self.count, self.instructions, self.watched && length.wanted().is_none());
        let mut task = Task {
            members,
            count,
            instructions,
            watched,
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
