//! An ensemble in shards, which can be computed in several processes.

use crate::Until;
use crate::ensemble::builder::Ensemble;
use crate::ensemble::checkpoint::{self, Shards};
use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Member, Tally};
use crate::ensemble::shards::MAX_SHARDS_PER_THREAD;
use crate::ensemble::task::{MEMBERS_PER_SHARD, Shard, Task};
use contact_geom::Lagrangian;
use std::collections::VecDeque;

/// An [`Ensemble`] after its checks, in shards of a few hundred members that are computed, sent and saved together.
///
/// Any number of processes that create the same ensemble compute shards of it, in any order, and one of them merges the
/// results. It calls its fold with the members in the order of their index, so that the results are bitwise those of
/// [`Ensemble::run`], which consists of the same two parts.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Ensemble, SplittingScheme, Steps, Until};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let start = |i: usize| VelocityPoint::new([0.001 * i as f64], [0.5], 0.0);
/// let ensemble = Ensemble::new(&pendulum, 0.0, 1000, start).by(SplittingScheme::STRANG).steps(Steps::Size(0.25));
/// let sharded = ensemble.in_shards(Until::Time(10.0))?;
/// let mut merge = ensemble.merge(&sharded)?;
/// let mut indices = Vec::new();
/// for shard in (0..sharded.count()).rev() {
///     let words = sharded.compute(shard); // By any process.
///     merge.add(&words, &mut |member| indices.push(member.index))?;
/// }
/// assert!(merge.is_complete() && indices.iter().copied().eq(0..1000));
/// # Ok::<(), discrete_herglotz::ensemble::EnsembleError>(())
/// ```
pub struct ShardedEnsemble<'e, 'a, L, const N: usize> {
    pub(crate) task: Task<'e, 'a, L, N>,
}

impl<'a, L: Lagrangian<N> + Sync, const N: usize> Ensemble<'a, L, N> {
    /// The shards of the ensemble, to be computed by several processes. [`Ensemble::threads`] is ignored.
    ///
    /// # Errors
    /// Those of [`Ensemble::run`] before the computation starts.
    pub fn in_shards(&self, until: Until) -> Result<ShardedEnsemble<'_, 'a, L, N>, EnsembleError> {
        Ok(ShardedEnsemble { task: self.task(until)? })
    }

    /// Starts merging the shards of this ensemble; with a [checkpoint](Ensemble::checkpoint), after those that its file
    /// contains.
    ///
    /// # Errors
    /// [`EnsembleError`] if the checkpoint belongs to another ensemble, is damaged, or cannot be written.
    pub fn merge<'s, 'e>(
        &'s self,
        sharded: &'s ShardedEnsemble<'e, 'a, L, N>,
    ) -> Result<Merge<'s, 'e, 'a, L, N>, EnsembleError> {
        let open = |path| Shards::open(path, sharded.fingerprint(), sharded.count());
        let file = self.checkpoint.as_deref().map(open).transpose()?;
        let progress = self.progress.as_deref();
        Ok(Merge { sharded, progress, file, waiting: VecDeque::new(), handed_on: 0, tally: Tally::default() })
    }
}

impl<L: Lagrangian<N> + Sync, const N: usize> ShardedEnsemble<'_, '_, L, N> {
    /// A digest that identifies the ensemble, the same in all processes that create the same one. It depends on the
    /// integrator, the steps, the number of members, and the starts and Lagrangians of some members.
    pub fn fingerprint(&self) -> u64 {
        self.task.fingerprint
    }

    /// The number of shards.
    pub fn count(&self) -> usize {
        self.task.count.div_ceil(MEMBERS_PER_SHARD)
    }

    /// Computes the members of a shard on this thread, and returns their results as words of 64 bits, for
    /// [`Merge::add`]. A shard that the ensemble does not have has no members.
    pub fn compute(&self, shard: usize) -> Vec<u64> {
        checkpoint::words_of(shard, &self.task.shard(shard))
    }
}

/// Merges shards of an ensemble in the order of their members, whatever the order in which they arrive.
pub struct Merge<'s, 'e, 'a, L, const N: usize> {
    sharded: &'s ShardedEnsemble<'e, 'a, L, N>,
    progress: Option<&'s (dyn Fn(f64) + 'a)>,
    file: Option<Shards>,
    /// The shards that arrived before their turn, in order; only if there is no file from which they can be read.
    waiting: VecDeque<(usize, Shard<N>)>,
    handed_on: usize,
    tally: Tally,
}

impl<L: Lagrangian<N> + Sync, const N: usize> Merge<'_, '_, '_, L, N> {
    /// Whether a shard has arrived, or was in the checkpoint.
    pub fn has(&self, shard: usize) -> bool {
        let kept = |file: &Shards| file.has(shard);
        shard < self.handed_on || self.place(shard).is_ok() || self.file.as_ref().is_some_and(kept)
    }

    /// The position of a waiting shard, or the position at which it would be inserted.
    fn place(&self, shard: usize) -> Result<usize, usize> {
        self.waiting.binary_search_by_key(&shard, |(number, _)| *number)
    }

    /// The number of shards whose members have been passed to the fold: all shards before this one.
    pub fn handed_on(&self) -> usize {
        self.handed_on
    }

    /// Whether the members of all shards have been passed to the fold.
    pub fn is_complete(&self) -> bool {
        self.handed_on == self.sharded.count()
    }

    /// The tally of the members that have been passed to the fold.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The shard up to which, exclusively, shards may be computed now by this number of processes or threads. The
    /// results that wait for a slow shard need memory: the bound is eight shards for each worker. With a checkpoint
    /// they wait in its file, and there is no bound.
    pub fn bound(&self, workers: usize) -> usize {
        let window = MAX_SHARDS_PER_THREAD.saturating_mul(workers.max(1));
        if self.file.is_some() { usize::MAX } else { self.handed_on.saturating_add(window) }
    }

    /// Passes to the fold the shards that the checkpoint contains, from the first shard on without a gap. To be called
    /// once before shards are computed.
    ///
    /// # Errors
    /// [`EnsembleError`] if the checkpoint cannot be read.
    pub fn resume(&mut self, fold: &mut impl FnMut(&Member<N>)) -> Result<(), EnsembleError> {
        while let Some(shard) = self.waiting_next()? {
            self.hand_on(shard, fold);
        }
        Ok(())
    }

    /// Adds a shard that was [computed](ShardedEnsemble::compute) by any process, saves it in the checkpoint, and
    /// passes the shards to the fold whose turn has come. Adding a shard again has no effect.
    ///
    /// # Errors
    /// [`EnsembleError`]: the words are not a shard of this ensemble, or the checkpoint cannot be written or read.
    pub fn add(&mut self, words: &[u64], fold: &mut impl FnMut(&Member<N>)) -> Result<(), EnsembleError> {
        let expected = |shard: usize| self.sharded.task.members_of(shard).len();
        match checkpoint::shard_of(words) {
            Some((index, shard)) if index < self.sharded.count() && shard.members.len() == expected(index) => {
                self.add_shard(index, shard, fold)
            }
            _ => Err(EnsembleError::ForeignShard),
        }
    }

    pub(crate) fn add_shard(
        &mut self,
        index: usize,
        shard: Shard<N>,
        fold: &mut impl FnMut(&Member<N>),
    ) -> Result<(), EnsembleError> {
        if self.has(index) {
            return Ok(());
        }
        if let Some(file) = &mut self.file {
            file.write(index, &shard)?;
        }
        if index == self.handed_on {
            self.hand_on(shard, fold);
            return self.resume(fold);
        }
        if let (None, Err(place)) = (&self.file, self.place(index)) {
            self.waiting.insert(place, (index, shard));
        }
        Ok(())
    }

    /// The next shard in the order, if it has arrived.
    fn waiting_next(&mut self) -> Result<Option<Shard<N>>, EnsembleError> {
        match &mut self.file {
            Some(file) => file.read(self.handed_on, self.sharded.task.members_of(self.handed_on).len()),
            None if self.waiting.front().is_some_and(|(number, _)| *number == self.handed_on) => {
                Ok(self.waiting.pop_front().map(|(_, shard)| shard))
            }
            None => Ok(None),
        }
    }

    fn hand_on(&mut self, mut shard: Shard<N>, fold: &mut impl FnMut(&Member<N>)) {
        let sharded = self.sharded;
        if !shard.with_causes {
            sharded.task.run_again(&mut shard);
        }
        self.tally.batch_kernel += shard.batch_kernel;
        for member in &shard.members {
            self.tally.add(member);
            fold(member);
        }
        self.handed_on += 1;
        if let Some(report) = self.progress {
            report(self.handed_on as f64 / sharded.count() as f64);
        }
    }
}
