//! Blocks of unknowns of a fixed size: the unit for the cache and for the distribution over threads.

/// The number of unknowns in a block. Positions before and after a drift, velocities and forces of a block together are
/// 32 KiB, the size of a common L1 data cache.
pub(crate) const BLOCK_SIZE: usize = 1024;

/// The number of unknowns from which on the blocks are distributed over threads: so many that a step takes long
/// compared with the start of its tasks.
pub(crate) const MIN_PARALLEL_UNKNOWNS: usize = 1 << 17;

/// The number of blocks for the given number of unknowns.
pub(crate) fn block_count(unknowns: usize) -> usize {
    unknowns.div_ceil(BLOCK_SIZE)
}

/// Items grouped by block, stored in one vector.
#[derive(Clone, Debug)]
pub(crate) struct ByBlock<T> {
    items: Vec<T>,
    /// The end of the items of each block.
    ends: Vec<usize>,
}

impl<T> ByBlock<T> {
    /// Groups items, given in any order with the index of their block. The order within a block is kept.
    pub fn new(blocks: usize, mut items: Vec<(u32, T)>) -> Self {
        items.sort_by_key(|(block, _)| *block);
        let mut ends = vec![0; blocks];
        for (block, _) in &items {
            if let Some(end) = ends.get_mut(*block as usize) {
                *end += 1;
            }
        }
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        ByBlock { items: items.into_iter().map(|(_, item)| item).collect(), ends }
    }

    /// The items of a block.
    #[inline]
    pub fn in_block(&self, block: usize) -> &[T] {
        let end = self.ends.get(block).copied().unwrap_or(0);
        let from = if block == 0 { 0 } else { self.ends.get(block - 1).copied().unwrap_or(end) };
        self.items.get(from..end).unwrap_or(&[])
    }
}
