//! Runs one ensemble on all ranks of a communicator.

use contact_geom::Lagrangian;
use discrete_herglotz::ensemble::{EnsembleError, Lagrangians, Member, Merge, ShardedEnsemble, Tally};
use discrete_herglotz::{Ensemble, Until};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use std::collections::VecDeque;
use std::sync::mpsc::{self, TryRecvError};
use std::time::{Duration, Instant};

/// The number of ranks up to which rank 0 also computes, on a thread in addition to the one that hands out shards. With
/// more ranks its core adds little, and from a few hundred ranks on it is busy with messages (docs/scaling.md).
const MAX_RANKS_WITH_COMPUTING_ROOT: usize = 64;

/// The time between two probes of an idle rank for messages: short compared with a shard, long compared with a probe.
const PROBE_INTERVAL: Duration = Duration::from_micros(50);

/// The result of an ensemble on several ranks, on rank 0.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Merged {
    /// How the members ended.
    pub tally: Tally,
    /// The shards that were in the checkpoint.
    pub resumed: usize,
    /// The number of shards that each rank has computed.
    pub shards: Vec<usize>,
    /// The bytes of the shards that rank 0 has received from other ranks.
    pub bytes: usize,
    /// The time in which rank 0 received shards and handed out the next ones.
    pub messages: Duration,
    /// The time in which rank 0 merged shards: the checkpoint and the fold.
    pub merging: Duration,
}

/// The reason why an ensemble on several ranks cannot start or continue.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MpiError {
    /// This rank cannot construct or merge the ensemble.
    #[error(transparent)]
    Ensemble(#[from] EnsembleError),
    /// Two ranks have constructed different ensembles, or one of them cannot construct its own.
    #[error(
        "rank {rank} has a different ensemble from rank 0, or none; start all ranks with the same program, members, \
         integrator, steps, end and requests"
    )]
    AnotherEnsemble {
        /// The first rank whose ensemble is not that of rank 0.
        rank: usize,
    },
    /// No result of a rank has arrived for longer than the patience of [`run`]. Collective calls are no longer
    /// possible: end the job with [`abort`](Communicator::abort).
    #[error(
        "rank {rank} has sent no message for {seconds} s, and {open} of its shards are incomplete; run again from \
         the checkpoint, or set a patience that is longer than the time of a shard"
    )]
    RankLost {
        /// The rank.
        rank: usize,
        /// The number of its open shards, which are lost.
        open: usize,
        /// How long rank 0 has waited for it.
        seconds: f64,
    },
}

/// Runs an ensemble on all ranks of a communicator, which construct the same ensemble and call this function
/// collectively. On rank 0 the fold is given the members in the order of their index, and its result is bitwise that of
/// [`Ensemble::run`]; on all other ranks the result is `None`. Each rank computes on one thread. The checkpoint is that
/// of rank 0.
///
/// `patience` is how long rank 0 waits for a result of a rank that has open shards, which must be longer than a shard
/// takes. Without it there is no limit, since launchers end a job themselves when one of its processes ends.
///
/// # Errors
/// [`MpiError`], on all ranks, where the ensemble of a rank cannot run or differs from that of rank 0. On rank 0 alone,
/// where it cannot read or write the checkpoint, or a rank is silent for too long; what was computed before is in the
/// checkpoint.
///
/// # Panics
/// A panic on a rank, in the fold or in a Lagrangian, ends all ranks.
pub fn run<L: Lagrangian<N> + Sync, const N: usize>(
    world: &SimpleCommunicator,
    ensemble: &Ensemble<'_, Lagrangians<'_, L, N>>,
    until: Until,
    patience: Option<Duration>,
    mut fold: impl FnMut(&Member),
) -> Result<Option<Merged>, MpiError> {
    let _guard = AbortOnPanic(world);
    let own = ensemble.in_shards(until);
    let mut all = vec![0u64; world.size() as usize];
    world.all_gather_into(&own.as_ref().map_or(0, ShardedEnsemble::fingerprint), &mut all[..]);
    let sharded = own?;
    if let Some(rank) = all.iter().position(|of| *of != all[0]) {
        return Err(MpiError::AnotherEnsemble { rank });
    }
    if world.rank() == 0 {
        return distribute(world, &sharded, ensemble.merge(&sharded, &mut fold), patience).map(Some);
    }
    let root = world.process_at_rank(0);
    loop {
        // A blocking receive of Open MPI would keep a core busy.
        while root.immediate_probe().is_none() {
            std::thread::sleep(PROBE_INTERVAL);
        }
        // An empty message says that there are no more shards.
        let [shard] = root.receive_vec::<u64>().0[..] else { return Ok(None) };
        root.send(&sharded.compute(shard as usize)[..]);
    }
}

/// Hands out and merges the shards that are missing, on rank 0. Worker 0 is a thread of it that computes.
fn distribute(
    world: &SimpleCommunicator,
    sharded: &ShardedEnsemble<'_>,
    merge: Result<Merge<'_, '_, '_>, EnsembleError>,
    patience: Option<Duration>,
) -> Result<Merged, MpiError> {
    let ranks = world.size() as usize;
    let workers = usize::from(ranks > MAX_RANKS_WITH_COMPUTING_ROOT)..ranks;
    // The workers that can be given a shard, in turn, once for each. A worker has at most two: one that it computes, and
    // one to continue with while a result is sent.
    let mut free: VecDeque<usize> = workers.clone().chain(workers).collect();
    // The number of open shards of each worker, and when it last sent a result or was given work while it was idle.
    let (mut open, mut last_heard) = (vec![0; ranks], vec![Instant::now(); ranks]);
    let mut merged = Merged { shards: vec![0; ranks], ..Merged::default() };
    let result = std::thread::scope(|scope| {
        let (mut merge, all_free) = (merge?, free.len());
        let mut missing = merge.missing().into_iter().peekable();
        merged.resumed = sharded.count() - missing.len();
        let (hand_out, handed_out) = mpsc::channel::<usize>();
        let (done, computed) = mpsc::channel();
        scope.spawn(move || handed_out.into_iter().try_for_each(|shard| done.send(sharded.compute(shard))));
        loop {
            let clock = Instant::now();
            while let Some(worker) = free.front().copied()
                && let Some(shard) = missing.next_if(|shard| *shard < merge.bound(ranks))
            {
                free.pop_front();
                if open[worker] == 0 {
                    last_heard[worker] = clock;
                }
                open[worker] += 1;
                match worker {
                    // Sending fails where the thread has panicked, which `computed` tells.
                    0 => drop(hand_out.send(shard)),
                    _ => world.process_at_rank(worker as i32).send(&[shard as u64][..]),
                }
            }
            merged.messages += clock.elapsed();
            if free.len() == all_free {
                merged.tally = merge.tally();
                return Ok(());
            }
            let (worker, words) = loop {
                match computed.try_recv() {
                    Ok(words) => break (0, words),
                    Err(TryRecvError::Empty) => {}
                    // The thread has panicked, and the end of the scope propagates the panic.
                    Err(TryRecvError::Disconnected) => return Ok(()),
                }
                let clock = Instant::now();
                if let Some(status) = world.any_process().immediate_probe() {
                    let (words, _) = world.process_at_rank(status.source_rank()).receive_vec::<u64>();
                    merged.bytes += 8 * words.len();
                    merged.messages += clock.elapsed();
                    break (status.source_rank() as usize, words);
                }
                if let Some(patience) = patience
                    && let Some(rank) =
                        (1..ranks).find(|rank| open[*rank] > 0 && last_heard[*rank].elapsed() > patience)
                {
                    return Err(MpiError::RankLost { rank, open: open[rank], seconds: patience.as_secs_f64() });
                }
                std::thread::sleep(PROBE_INTERVAL);
            };
            let clock = Instant::now();
            last_heard[worker] = clock;
            open[worker] -= 1;
            free.push_back(worker);
            merged.shards[worker] += 1;
            merge.add(&words)?;
            merged.merging += clock.elapsed();
        }
    });
    if !matches!(result, Err(MpiError::RankLost { .. })) {
        for (rank, open) in open.into_iter().enumerate().skip(1) {
            let worker = world.process_at_rank(rank as i32);
            worker.send(&[0u64; 0][..]);
            // The results that are under way after an error.
            (0..open).for_each(|_| drop(worker.receive_vec::<u64>()));
        }
    }
    result.map(|()| merged)
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
