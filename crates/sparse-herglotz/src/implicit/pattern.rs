//! Sparsity patterns of assembled matrices.

use crate::SparseError;

/// The pattern of the lower triangle of a matrix that is assembled from elements, in compressed columns.
#[derive(Clone, Debug)]
pub(crate) struct LowerPattern {
    /// The index of the first entry of each column, and the total number of entries at the end.
    pub column_starts: Vec<u32>,
    /// The row of each entry, sorted in each column.
    pub rows: Vec<u32>,
}

/// The index of an entry in the row or column of a fixed component, which is not stored.
pub(crate) const NO_ENTRY: u32 = u32::MAX;

impl LowerPattern {
    /// The pattern of the diagonal and of all pairs of unknowns that share an element. `visit` calls its argument with
    /// the padded indices of each element, in which the first unknown has the index 1.
    ///
    /// # Errors
    /// [`SparseError::Unknowns`] if there are more entries than 32-bit indices allow.
    pub fn new(unknowns: usize, visit: impl Fn(&mut dyn FnMut(&[usize]))) -> Result<Self, SparseError> {
        let is_free = |index: usize| (1..=unknowns).contains(&index);
        // The column is in the high bits, so that sorting gives the order of the matrix.
        let mut entries: Vec<u64> = (0..unknowns as u64).map(|i| i << 32 | i).collect();
        visit(&mut |indices| {
            for (i, &a) in indices.iter().enumerate() {
                for &b in &indices[..i] {
                    if is_free(a) && is_free(b) {
                        let (row, column) = if a < b { (b, a) } else { (a, b) };
                        entries.push((column as u64 - 1) << 32 | (row as u64 - 1));
                    }
                }
            }
        });
        entries.sort_unstable();
        entries.dedup();
        if entries.len() >= NO_ENTRY as usize {
            return Err(SparseError::Unknowns { found: unknowns, most: NO_ENTRY as usize });
        }
        let mut column_starts = vec![0; unknowns + 1];
        for entry in &entries {
            column_starts[(entry >> 32) as usize + 1] += 1;
        }
        for column in 0..unknowns {
            column_starts[column + 1] += column_starts[column];
        }
        Ok(LowerPattern { column_starts, rows: entries.into_iter().map(|entry| entry as u32).collect() })
    }

    /// The number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// The index of the entry of two padded indices, in either order; [`NO_ENTRY`] if one is fixed.
    pub fn entry(&self, a: usize, b: usize) -> u32 {
        let n = self.unknowns();
        if !(1..=n).contains(&a) || !(1..=n).contains(&b) {
            return NO_ENTRY;
        }
        let (row, column) = (a.max(b) as u32 - 1, a.min(b) - 1);
        let begin = self.column_starts[column];
        let rows = &self.rows[begin as usize..self.column_starts[column + 1] as usize];
        rows.binary_search(&row).map_or(NO_ENTRY, |at| begin + at as u32)
    }
}

/// The pattern of a whole matrix, with both triangles.
#[derive(Clone, Debug)]
pub(crate) struct FullPattern {
    /// The index of the first entry of each column, and the total number of entries at the end.
    pub column_starts: Vec<u32>,
    /// The row of each entry, sorted in each column.
    pub rows: Vec<u32>,
    /// The index in the lower triangle of each entry or of its mirror image.
    pub lower: Vec<u32>,
}

impl FullPattern {
    /// Builds the pattern from that of the lower triangle.
    ///
    /// # Errors
    /// [`SparseError::Unknowns`] if there are more entries than 32-bit indices allow.
    pub fn new(triangle: &LowerPattern) -> Result<Self, SparseError> {
        let n = triangle.unknowns();
        let total = 2 * triangle.rows.len() - n;
        if total >= NO_ENTRY as usize {
            return Err(SparseError::Unknowns { found: n, most: NO_ENTRY as usize });
        }
        let columns =
            || triangle.column_starts.windows(2).enumerate().map(|(c, ends)| (c, ends[0] as usize..ends[1] as usize));
        let mut column_starts = vec![0u32; n + 1];
        for (column, range) in columns() {
            column_starts[column + 1] += range.len() as u32;
            for row in &triangle.rows[range] {
                if *row as usize != column {
                    column_starts[*row as usize + 1] += 1;
                }
            }
        }
        for column in 0..n {
            column_starts[column + 1] += column_starts[column];
        }
        let (mut rows, mut lower) = (vec![0; total], vec![0; total]);
        let mut next = column_starts.clone();
        let mut put = |column: usize, row: u32, at: usize| {
            let entry = next[column] as usize;
            (rows[entry], lower[entry]) = (row, at as u32);
            next[column] += 1;
        };
        // When a column is reached, its rows above the diagonal are already there in order, from the columns before it.
        for (column, range) in columns() {
            for at in range {
                let row = triangle.rows[at];
                put(column, row, at);
                if row as usize != column {
                    put(row as usize, column as u32, at);
                }
            }
        }
        Ok(FullPattern { column_starts, rows, lower })
    }

    /// The number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// The index of the entry in the row of the padded index `a` and the column of `b`; [`NO_ENTRY`] if one is fixed.
    pub fn entry(&self, a: usize, b: usize) -> u32 {
        let n = self.unknowns();
        if !(1..=n).contains(&a) || !(1..=n).contains(&b) {
            return NO_ENTRY;
        }
        let (begin, end) = (self.column_starts[b - 1], self.column_starts[b]);
        let rows = &self.rows[begin as usize..end as usize];
        rows.binary_search(&(a as u32 - 1)).map_or(NO_ENTRY, |at| begin + at as u32)
    }

    /// The columns, each with the range of its entries.
    pub fn columns(&self) -> impl Iterator<Item = (usize, std::ops::Range<usize>)> {
        self.column_starts.windows(2).enumerate().map(|(c, ends)| (c, ends[0] as usize..ends[1] as usize))
    }

    /// Replaces each entry by a dense block of `size` times `size`; the unknowns of a block are consecutive. Returns
    /// the starts of the columns, and the rows.
    ///
    /// # Errors
    /// [`SparseError::Unknowns`] if there are more entries than `i32::MAX`, the range of faer's 32-bit indices.
    pub fn blocks(&self, size: usize) -> Result<(Vec<u32>, Vec<u32>), SparseError> {
        let n = self.unknowns();
        let most = i32::MAX as usize;
        if self.rows.len().saturating_mul(size * size) > most {
            return Err(SparseError::Unknowns { found: n, most: most / (size * size) });
        }
        let mut column_starts = Vec::with_capacity(n * size + 1);
        let mut rows = Vec::with_capacity(self.rows.len() * size * size);
        column_starts.push(0);
        for (_, range) in self.columns() {
            for _ in 0..size {
                for row in &self.rows[range.clone()] {
                    rows.extend((0..size as u32).map(|i| row * size as u32 + i));
                }
                column_starts.push(rows.len() as u32);
            }
        }
        Ok((column_starts, rows))
    }
}
