//! Unknowns in blocks of one size: what is in the cache at a time, and what a thread takes.

/// The unknowns of a block. Positions, velocities and forces of a block are in the first cache together.
pub(crate) const BLOCK: usize = 1024;

/// The number of blocks of so many unknowns.
pub(crate) fn count(unknowns: usize) -> usize {
    unknowns.div_ceil(BLOCK)
}

/// Items by block, all in one vector.
#[derive(Clone, Debug)]
pub(crate) struct ByBlock<T> {
    items: Vec<T>,
    /// Where the items of each block end.
    ends: Vec<usize>,
}

impl<T> ByBlock<T> {
    /// From items in any order with their blocks; the order within a block is kept.
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
    pub fn of(&self, block: usize) -> &[T] {
        let end = self.ends.get(block).copied().unwrap_or(0);
        let from = if block == 0 { 0 } else { self.ends.get(block - 1).copied().unwrap_or(end) };
        self.items.get(from..end).unwrap_or(&[])
    }
}
