//! Where the entries of a sparse matrix stand.

use crate::AssemblyError;

/// The pattern of a matrix assembled from elements, by columns: its lower triangle where the matrix is symmetric.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    /// Where the entries of each column begin, and the end.
    pub begins: Vec<u32>,
    /// The row of each entry, sorted in each column.
    pub rows: Vec<u32>,
}

/// What stands for an entry in a fixed row or column.
pub(crate) const NOWHERE: u32 = u32::MAX;

impl Pattern {
    /// The diagonal, and what the elements couple. `visit` calls its argument with the places of each element, 1 for the first unknown.
    ///
    /// # Errors
    /// [`AssemblyError::Unknowns`] where there are more entries than 32 bits count.
    pub fn new(unknowns: usize, visit: impl Fn(&mut dyn FnMut(&[usize]))) -> Result<Self, AssemblyError> {
        let real = |place: usize| (1..=unknowns).contains(&place);
        // Column before row, so that sorted entries are in the order of the matrix.
        let mut entries: Vec<u64> = (0..unknowns as u64).map(|i| i << 32 | i).collect();
        visit(&mut |places| {
            for (i, &a) in places.iter().enumerate() {
                for &b in &places[..i] {
                    if real(a) && real(b) {
                        let (row, column) = if a < b { (b, a) } else { (a, b) };
                        entries.push((column as u64 - 1) << 32 | (row as u64 - 1));
                    }
                }
            }
        });
        entries.sort_unstable();
        entries.dedup();
        if entries.len() >= NOWHERE as usize {
            return Err(AssemblyError::Unknowns { found: unknowns, most: NOWHERE as usize });
        }
        let mut begins = vec![0; unknowns + 1];
        for entry in &entries {
            begins[(entry >> 32) as usize + 1] += 1;
        }
        for column in 0..unknowns {
            begins[column + 1] += begins[column];
        }
        Ok(Pattern { begins, rows: entries.into_iter().map(|entry| entry as u32).collect() })
    }

    /// The number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.begins.len() - 1
    }

    /// Where the entry of two places stands; [`NOWHERE`] where one is fixed.
    pub fn entry(&self, a: usize, b: usize) -> u32 {
        let n = self.unknowns();
        if !(1..=n).contains(&a) || !(1..=n).contains(&b) {
            return NOWHERE;
        }
        let (row, column) = (a.max(b) as u32 - 1, a.min(b) - 1);
        let begin = self.begins[column];
        let rows = &self.rows[begin as usize..self.begins[column + 1] as usize];
        rows.binary_search(&row).map_or(NOWHERE, |at| begin + at as u32)
    }
}
