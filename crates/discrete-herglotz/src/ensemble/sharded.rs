//! An ensemble in shards, for those who compute them in other processes.

use crate::Until;
use crate::ensemble::builder::Ensemble;
use crate::ensemble::checkpoint::{self, Shards};
use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Member, Tally};
use crate::ensemble::shards::WINDOW_OF_A_THREAD;
use crate::ensemble::task::{SHARD, Shard, Task};
use contact_geom::Lagrangian;
use std::collections::VecDeque;

/// An [`Ensemble`] after its checks, in shards: a few hundred members each, that are computed, sent and kept together.
///
/// Any number of processes that make the same ensemble compute shards of it, in any order, and one of them merges the results. It hands the
/// members to its fold in the order of their index, so that what comes out has the same bits as [`Ensemble::run`], which works by the same
/// two parts.
///
/// ```
/// use contact_geom::{VelocityPoint, systems::Pendulum};
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
    /// The shards of the ensemble, to be computed by several processes. [`Ensemble::threads`] is not heeded.
    ///
    /// # Errors
    /// As [`Ensemble::run`] before work begins.
    pub fn in_shards(&self, until: Until) -> Result<ShardedEnsemble<'_, 'a, L, N>, EnsembleError> {
        Ok(ShardedEnsemble { task: self.task(until)? })
    }

    /// Begins to merge the shards of this ensemble; with a [checkpoint](Ensemble::checkpoint), behind those that its file has.
    ///
    /// # Errors
    /// [`EnsembleError`], where the checkpoint is of another ensemble, damaged, or cannot be written.
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
    /// What the ensemble is, as one number: the same in all processes that have made the same one. It is a digest of the integrator, the steps, the count,
    /// and of starts and Lagrangian at some members.
    pub fn fingerprint(&self) -> u64 {
        self.task.fingerprint
    }

    /// How many shards there are.
    pub fn count(&self) -> usize {
        self.task.count.div_ceil(SHARD)
    }

    /// Computes the members of a shard, on this thread: their ends as words of 64 bits, for [`Merge::add`]. There are none in a shard
    /// that the ensemble does not have.
    pub fn compute(&self, shard: usize) -> Vec<u64> {
        checkpoint::words_of(shard, &self.task.shard(shard))
    }
}

/// Shards of an ensemble that are merged in the order of their members, whatever the order in which they come.
pub struct Merge<'s, 'e, 'a, L, const N: usize> {
    sharded: &'s ShardedEnsemble<'e, 'a, L, N>,
    progress: Option<&'s (dyn Fn(f64) + 'a)>,
    file: Option<Shards>,
    /// Those that came before their turn, in order; only where there is no file that they can be read from.
    waiting: VecDeque<(usize, Shard<N>)>,
    handed_on: usize,
    tally: Tally,
}

impl<L: Lagrangian<N> + Sync, const N: usize> Merge<'_, '_, '_, L, N> {
    /// Whether a shard has come, or was in the checkpoint.
    pub fn has(&self, shard: usize) -> bool {
        let kept = |file: &Shards| file.has(shard);
        shard < self.handed_on || self.place(shard).is_ok() || self.file.as_ref().is_some_and(kept)
    }

    /// Where a shard waits, or would.
    fn place(&self, shard: usize) -> Result<usize, usize> {
        self.waiting.binary_search_by_key(&shard, |(number, _)| *number)
    }

    /// The shards whose members were handed to the fold: those before this one.
    pub fn handed_on(&self) -> usize {
        self.handed_on
    }

    /// Whether all were.
    pub fn is_complete(&self) -> bool {
        self.handed_on == self.sharded.count()
    }

    /// How the members have ended that were handed to the fold.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The shard before which all may be computed now by so many processes or threads. The results that wait for a slow shard need
    /// memory, eight shards for each; with a checkpoint they wait in its file, and there is no bound.
    pub fn bound(&self, workers: usize) -> usize {
        let window = WINDOW_OF_A_THREAD.saturating_mul(workers.max(1));
        if self.file.is_some() { usize::MAX } else { self.handed_on.saturating_add(window) }
    }

    /// Hands on what the checkpoint has from the first shard on. To be called once before shards are computed.
    ///
    /// # Errors
    /// [`EnsembleError`], where the checkpoint cannot be read.
    pub fn resume(&mut self, fold: &mut impl FnMut(&Member<N>)) -> Result<(), EnsembleError> {
        while let Some(shard) = self.waiting_next()? {
            self.hand_on(shard, fold);
        }
        Ok(())
    }

    /// Takes a shard that was [computed](ShardedEnsemble::compute) anywhere, keeps it in the checkpoint, and hands on what has its turn. One
    /// that is there already is of no effect.
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

    /// The next shard in the order, where it is there.
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
        if let Some(tell) = self.progress {
            tell(self.handed_on as f64 / sharded.count() as f64);
        }
    }
}
