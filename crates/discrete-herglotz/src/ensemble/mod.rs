//! Ensembles: many motions at once, each in a lane of a vector register.

mod accuracy;
mod checkpoint;
mod error;
mod gauss;
mod judge;
mod lane;
mod member;
mod observed;
mod sharded;
mod shards;
mod single;
mod splitting;
#[cfg(test)]
mod tests;

pub use error::EnsembleError;
pub use member::{Ending, Member, Tally};
pub use observed::ObservedEnsemble;
pub use sharded::{Merge, ShardedEnsemble};

use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::{branched, forget_branches};
use crate::numbers::state_words::digest;
use crate::run::may_drift;
use crate::run::rows;
use crate::switching::has_switching_functions;
use crate::{BatchKernel, InputError, Integrator, Interrupt, Observer, Problem, Rows, Start, Status, Steps, Until};
use accuracy::StepControl;
use contact_geom::{ChartVector, Derivatives, Lagrangian, PhasePoint, VelocityPoint, legendre};
use gauss::GaussPacks;
use lane::{Lane, LaneOptions};
use single::Common;
use splitting::SplittingPacks;
use std::num::NonZeroUsize;
use std::ops::{ControlFlow, Range};
use std::path::PathBuf;

/// The members that are computed, kept and handed on together: whole packs of one to four registers of at most eight lanes.
const SHARD: usize = 384;

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
/// # Ok::<(), discrete_herglotz::EnsembleError>(())
/// ```
pub struct Ensemble<'a, L, const N: usize> {
    members: MemberOf<'a, L, N>,
    /// Whether all members have one Lagrangian.
    shared: bool,
    count: usize,
    t0: f64,
    integrator: Option<Box<dyn Integrator<'a, L, N> + Sync + 'a>>,
    length: Option<StepControl<L, N>>,
    action: bool,
    /// The steps from one recorded row to the next.
    rows: Option<usize>,
    watched: bool,
    threads: Option<usize>,
    instructions: Instructions,
    checkpoint: Option<PathBuf>,
    interrupt: Option<Interrupt<'a>>,
    progress: Option<Box<dyn Fn(f64) + 'a>>,
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
    fn only(self, instructions: Instructions) -> Self {
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
    fn tell(&self, done: usize, shards: usize) {
        if let Some(tell) = &self.progress {
            tell(done as f64 / shards as f64);
        }
    }

    /// The threads, one at least.
    fn some_threads(&self) -> Result<usize, EnsembleError> {
        let processors = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        match self.threads.unwrap_or_else(processors) {
            0 => Err(EnsembleError::Threads),
            threads => Ok(threads),
        }
    }

    /// Members spread over the ensemble, the first and the last among them.
    fn sample(&self) -> impl Iterator<Item = usize> + use<L, N> {
        let (count, sample) = (self.count, self.count.min(SAMPLE));
        (0..sample).map(move |i| i * (count - 1) / (sample - 1).max(1))
    }

    /// Checks what all members have in common, and some of them wholly.
    fn task(&self, until: Until) -> Result<Task<'_, 'a, L, N>, EnsembleError> {
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

/// How the members of one Lagrangian are advanced.
enum Kernel<'a, L, const N: usize> {
    OneByOne,
    Splitting(SplittingPacks<'a, L, N>),
    Gauss(GaussPacks<'a, L, N>),
}

impl<L: Lagrangian<N>, const N: usize> Kernel<'_, L, N> {
    /// Whether a motion is left to a run of its own, since lanes would lose what its steps add.
    fn leaves(&self, state: &PhasePoint<N>) -> bool {
        match self {
            Kernel::Splitting(packs) => packs.is_tiny(state),
            // Their sums are in two parts.
            Kernel::Gauss(_) | Kernel::OneByOne => false,
        }
    }

    fn run(&self, instructions: Instructions, lanes: &mut [Lane<N>], action: bool, wants: LaneOptions) {
        match self {
            Kernel::OneByOne => {}
            Kernel::Splitting(packs) => packs.run(instructions, lanes, action, wants),
            Kernel::Gauss(packs) => packs.run(instructions, lanes, action, wants),
        }
    }
}

/// A run of an ensemble after its checks.
pub(crate) struct Task<'e, 'a, L, const N: usize> {
    members: &'e (dyn Fn(usize) -> (&'a L, Start<N>) + Sync + 'a),
    count: usize,
    instructions: Instructions,
    watched: bool,
    integrator: &'e (dyn Integrator<'a, L, N> + Sync + 'a),
    common: Common<L, N>,
    /// The step, and how many.
    plan: (f64, usize),
    interrupt: Option<Interrupt<'a>>,
    /// Those of all members, where they have one Lagrangian.
    kernels: Option<[Kernel<'a, L, N>; 2]>,
    fingerprint: u64,
}

/// The members of a shard at their ends.
pub(crate) struct Shard<const N: usize> {
    members: Vec<Member<N>>,
    batch_kernel: usize,
    /// Whether members that have not completed say why; those that were read from words do not.
    with_causes: bool,
}

impl<'a, L: Lagrangian<N> + Sync, const N: usize> Task<'_, 'a, L, N> {
    /// The kernels for a Lagrangian, by what is read of it at a state: by the steps, and by twice as many where they are judged by those.
    fn kernels_of(&self, lagrangian: &'a L, state: Option<&PhasePoint<N>>) -> [Kernel<'a, L, N>; 2] {
        let (h, steps) = self.plan;
        let finer = self.common.length.wanted().map(|_| self.kernel_of(lagrangian, state, (0.5 * h, 2 * steps)));
        [self.kernel_of(lagrangian, state, self.plan), finer.unwrap_or(Kernel::OneByOne)]
    }

    fn kernel_of(&self, lagrangian: &'a L, state: Option<&PhasePoint<N>>, plan: (f64, usize)) -> Kernel<'a, L, N> {
        let (structure, Some(state)) = (lagrangian.structure(), state) else { return Kernel::OneByOne };
        // Steps end on kinks at times of their own in each member.
        let start = VelocityPoint { q: state.q, v: state.p, z: state.z };
        if has_switching_functions(lagrangian, self.common.t0, &start) != Ok(false) {
            return Kernel::OneByOne;
        }
        let kernel = match self.integrator.batch_kernel() {
            Some(BatchKernel::Splitting(scheme)) if structure.separable && structure.is_affine_in_z() => {
                SplittingPacks::new(lagrangian, &scheme, plan, self.common.t0, state)
                    .map(|packs| Kernel::Splitting(packs.with_interrupt(self.interrupt)))
            }
            Some(BatchKernel::Gauss { stages }) if structure.separable && structure.has_constant_rate() => {
                GaussPacks::new(lagrangian, stages, plan, self.common.t0, state)
                    .map(|packs| Kernel::Gauss(packs.with_interrupt(self.interrupt)))
            }
            _ => Ok(Kernel::OneByOne),
        };
        // Where L cannot be read a run of the member says why.
        kernel.unwrap_or(Kernel::OneByOne)
    }

    /// What the ensemble is, by some of its members: of the integrator, the steps, starts, and of L there.
    fn fingerprint_of(&self, sample: impl Iterator<Item = usize>) -> u64 {
        let Common { t0, action, length, .. } = self.common;
        let mut words = vec![N as u64, self.count as u64, t0.to_bits(), action.into(), self.plan.0.to_bits()];
        words.extend([self.plan.1, self.common.rows.unwrap_or(0)].map(|x| x as u64));
        words.push(length.wanted().unwrap_or(0.0).to_bits());
        words.extend(self.integrator.info().name.bytes().map(u64::from));
        for index in sample {
            let (lagrangian, start) = (self.members)(index);
            let (q, y, z) = match start {
                Start::Velocity(x) => (x.q, x.v, x.z),
                Start::Momentum(x, _) => (x.q, x.p, x.z),
            };
            let (value, slope) = lagrangian.with_gradient(t0, &VelocityPoint { q, v: y, z });
            let vectors = [&q, &y, &slope.x, &slope.y];
            let numbers = vectors.into_iter().flat_map(|x| x.iter().copied()).chain([z, value, slope.z]);
            words.extend(numbers.map(f64::to_bits));
        }
        digest(&words)
    }

    /// The indices of the members of a shard; none where there is no such shard.
    fn members_of(&self, shard: usize) -> Range<usize> {
        let first = shard.saturating_mul(SHARD).min(self.count);
        first..self.count.min(first.saturating_add(SHARD))
    }

    /// Runs members again that have not completed.
    fn run_again(&self, shard: &mut Shard<N>) {
        for member in shard.members.iter_mut().filter(|member| member.ending.is_err()) {
            *member = self.by_itself(member.index, None::<&mut Rows<'_, N>>);
        }
    }

    /// Runs a member by itself, under the eyes of an observer.
    fn by_itself(&self, index: usize, observer: Option<&mut impl Observer<N>>) -> Member<N> {
        let (lagrangian, start) = (self.members)(index);
        self.common.run(self.integrator, lagrangian, (index, start), observer, self.interrupt)
    }

    /// Runs the members of a shard.
    fn shard(&self, shard: usize) -> Shard<N> {
        let range = self.members_of(shard);
        let starts: Vec<_> = range.clone().map(self.members).collect();
        let member = |index| Member { index, ending: Err(InputError::NoSteps), rows: Vec::new() };
        let mut members: Vec<_> = range.map(member).collect();
        let mut batch_kernel = 0;
        let mut from = 0;
        // Members in sequence that have one Lagrangian.
        for group in starts.chunk_by(|a, b| std::ptr::eq(a.0, b.0)) {
            batch_kernel += self.group(group, &mut members[from..from + group.len()]);
            from += group.len();
        }
        Shard { members, batch_kernel, with_causes: true }
    }

    /// Runs members of one Lagrangian; returns how many of them in lanes.
    fn group(&self, starts: &[(&'a L, Start<N>)], members: &mut [Member<N>]) -> usize {
        let Some(lagrangian) = starts.first().map(|start| start.0) else { return 0 };
        let (Common { t0, action, rows, length, .. }, (h, steps)) = (self.common, self.plan);
        let (mut places, mut states) = (Vec::with_capacity(starts.len()), Vec::with_capacity(starts.len()));
        let mut own = None;
        let [kernel, finer] = self.kernels.as_ref().unwrap_or_else(|| {
            let state = starts.iter().find_map(|(_, start)| start.state(lagrangian, t0));
            own.insert(self.kernels_of(lagrangian, state.as_ref()))
        });
        if !matches!(kernel, Kernel::OneByOne) {
            for (place, (_, start)) in starts.iter().enumerate() {
                if let Some(state) = start.state(lagrangian, t0)
                    && !kernel.leaves(&state)
                {
                    places.push(place);
                    states.push(state);
                }
            }
        }
        let most_rows = rows.map(|_| self.common.rows_of(steps));
        let mut lanes: Vec<_> = states.iter().map(|state| Lane::new(t0, *state, most_rows, action)).collect();
        let mut done = [false; SHARD];
        let mut batch_kernel = 0;
        let wants = LaneOptions { rows, watched: self.watched };
        forget_branches();
        if let Some(wanted) = length.wanted() {
            let mut ends: Vec<_> = states.iter().map(|state| Lane::new(t0, *state, None, false)).collect();
            finer.run(self.instructions, &mut ends, false, LaneOptions { rows: None, watched: false });
            kernel.run(self.instructions, &mut lanes, action, wants);
            accuracy::refuse_beyond(wanted, &mut lanes, &ends);
        } else {
            kernel.run(self.instructions, &mut lanes, action, wants);
        }
        if !branched() {
            let order = self.integrator.info().order;
            let structure = lagrangian.structure();
            let dissipates = structure.autonomous && structure.has_constant_rate() && (structure.z_free || action);
            for ((place, from), Lane { state, rows, doubtful, .. }) in places.into_iter().zip(&states).zip(lanes) {
                if ChartVector::from(state).is_finite() {
                    let t = t0 + steps as f64 * h;
                    let watched = self.watched && dissipates;
                    let doubtful = doubtful || watched && may_drift(lagrangian, order, (t0, from), (t, &state));
                    let member = &mut members[place];
                    let mut unresolved = None;
                    if doubtful && self.watched {
                        let own = self.by_itself(member.index, None::<&mut Rows<'_, N>>);
                        match own.ending {
                            Ok(ending) if ending.status == Status::Completed => unresolved = ending.unresolved,
                            _ => {
                                (*member, done[place]) = (own, true);
                                continue;
                            }
                        }
                    }
                    member.ending = Ok(Ending { status: Status::Completed, unresolved, steps, t, state });
                    member.rows = rows.unwrap_or_default();
                    done[place] = true;
                    batch_kernel += 1;
                }
            }
        }
        for ((_, start), (member, _)) in starts.iter().zip(members.iter_mut().zip(done)).filter(|(_, (_, done))| !done)
        {
            let of = (member.index, *start);
            *member = self.common.run(self.integrator, lagrangian, of, None::<&mut Rows<'_, N>>, self.interrupt);
        }
        batch_kernel
    }
}

impl<const N: usize> Start<N> {
    /// The state `(q, p, z)`, where it is finite.
    fn state<L: Lagrangian<N>>(&self, lagrangian: &L, t0: f64) -> Option<PhasePoint<N>> {
        let state = match self {
            Start::Velocity(x) => legendre(lagrangian, t0, x),
            Start::Momentum(x, _) => *x,
        };
        ChartVector::from(state).is_finite().then_some(state)
    }
}
