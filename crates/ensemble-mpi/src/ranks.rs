//! The same ensemble over all ranks of a communicator.

use crate::{Dispatch, MpiError};
use contact_geom::Lagrangian;
use discrete_herglotz::{Ensemble, EnsembleError, Member, Merge, ShardedEnsemble, Tally, Until};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use mpi::{Rank, Tag};
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};
use std::time::{Duration, Instant};

/// From rank 0: the number of a shard, or nothing where there are no more.
const HANDED_OUT: Tag = 1;

/// To rank 0: the words of a shard.
const COMPUTED: Tag = 2;

/// The ranks up to which rank 0 computes too, on a thread beside the one that hands out. Its core is worth one part in so many, and from some
/// hundred ranks on it is busy with messages (docs/scaling.md).
const RANKS_WITH_WORKING_ROOT: usize = 64;

/// How long a rank sleeps where it has nothing to do: short beside a shard, long beside the look whether something has come.
const NAP: Duration = Duration::from_micros(50);

/// How to run over ranks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// How long to wait for a sign of a rank that has work, or of rank 0: longer than a shard takes. For ever where nothing is said, as launchers
    /// end a job themselves when one of its processes ends.
    pub patience: Option<Duration>,
}

/// What became of an ensemble over ranks; on rank 0.
#[derive(Clone, Debug)]
pub struct Merged {
    /// How the members have ended.
    pub tally: Tally,
    /// The shards that were in the checkpoint.
    pub resumed: usize,
    /// What rank 0 has handed out and received.
    pub traffic: Traffic,
}

/// What rank 0 has handed out and received, and what that took of its time.
#[derive(Clone, Debug, Default)]
pub struct Traffic {
    /// The shards that each rank has computed.
    pub shards: Vec<usize>,
    /// The bytes of the shards that came from other ranks.
    pub bytes: usize,
    /// The time of their receipt, and of handing out the next ones.
    pub messages: Duration,
    /// The time of merging all shards: the checkpoint and the fold.
    pub merging: Duration,
}

/// Runs an ensemble over all ranks of a communicator, which have all made the same one and call this together. The fold is given the members
/// on rank 0, in the order of their index, and has the same bits as with [`Ensemble::run`]; the result is `None` on all other ranks. Each
/// rank computes on one thread; a single one as [`Ensemble::run`]. The checkpoint is that of rank 0.
///
/// # Errors
/// [`MpiError`], on all ranks: one of them has no ensemble that could run, or another than rank 0, or rank 0 cannot read or write the checkpoint. What
/// was computed before is in the checkpoint. A rank that is silent for too long is an error of those that wait for it.
///
/// # Panics
/// A panic of a rank, in the fold or in a Lagrangian, ends all ranks.
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

/// Comes together with all ranks: what each has, where all have it with the same value.
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

/// Computes what rank 0 hands out, until there is no more.
fn work<L: Lagrangian<N> + Sync, const N: usize>(world: &SimpleCommunicator, sharded: &ShardedEnsemble<'_, '_, L, N>) {
    let root = world.process_at_rank(0);
    loop {
        // Not a blocking receive: that of Open MPI keeps a core busy.
        while root.immediate_probe_with_tag(HANDED_OUT).is_none() {
            std::thread::sleep(NAP);
        }
        let (shard, _) = root.receive_vec_with_tag::<u64>(HANDED_OUT);
        let Some(shard) = shard.first() else { return };
        root.send_with_tag(&sharded.compute(*shard as usize)[..], COMPUTED);
    }
}

/// The thread of rank 0 that computes: where it gets numbers of shards, and where their words come from.
struct OwnThread {
    hand_out: Sender<usize>,
    computed: Receiver<Vec<u64>>,
}

/// Rank 0: hands out shards and merges them.
struct Distributor<'w> {
    world: &'w SimpleCommunicator,
    patience: Option<Duration>,
    /// Worker 0 is the thread of this rank.
    dispatch: Dispatch,
    /// When each rank has last sent something, or was given work after it had none.
    heard: Vec<Instant>,
    /// Those that could have had another shard, if results did not wait for a slow one.
    starved: Vec<usize>,
    traffic: Traffic,
}

impl<'w> Distributor<'w> {
    fn new(world: &'w SimpleCommunicator, count: usize, options: Options) -> Self {
        let ranks = world.size() as usize;
        Distributor {
            world,
            patience: options.patience,
            dispatch: Dispatch::new(count, ranks),
            heard: vec![Instant::now(); ranks],
            starved: Vec::new(),
            traffic: Traffic { shards: vec![0; ranks], ..Traffic::default() },
        }
    }

    /// Until all shards are merged.
    fn merge_all<L: Lagrangian<N> + Sync, const N: usize>(
        &mut self,
        sharded: &ShardedEnsemble<'_, '_, L, N>,
        merge: &mut Merge<'_, '_, '_, L, N>,
        fold: &mut impl FnMut(&Member<N>),
    ) -> Result<(), MpiError> {
        merge.resume(fold)?;
        let ranks = self.heard.len();
        std::thread::scope(|scope| {
            let (hand_out, handed_out) = mpsc::channel::<usize>();
            let (done, computed) = mpsc::channel();
            let first = if ranks <= RANKS_WITH_WORKING_ROOT {
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
            self.starved = (first..ranks).collect();
            self.feed(merge, &own);
            while !self.dispatch.is_over(|shard| merge.has(shard)) {
                match own.computed.try_recv() {
                    Ok(words) => {
                        self.take(0, &words, merge, fold)?;
                        self.feed(merge, &own);
                    }
                    Err(TryRecvError::Empty) => {}
                    // The thread has panicked, and so does the scope.
                    Err(TryRecvError::Disconnected) => return Ok(()),
                }
                let clock = Instant::now();
                match self.world.any_process().immediate_probe_with_tag(COMPUTED) {
                    Some(status) => {
                        let worker = self.world.process_at_rank(status.source_rank());
                        let (words, _) = worker.receive_vec_with_tag::<u64>(COMPUTED);
                        self.traffic.bytes += 8 * words.len();
                        self.traffic.messages += clock.elapsed();
                        self.take(status.source_rank() as usize, &words, merge, fold)?;
                        let clock = Instant::now();
                        self.feed(merge, &own);
                        self.traffic.messages += clock.elapsed();
                    }
                    None => {
                        self.look_for_the_lost()?;
                        std::thread::sleep(NAP);
                    }
                }
            }
            Ok(())
        })
    }

    /// Merges what a worker has computed.
    fn take<L: Lagrangian<N> + Sync, const N: usize>(
        &mut self,
        worker: usize,
        words: &[u64],
        merge: &mut Merge<'_, '_, '_, L, N>,
        fold: &mut impl FnMut(&Member<N>),
    ) -> Result<(), MpiError> {
        let clock = Instant::now();
        self.heard[worker] = clock;
        let shard = words.first().map_or(usize::MAX, |word| *word as usize);
        if !self.dispatch.received(worker, shard) {
            return Err(EnsembleError::ForeignShard.into());
        }
        self.traffic.shards[worker] += 1;
        merge.add(words, fold)?;
        self.traffic.merging += clock.elapsed();
        if !self.starved.contains(&worker) {
            self.starved.push(worker);
        }
        Ok(())
    }

    /// Hands out what may be computed now to those that have had less than they could.
    fn feed<L: Lagrangian<N> + Sync, const N: usize>(&mut self, merge: &Merge<'_, '_, '_, L, N>, own: &OwnThread) {
        let bound = merge.bound(self.heard.len());
        let mut starved = std::mem::take(&mut self.starved);
        let mut handed_out = true;
        // One to each in turn, so that the first do not get all where there are few.
        while std::mem::take(&mut handed_out) {
            for worker in &starved {
                let idle = self.dispatch.open(*worker).is_empty();
                let Some(shard) = self.dispatch.next(*worker, bound, |shard| merge.has(shard)) else { continue };
                handed_out = true;
                if idle {
                    self.heard[*worker] = Instant::now();
                }
                if *worker == 0 {
                    // It fails where the thread has panicked, which the loop over results sees.
                    let _ = own.hand_out.send(shard);
                } else {
                    self.world.process_at_rank(*worker as Rank).send_with_tag(&[shard as u64][..], HANDED_OUT);
                }
            }
        }
        starved.retain(|worker| self.dispatch.wants(*worker));
        self.starved = starved;
    }

    /// Looks whether a rank with open shards has been silent for too long.
    fn look_for_the_lost(&self) -> Result<(), MpiError> {
        let Some(patience) = self.patience else { return Ok(()) };
        for (rank, heard) in self.heard.iter().enumerate().skip(1) {
            let open = self.dispatch.open(rank).len();
            if open > 0 && heard.elapsed() > patience {
                return Err(MpiError::RankLost { rank, open, seconds: patience.as_secs_f64() });
            }
        }
        Ok(())
    }

    /// Says to all ranks that there is no more, and receives what they have begun.
    fn dismiss(&self) {
        for rank in 1..self.heard.len() {
            let worker = self.world.process_at_rank(rank as Rank);
            worker.send_with_tag(&[0u64; 0][..], HANDED_OUT);
            for _ in self.dispatch.open(rank) {
                worker.receive_vec_with_tag::<u64>(COMPUTED);
            }
        }
    }
}

/// Ends all ranks when one of them panics: the others would wait for it for ever.
struct AbortOnPanic<'w>(&'w SimpleCommunicator);

impl Drop for AbortOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.abort(101);
        }
    }
}
