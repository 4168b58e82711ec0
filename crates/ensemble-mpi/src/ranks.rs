//! Runs one ensemble on all ranks of a communicator.

use crate::{Dispatch, MpiError};
use contact_geom::Lagrangian;
use discrete_herglotz::{
    Ensemble, Until,
    ensemble::{EnsembleError, Member, Merge, ShardedEnsemble, Tally},
};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use mpi::{Rank, Tag};
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};
use std::time::{Duration, Instant};

/// Tag of messages from rank 0: the number of a shard, or an empty message where there are no more.
const SHARD_TO_COMPUTE: Tag = 1;

/// Tag of messages to rank 0: the words of a shard.
const COMPUTED_SHARD: Tag = 2;

/// The number of ranks up to which rank 0 also computes, on a thread in addition to the one that hands out shards. With
/// more ranks its core adds little, and from a few hundred ranks on it is busy with messages (docs/scaling.md).
const MAX_RANKS_WITH_COMPUTING_ROOT: usize = 64;

/// The time between two probes of an idle rank for messages: short compared with a shard, long compared with a probe.
const PROBE_INTERVAL: Duration = Duration::from_micros(50);

/// Options of a run on several ranks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// How long rank 0 waits for a result of a rank that has open shards, which must be longer than a shard takes.
    /// There is no limit where it is `None`, since launchers end a job themselves when one of its processes ends.
    pub patience: Option<Duration>,
}

/// The result of an ensemble on several ranks, on rank 0.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Merged {
    /// How the members ended.
    pub tally: Tally,
    /// The shards that were in the checkpoint.
    pub resumed: usize,
    /// The traffic of rank 0.
    pub traffic: Traffic,
}

/// The shards and bytes that rank 0 has received, and the time that it spent on them.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Traffic {
    /// The number of shards that each rank has computed.
    pub shards: Vec<usize>,
    /// The bytes of the shards that were received from other ranks.
    pub bytes: usize,
    /// The time for receiving shards and for handing out the next ones.
    pub messages: Duration,
    /// The time for merging all shards: the checkpoint and the fold.
    pub merging: Duration,
}

/// Runs an ensemble on all ranks of a communicator, which construct the same ensemble and call this function
/// collectively. On rank 0 the fold is given the members in the order of their index, and its result is bitwise that of
/// [`Ensemble::run`]; on all other ranks the result is `None`. Each rank computes on one thread; a single rank runs the
/// ensemble as [`Ensemble::run`] does. The checkpoint is that of rank 0.
///
/// # Errors
/// [`MpiError`], on all ranks, where the ensemble of a rank cannot run or differs from that of rank 0, or where rank 0
/// cannot read or write the checkpoint. What was computed before is in the checkpoint. A rank that is silent for too
/// long is an error on rank 0.
///
/// # Panics
/// A panic on a rank, in the fold or in a Lagrangian, ends all ranks.
pub fn run<'a, L: Lagrangian<N> + Sync, const N: usize>(
    world: &SimpleCommunicator,
    ensemble: &Ensemble<'a, L, N>,
    until: Until,
    options: Options,
    mut fold: impl FnMut(&Member<N>),
) -> Result<Option<Merged>, MpiError> {
    let _guard = AbortOnPanic(world);
    let sharded = agree(world, ensemble.in_shards(until), ShardedEnsemble::fingerprint)?;
    if world.rank() != 0 {
        agree(world, Ok(()), |()| 0)?;
        work(world, &sharded);
        return agree(world, Ok(()), |()| 0).map(|()| None);
    }
    let mut merge = agree(world, ensemble.merge(&sharded), |_| 0)?;
    let resumed = (0..sharded.count()).filter(|shard| merge.has(*shard)).count();
    let mut distributor = Distributor::new(world, sharded.count(), options);
    let result = match world.size() {
        1 => ensemble.run(until, fold).map_err(MpiError::from),
        _ => distributor.merge_all(&sharded, &mut merge, &mut fold).map(|()| merge.tally()),
    };
    let own = match result {
        Err(MpiError::Ensemble(cause)) => Err(cause),
        Err(lost) => return Err(lost),
        Ok(tally) => Ok(Some(Merged { tally, resumed, traffic: distributor.traffic.clone() })),
    };
    distributor.dismiss();
    agree(world, own, |_| 0)
}

/// Collective agreement of all ranks: returns the own value where all ranks have one and their `value`s are equal.
fn agree<T>(
    world: &SimpleCommunicator,
    own: Result<T, EnsembleError>,
    value: impl Fn(&T) -> u64,
) -> Result<T, MpiError> {
    let mine = own.as_ref().map_or([0, 0], |own| [1, value(own)]);
    let mut all = vec![0u64; 2 * world.size() as usize];
    world.all_gather_into(&mine[..], &mut all[..]);
    if let Some(rank) = all.chunks_exact(2).position(|of| of[0] == 0) {
        let speaker = world.process_at_rank(rank as Rank);
        let mut message = own.as_ref().err().map_or(Vec::new(), |cause| cause.to_string().into_bytes());
        let mut length = message.len() as u64;
        speaker.broadcast_into(&mut length);
        if world.rank() as usize != rank {
            message = vec![0; length as usize];
        }
        speaker.broadcast_into(&mut message[..]);
        let message = String::from_utf8_lossy(&message).into_owned();
        return Err(own.err().map_or(MpiError::Refused { rank, message }, MpiError::Ensemble));
    }
    if let Some(rank) = all.chunks_exact(2).position(|of| of[1] != all[1]) {
        return Err(MpiError::AnotherEnsemble { rank });
    }
    Ok(own?)
}

/// Computes the shards that rank 0 hands out, until there are no more.
fn work<L: Lagrangian<N> + Sync, const N: usize>(world: &SimpleCommunicator, sharded: &ShardedEnsemble<'_, '_, L, N>) {
    let root = world.process_at_rank(0);
    loop {
        // A blocking receive of Open MPI would keep a core busy.
        while root.immediate_probe_with_tag(SHARD_TO_COMPUTE).is_none() {
            std::thread::sleep(PROBE_INTERVAL);
        }
        let (shard, _) = root.receive_vec_with_tag::<u64>(SHARD_TO_COMPUTE);
        let Some(shard) = shard.first() else { return };
        root.send_with_tag(&sharded.compute(*shard as usize)[..], COMPUTED_SHARD);
    }
}

/// The computing thread of rank 0: the channels for numbers of shards and for their words.
struct OwnThread {
    hand_out: Sender<usize>,
    computed: Receiver<Vec<u64>>,
}

/// The state of rank 0, which hands out shards and merges them.
struct Distributor<'w> {
    world: &'w SimpleCommunicator,
    patience: Option<Duration>,
    /// Worker 0 is the computing thread of rank 0.
    dispatch: Dispatch,
    /// When each rank last sent a result, or was given work while it was idle.
    last_heard: Vec<Instant>,
    /// Workers that can be given another shard, once the bound on waiting results permits it.
    ready_workers: Vec<usize>,
    traffic: Traffic,
}

impl<'w> Distributor<'w> {
    fn new(world: &'w SimpleCommunicator, count: usize, options: Options) -> Self {
        let ranks = world.size() as usize;
        Distributor {
            world,
            patience: options.patience,
            dispatch: Dispatch::new(count, ranks),
            last_heard: vec![Instant::now(); ranks],
            ready_workers: Vec::new(),
            traffic: Traffic { shards: vec![0; ranks], ..Traffic::default() },
        }
    }

    /// Hands out and merges shards until all are merged.
    fn merge_all<L: Lagrangian<N> + Sync, const N: usize>(
        &mut self,
        sharded: &ShardedEnsemble<'_, '_, L, N>,
        merge: &mut Merge<'_, '_, '_, L, N>,
        fold: &mut impl FnMut(&Member<N>),
    ) -> Result<(), MpiError> {
        merge.resume(fold)?;
        let ranks = self.last_heard.len();
        std::thread::scope(|scope| {
            let (hand_out, handed_out) = mpsc::channel::<usize>();
            let (done, computed) = mpsc::channel();
            let first = if ranks <= MAX_RANKS_WITH_COMPUTING_ROOT {
                scope.spawn(move || {
                    for shard in handed_out {
                        if done.send(sharded.compute(shard)).is_err() {
                            return;
                        }
                    }
                });
                0
            } else {
                1
            };
            let own = OwnThread { hand_out, computed };
            self.ready_workers = (first..ranks).collect();
            self.feed(merge, &own);
            while !self.dispatch.is_over(|shard| merge.has(shard)) {
                match own.computed.try_recv() {
                    Ok(words) => {
                        self.take(0, &words, merge, fold)?;
                        self.feed(merge, &own);
                    }
                    Err(TryRecvError::Empty) => {}
                    // The thread has panicked, and the end of the scope propagates the panic.
                    Err(TryRecvError::Disconnected) => return Ok(()),
                }
                let clock = Instant::now();
                match self.world.any_process().immediate_probe_with_tag(COMPUTED_SHARD) {
                    Some(status) => {
                        let worker = self.world.process_at_rank(status.source_rank());
                        let (words, _) = worker.receive_vec_with_tag::<u64>(COMPUTED_SHARD);
                        self.traffic.bytes += 8 * words.len();
                        self.traffic.messages += clock.elapsed();
                        self.take(status.source_rank() as usize, &words, merge, fold)?;
                        let clock = Instant::now();
                        self.feed(merge, &own);
                        self.traffic.messages += clock.elapsed();
                    }
                    None => {
                        self.check_for_lost_ranks()?;
                        std::thread::sleep(PROBE_INTERVAL);
                    }
                }
            }
            Ok(())
        })
    }

    /// Merges a shard that a worker has computed.
    fn take<L: Lagrangian<N> + Sync, const N: usize>(
        &mut self,
        worker: usize,
        words: &[u64],
        merge: &mut Merge<'_, '_, '_, L, N>,
        fold: &mut impl FnMut(&Member<N>),
    ) -> Result<(), MpiError> {
        let clock = Instant::now();
        self.last_heard[worker] = clock;
        let shard = words.first().map_or(usize::MAX, |word| *word as usize);
        if !self.dispatch.received(worker, shard) {
            return Err(EnsembleError::ForeignShard.into());
        }
        self.traffic.shards[worker] += 1;
        merge.add(words, fold)?;
        self.traffic.merging += clock.elapsed();
        if !self.ready_workers.contains(&worker) {
            self.ready_workers.push(worker);
        }
        Ok(())
    }

    /// Hands out the shards that may be computed now to the workers that can be given one.
    fn feed<L: Lagrangian<N> + Sync, const N: usize>(&mut self, merge: &Merge<'_, '_, '_, L, N>, own: &OwnThread) {
        let bound = merge.bound(self.last_heard.len());
        let mut ready_workers = std::mem::take(&mut self.ready_workers);
        let mut handed_out = true;
        // One shard to each worker in turn, so that few shards are distributed evenly.
        while std::mem::take(&mut handed_out) {
            for worker in &ready_workers {
                let idle = self.dispatch.open(*worker).is_empty();
                let Some(shard) = self.dispatch.next(*worker, bound, |shard| merge.has(shard)) else { continue };
                handed_out = true;
                if idle {
                    self.last_heard[*worker] = Instant::now();
                }
                if *worker == 0 {
                    // Sending fails where the thread has panicked, which the loop over results detects.
                    let _ = own.hand_out.send(shard);
                } else {
                    self.world.process_at_rank(*worker as Rank).send_with_tag(&[shard as u64][..], SHARD_TO_COMPUTE);
                }
            }
        }
        ready_workers.retain(|worker| self.dispatch.accepts_shard(*worker));
        self.ready_workers = ready_workers;
    }

    /// Checks whether a rank with open shards has been silent for too long.
    fn check_for_lost_ranks(&self) -> Result<(), MpiError> {
        let Some(patience) = self.patience else { return Ok(()) };
        for (rank, last_heard) in self.last_heard.iter().enumerate().skip(1) {
            let open = self.dispatch.open(rank).len();
            if open > 0 && last_heard.elapsed() > patience {
                return Err(MpiError::RankLost { rank, open, seconds: patience.as_secs_f64() });
            }
        }
        Ok(())
    }

    /// Tells all ranks that there are no more shards, and receives the results that are under way.
    fn dismiss(&self) {
        for rank in 1..self.last_heard.len() {
            let worker = self.world.process_at_rank(rank as Rank);
            worker.send_with_tag(&[0u64; 0][..], SHARD_TO_COMPUTE);
            for _ in self.dispatch.open(rank) {
                worker.receive_vec_with_tag::<u64>(COMPUTED_SHARD);
            }
        }
    }
}

/// Ends all ranks when one of them panics, since the others would wait for it forever.
struct AbortOnPanic<'w>(&'w SimpleCommunicator);

impl Drop for AbortOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.abort(101);
        }
    }
}
