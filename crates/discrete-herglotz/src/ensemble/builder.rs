//! The builder of an ensemble, and its run.

use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Member, Tally};
use crate::ensemble::members::{Lagrangians, Members};
use crate::ensemble::settings::Settings;
use crate::ensemble::sharded::merge_in_order;
use crate::ensemble::step_control::StepControl;
use crate::ensemble::task::Task;
#[cfg(test)]
use crate::numbers::instructions::Instructions;
use crate::{Integrator, Interrupt, Problem, Start, Steps, Until};
use contact_geom::Lagrangian;
use std::path::PathBuf;

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
///     if let Ok(ending) = &member.ending {
///         farthest = farthest.max(ending.state.q[0]);
///     }
/// })?;
/// println!("{} of {} completed, farthest {farthest}", tally.completed, tally.members);
/// # Ok::<(), discrete_herglotz::ensemble::EnsembleError>(())
/// ```
pub struct Ensemble<'a, M> {
    pub(crate) members: M,
    pub(crate) settings: Settings<'a>,
}

impl<'a, L: Lagrangian<N>, const N: usize> Problem<'a, L, N> {
    /// An ensemble of motions of this Lagrangian from the same initial time; the start of each is a function of its
    /// index.
    pub fn ensemble<X: Into<Start<N>>>(
        &self,
        count: usize,
        start: impl Fn(usize) -> X + Sync + 'a,
    ) -> Ensemble<'a, Lagrangians<'a, L, N>>
    where
        L: Sync,
    {
        Ensemble::new(self.lagrangian, self.t0, count, start)
    }
}

impl<'m, L: Lagrangian<N> + Sync, const N: usize> Ensemble<'_, Lagrangians<'m, L, N>> {
    /// An ensemble of motions of one Lagrangian from the time `t0`; the start of each is a function of its index.
    pub fn new<X: Into<Start<N>>>(
        lagrangian: &'m L,
        t0: f64,
        count: usize,
        start: impl Fn(usize) -> X + Sync + 'm,
    ) -> Self {
        let members = move |index: usize| (lagrangian, start(index).into());
        let all = Self::of(t0, count, members);
        Ensemble { settings: Settings { shared: true, ..all.settings }, ..all }
    }

    /// An ensemble of motions from the time `t0`: the Lagrangian and the start of each are functions of its index, as
    /// in a parameter study. Consecutive members with the same Lagrangian share registers.
    pub fn of<X: Into<Start<N>>>(t0: f64, count: usize, member: impl Fn(usize) -> (&'m L, X) + Sync + 'm) -> Self {
        let members = move |index: usize| {
            let (lagrangian, start) = member(index);
            (lagrangian, start.into())
        };
        let of = Box::new(members);
        let members = Lagrangians { of, t0, integrator: None, selects_integrator: false, length: None };
        Ensemble { members, settings: Settings::new(count) }
    }

    /// Sets the integrator.
    pub fn by(self, integrator: impl Integrator<'m, L, N> + Sync + 'm) -> Self {
        let integrator: Option<Box<dyn Integrator<'m, L, N> + Sync + 'm>> = Some(Box::new(integrator));
        let members = Lagrangians { integrator, selects_integrator: false, ..self.members };
        Ensemble { members, ..self }
    }

    /// Sets the size or the number of the steps.
    pub fn steps(self, steps: Steps) -> Self {
        self.with_length(StepControl::Given(steps))
    }

    pub(crate) fn with_length(self, length: StepControl<L, N>) -> Self {
        Ensemble { members: Lagrangians { length: Some(length), ..self.members }, ..self }
    }
}

impl<'a, M: Members> Ensemble<'a, M> {
    /// Sets the number of threads; the default is the number of processors.
    pub fn threads(self, threads: impl Into<Option<usize>>) -> Self {
        Ensemble { settings: Settings { threads: threads.into(), ..self.settings }, ..self }
    }

    /// Omits the action: it is not computed if z does not act back on the motion.
    pub fn without_action(self) -> Self {
        Ensemble { settings: Settings { action: false, ..self.settings }, ..self }
    }

    /// Omits the check in lanes whether the steps resolve the motion. For steps that are known not to resolve it, each
    /// member would otherwise have a run of its own.
    pub fn without_resolution_check(self) -> Self {
        Ensemble { settings: Settings { check_resolution: false, ..self.settings }, ..self }
    }

    /// Records states of each member in its [rows](Member::rows): the start, the state after every `steps` steps, and
    /// the end, as [`Rows::every`](crate::Rows::every) does. They are recorded in lanes too. Only the rows of members in progress are kept
    /// in memory: of eight shards of 384 members for each thread.
    pub fn rows_every(self, steps: usize) -> Self {
        Ensemble { settings: Settings { rows: Some(steps), ..self.settings }, ..self }
    }

    /// Keeps a file of the completed shards. If the file exists, the ensemble is resumed: the fold is called again with
    /// the members of these shards, bitwise the same, and the others are computed. A process that is killed loses the
    /// shards in progress. Members that failed are run again to find the cause.
    pub fn checkpoint(self, path: impl Into<PathBuf>) -> Self {
        Ensemble { settings: Settings { checkpoint: Some(path.into()), ..self.settings }, ..self }
    }

    /// Sets a function that is called on the calling thread with the completed fraction of the members.
    pub fn progress(self, report: impl Fn(f64) + 'a) -> Self {
        Ensemble { settings: Settings { progress: Some(Box::new(report)), ..self.settings }, ..self }
    }

    /// Sets an interrupt that is polled during the run: when it requests the end, the members in progress and those
    /// that follow end at their current state, with [`Status::Stopped`](crate::Status::Stopped) by an [`INTERRUPTION`](crate::INTERRUPTION), or
    /// with [`InputError::Interrupted`](crate::InputError::Interrupted) if they have not started.
    pub fn with_interrupt(self, interrupt: impl Into<Option<Interrupt<'a>>>) -> Self {
        Ensemble { settings: Settings { interrupt: interrupt.into(), ..self.settings }, ..self }
    }

    /// Restricts the run to these instructions.
    #[cfg(test)]
    pub(crate) fn only(self, instructions: Instructions) -> Self {
        Ensemble { settings: Settings { instructions, ..self.settings }, ..self }
    }

    /// Runs the ensemble, and calls the fold with each completed member, in the order of the index, on this thread.
    ///
    /// # Errors
    /// [`EnsembleError`]: no members or threads; an error for which the run of every member is refused, or a false
    /// claim of structure that was found at some of them; a checkpoint of another ensemble, a damaged one, or one that
    /// cannot be written. If a single member cannot start, or its motion fails, the fold is called with the cause, and
    /// the other members continue.
    pub fn run(&self, until: Until, mut fold: impl FnMut(&Member)) -> Result<Tally, EnsembleError> {
        let sharded = self.in_shards(until)?;
        let threads = self.settings.some_threads()?;
        merge_in_order(&mut self.merge(&sharded, &mut fold)?, &sharded, threads)
    }

    /// Checks the common input of all members, and all input of some of them.
    pub(crate) fn task(&self, until: Until, observed: bool) -> Result<Task<'_>, EnsembleError> {
        if self.settings.count == 0 {
            return Err(EnsembleError::Empty);
        }
        self.members.is_complete().map_err(|cause| EnsembleError::Member { index: 0, cause })?;
        Task::checked(&self.members, &self.settings, until, observed)
    }
}
