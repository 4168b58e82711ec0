//! Sparsity patterns of assembled matrices.

use crate::AssemblyError;

/// The pattern of the lower triangle of a matrix that is assembled from elements, in compressed columns.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    /// The index of the first entry of each column, and the total number of entries at the end.
    pub begins: Vec<u32>,
    /// The row of each entry, sorted in each column.
    pub rows: Vec<u32>,
}

/// The index of an entry in the row or column of a fixed component, which is not stored.
pub(crate) const NOWHERE: u32 = u32::MAX;

impl Pattern {
    /// The pattern of the diagonal and of all pairs of unknowns that share an element. `visit` calls its argument with
    /// the padded indices of each element, in which the first unknown has the index 1.
    ///
    /// # Errors
    /// [`AssemblyError::Unknowns`] if there are more entries than 32-bit indices allow.
    pub fn new(unknowns: usize, visit: impl Fn(&mut dyn FnMut(&[usize]))) -> Result<Self, AssemblyError> {
        let real = |place: usize| (1..=unknowns).contains(&place);
        // The column is in the high bits, so that sorting gives the order of the matrix.
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

    /// The index of the entry of two padded indices, in either order; [`NOWHERE`] if one is fixed.
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

/// The pattern of a whole matrix, with both triangles.
#[derive(Clone, Debug)]
pub(crate) struct FullPattern {
    /// The index of the first entry of each column, and the total number of entries at the end.
    pub begins: Vec<u32>,
    /// The row of each entry, sorted in each column.
    pub rows: Vec<u32>,
    /// The index in the lower triangle of each entry or of its mirror image.
    pub lower: Vec<u32>,
}

impl FullPattern {
    /// Builds the pattern from that of the lower triangle.
    ///
    /// # Errors
    /// [`AssemblyError::Unknowns`] if there are more entries than 32-bit indices allow.
    pub fn new(triangle: &Pattern) -> Result<Self, AssemblyError> {
        let n = triangle.unknowns();
        let total = 2 * triangle.rows.len() - n;
        if total >= NOWHERE as usize {
            return Err(AssemblyError::Unknowns { found: n, most: NOWHERE as usize });
        }
        let columns =
            || triangle.begins.windows(2).enumerate().map(|(c, ends)| (c, ends[0] as usize..ends[1] as usize));
        let mut begins = vec![0u32; n + 1];
        for (column, range) in columns() {
            begins[column + 1] += range.len() as u32;
            for row in &triangle.rows[range] {
                if *row as usize != column {
                    begins[*row as usize + 1] += 1;
                }
            }
        }
        for column in 0..n {
            begins[column + 1] += begins[column];
        }
        let (mut rows, mut lower) = (vec![0; total], vec![0; total]);
        let mut next = begins.clone();
        let mut put = |column: usize, row: u32, at: usize| {
            let place = next[column] as usize;
            (rows[place], lower[place]) = (row, at as u32);
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
        Ok(FullPattern { begins, rows, lower })
    }

    /// The number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.begins.len() - 1
    }

    /// The index of the entry in the row of the padded index `a` and the column of `b`; [`NOWHERE`] if one is fixed.
    pub fn entry(&self, a: usize, b: usize) -> u32 {
        let n = self.unknowns();
        if !(1..=n).contains(&a) || !(1..=n).contains(&b) {
            return NOWHERE;
        }
        let (begin, end) = (self.begins[b - 1], self.begins[b]);
        let rows = &self.rows[begin as usize..end as usize];
        rows.binary_search(&(a as u32 - 1)).map_or(NOWHERE, |at| begin + at as u32)
    }

    /// The columns, each with the range of its entries.
    pub fn columns(&self) -> impl Iterator<Item = (usize, std::ops::Range<usize>)> {
        self.begins.windows(2).enumerate().map(|(c, ends)| (c, ends[0] as usize..ends[1] as usize))
    }

    /// Replaces each entry by a dense block of `size` times `size`; the unknowns of a block are consecutive. Returns
    /// the starts of the columns, and the rows.
    ///
    /// # Errors
    /// [`AssemblyError::Unknowns`] if there are more entries than `i32::MAX`, the range of faer's 32-bit indices.
    pub fn blocks(&self, size: usize) -> Result<(Vec<u32>, Vec<u32>), AssemblyError> {
        let n = self.unknowns();
        let most = i32::MAX as usize;
        if self.rows.len().saturating_mul(size * size) > most {
            return Err(AssemblyError::Unknowns { found: n, most: most / (size * size) });
        }
        let mut begins = Vec::with_capacity(n * size + 1);
        let mut rows = Vec::with_capacity(self.rows.len() * size * size);
        begins.push(0);
        for (_, range) in self.columns() {
            for _ in 0..size {
                for row in &self.rows[range.clone()] {
                    rows.extend((0..size as u32).map(|i| row * size as u32 + i));
                }
                begins.push(rows.len() as u32);
            }
        }
        Ok((begins, rows))
    }
}
