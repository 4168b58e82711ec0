//! Distribution of shards to workers.

/// The maximum number of open shards of a worker: one that it computes, and one to continue with while a result is
/// sent.
const MAX_OPEN_SHARDS: usize = 2;

/// The open shards of an ensemble and their workers: the bookkeeping of the rank that hands them out.
///
/// ```
/// let mut dispatch = ensemble_mpi::Dispatch::new(3, 2);
/// // The second shard is in the checkpoint already.
/// let done = |shard: usize| shard == 1;
/// assert_eq!(dispatch.next(0, usize::MAX, done), Some(0));
/// assert_eq!(dispatch.next(1, usize::MAX, done), Some(2));
/// assert_eq!(dispatch.next(1, usize::MAX, done), None);
/// assert!(dispatch.received(0, 0) && dispatch.received(1, 2));
/// assert!(dispatch.is_over(done));
/// ```
#[derive(Clone, Debug)]
pub struct Dispatch {
    /// The first shard that has neither been handed out nor skipped.
    next: usize,
    count: usize,
    /// The open shards of each worker, in the order in which it computes them.
    open: Vec<Vec<usize>>,
}

impl Dispatch {
    /// The distribution of `count` shards to `workers` workers.
    pub fn new(count: usize, workers: usize) -> Self {
        Dispatch { next: 0, count, open: vec![Vec::with_capacity(MAX_OPEN_SHARDS); workers] }
    }

    /// The next shard for a worker, below a bound; `None` where the worker has enough shards, or there is no shard.
    /// Shards that are done are skipped.
    pub fn next(&mut self, worker: usize, bound: usize, done: impl Fn(usize) -> bool) -> Option<usize> {
        let open = self.open.get_mut(worker).filter(|open| open.len() < MAX_OPEN_SHARDS)?;
        while self.next < self.count && done(self.next) {
            self.next += 1;
        }
        if self.next >= self.count.min(bound) {
            return None;
        }
        let shard = self.next;
        self.next += 1;
        open.push(shard);
        Some(shard)
    }

    /// Whether a worker can be given another shard, and there are any left.
    pub fn accepts_shard(&self, worker: usize) -> bool {
        self.next < self.count && self.open(worker).len() < MAX_OPEN_SHARDS
    }

    /// Records that a worker has sent a shard; returns whether the shard was open with this worker.
    pub fn received(&mut self, worker: usize, shard: usize) -> bool {
        let Some(open) = self.open.get_mut(worker) else { return false };
        let place = open.iter().position(|of| *of == shard);
        place.map(|place| open.remove(place)).is_some()
    }

    /// The open shards of a worker.
    pub fn open(&self, worker: usize) -> &[usize] {
        self.open.get(worker).map_or(&[], Vec::as_slice)
    }

    /// Whether no shard is open, and none is left to hand out.
    pub fn is_over(&self, done: impl Fn(usize) -> bool) -> bool {
        self.open.iter().all(Vec::is_empty) && (self.next..self.count).all(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every shard that is not done is handed out once, for any speeds of the workers, and none at or beyond the bound.
    #[test]
    fn every_missing_shard_once() {
        for workers in 1..5 {
            for window in [1, 3, usize::MAX] {
                let mut dispatch = Dispatch::new(100, workers);
                let (mut merged, mut handed) = ([false; 100], Vec::new());
                (0..100).step_by(7).for_each(|shard| merged[shard] = true);
                let mut turns = 0;
                while !dispatch.is_over(|shard| merged[shard]) {
                    let front = merged.iter().position(|done| !done).unwrap_or(100);
                    let bound = front.saturating_add(window);
                    for worker in 0..workers {
                        while let Some(shard) = dispatch.next(worker, bound, |shard| merged[shard]) {
                            assert!(shard < bound && shard % 7 != 0 && dispatch.open(worker).len() <= MAX_OPEN_SHARDS);
                            handed.push(shard);
                        }
                        // Worker 0 is ten times slower than the others.
                        if (worker > 0 || turns % 10 == 0)
                            && let [shard, ..] = *dispatch.open(worker)
                        {
                            assert!(dispatch.received(worker, shard));
                            merged[shard] = true;
                        }
                    }
                    turns += 1;
                    assert!(turns < 2000, "{workers} workers, window {window}");
                }
                assert_eq!(handed.len(), 85, "{workers} workers, window {window}");
                assert!(handed.is_sorted() && merged.iter().all(|done| *done));
            }
        }
    }

    #[test]
    fn what_a_worker_does_not_have_it_cannot_send() {
        let mut dispatch = Dispatch::new(3, 2);
        assert_eq!(dispatch.next(0, 3, |_| false), Some(0));
        assert!(!dispatch.received(1, 0) && !dispatch.received(0, 1) && !dispatch.received(9, 0));
        assert_eq!(dispatch.next(9, 3, |_| false), None);
        assert!(dispatch.received(0, 0) && !dispatch.received(0, 0));
        assert!(!dispatch.is_over(|_| false) && dispatch.is_over(|_| true));
    }
}
