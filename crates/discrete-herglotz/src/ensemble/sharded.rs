//! An ensemble in shards, which can be computed in several processes.

use crate::Until;
use crate::ensemble::builder::Ensemble;
use crate::ensemble::checkpoint::{self, Shards};
use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Member, Tally};
use crate::ensemble::members::Members;
use crate::ensemble::settings::Settings;
use crate::ensemble::shards::{self, MAX_SHARDS_PER_THREAD};
use crate::ensemble::task::{MEMBERS_PER_SHARD, Shard, Task};
use std::ops::ControlFlow;

/// An [`Ensemble`] after its checks, in shards of a few hundred members that are computed, sent and saved together.
///
/// Any number of processes that create the same ensemble compute shards of it, in any order, and one of them merges the
/// results. It calls its fold with the members in the order of their index, so that the results are bitwise those of
/// [`Ensemble::run`], which consists of the same two parts.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Ensemble, SplittingScheme, Steps, Until, ensemble::Member};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let start = |i: usize| VelocityPoint::new([0.001 * i as f64], [0.5], 0.0);
/// let ensemble = Ensemble::new(&pendulum, 0.0, 1000, start).by(SplittingScheme::STRANG).steps(Steps::Size(0.25));
/// let sharded = ensemble.in_shards(Until::Time(10.0))?;
/// let mut indices = Vec::new();
/// let mut fold = |member: &Member| indices.push(member.index);
/// let mut merge = ensemble.merge(&sharded, &mut fold)?;
/// for shard in merge.missing().into_iter().rev() {
///     merge.add(&sharded.compute(shard))?; // Computed by any process.
/// }
/// assert!(indices.iter().copied().eq(0..1000));
/// # Ok::<(), discrete_herglotz::ensemble::EnsembleError>(())
/// ```
pub struct ShardedEnsemble<'e> {
    pub(crate) task: Task<'e>,
}

impl<'a, M: Members> Ensemble<'a, M> {
    /// The shards of the ensemble, to be computed by several processes. [`Ensemble::threads`] is ignored.
    ///
    /// # Errors
    /// Those of [`Ensemble::run`] before the computation starts.
    pub fn in_shards(&self, until: Until) -> Result<ShardedEnsemble<'_>, EnsembleError> {
        Ok(ShardedEnsemble { task: self.task(until, false)? })
    }

    /// Starts merging the shards of this ensemble. With a [checkpoint](Ensemble::checkpoint) the fold is called with the
    /// members of the shards that its file contains, from the first shard to the first one that is missing.
    ///
    /// # Errors
    /// [`EnsembleError`] if the checkpoint belongs to another ensemble, is damaged, or cannot be read or written.
    pub fn merge<'s, 'e>(
        &'s self,
        sharded: &'s ShardedEnsemble<'e>,
        fold: &'s mut dyn FnMut(&Member),
    ) -> Result<Merge<'s, 'e, 'a>, EnsembleError> {
        let open = |path| Shards::open(path, sharded.fingerprint(), sharded.count());
        let file = self.settings.checkpoint.as_deref().map(open).transpose()?;
        let (waiting, tally) = (Vec::new(), Tally::default());
        let mut merge = Merge { settings: &self.settings, sharded, fold, file, waiting, merged: 0, tally };
        merge.merge_waiting()?;
        Ok(merge)
    }
}

impl ShardedEnsemble<'_> {
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
pub struct Merge<'s, 'e, 'a> {
    settings: &'s Settings<'a>,
    sharded: &'s ShardedEnsemble<'e>,
    fold: &'s mut (dyn FnMut(&Member) + 's),
    file: Option<Shards>,
    /// The shards that arrived before their turn; only if there is no file from which they can be read.
    waiting: Vec<(usize, Shard)>,
    /// The number of shards whose members have been passed to the fold: all shards before this one.
    merged: usize,
    tally: Tally,
}

impl Merge<'_, '_, '_> {
    /// The shards that have neither arrived nor are in the checkpoint, in order.
    pub fn missing(&self) -> Vec<usize> {
        (self.merged..self.sharded.count()).filter(|shard| !self.has(*shard)).collect()
    }

    fn has(&self, shard: usize) -> bool {
        let is_saved = |file: &Shards| file.has(shard);
        shard < self.merged
            || self.waiting.iter().any(|(index, _)| *index == shard)
            || self.file.as_ref().is_some_and(is_saved)
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
        if self.file.is_some() { usize::MAX } else { self.merged.saturating_add(window) }
    }

    /// Adds a shard that was [computed](ShardedEnsemble::compute) by any process, saves it in the checkpoint, and
    /// passes the shards to the fold whose turn has come. Adding a shard again has no effect.
    ///
    /// # Errors
    /// [`EnsembleError`]: the words are not a shard of this ensemble, or the checkpoint cannot be written or read.
    pub fn add(&mut self, words: &[u64]) -> Result<(), EnsembleError> {
        let expected = |shard: usize| self.sharded.task.members_of(shard).len();
        match checkpoint::shard_of(words, self.sharded.task.members.dimension()) {
            Some((index, shard)) if index < self.sharded.count() && shard.members.len() == expected(index) => {
                self.add_shard(index, shard)
            }
            _ => Err(EnsembleError::ForeignShard),
        }
    }

    pub(crate) fn add_shard(&mut self, index: usize, shard: Shard) -> Result<(), EnsembleError> {
        if self.has(index) {
            return Ok(());
        }
        if let Some(file) = &mut self.file {
            file.write(index, &shard)?;
        }
        if index == self.merged {
            self.merge_next(shard);
            return self.merge_waiting();
        }
        if self.file.is_none() {
            self.waiting.push((index, shard));
        }
        Ok(())
    }

    /// Passes to the fold the shards that have arrived, up to the first one that is missing.
    fn merge_waiting(&mut self) -> Result<(), EnsembleError> {
        loop {
            let next = match &mut self.file {
                Some(file) => {
                    let task = &self.sharded.task;
                    file.read(self.merged, (task.members_of(self.merged).len(), task.members.dimension()))?
                }
                None => {
                    let place = self.waiting.iter().position(|(index, _)| *index == self.merged);
                    place.map(|place| self.waiting.swap_remove(place).1)
                }
            };
            let Some(shard) = next else { return Ok(()) };
            self.merge_next(shard);
        }
    }

    fn merge_next(&mut self, mut shard: Shard) {
        if !shard.with_causes {
            self.sharded.task.run_again(&mut shard);
        }
        self.tally.batch_kernel += shard.batch_kernel;
        self.tally.own_plans += self.sharded.task.own_plans(shard.members.len().saturating_sub(shard.batch_kernel));
        for member in &shard.members {
            self.tally.add(member);
            (self.fold)(member);
        }
        self.merged += 1;
        self.settings.report_progress(self.merged, self.sharded.count());
    }
}

/// Computes the missing shards on several threads, and merges them in their order.
pub(crate) fn merge_in_order(
    merge: &mut Merge<'_, '_, '_>,
    sharded: &ShardedEnsemble<'_>,
    threads: usize,
) -> Result<Tally, EnsembleError> {
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
