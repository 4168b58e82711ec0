//! Vectors that are aligned to cache lines.

use std::ops::{Deref, DerefMut};

/// The number of doubles in a cache line of 64 bytes, which is also the number in the widest vector register (AVX-512).
const DOUBLES_PER_CACHE_LINE: usize = 8;

/// A vector in which a given component lies at the beginning of a cache line. Vector registers that are loaded or
/// stored one after the other from there on do not straddle two cache lines.
#[derive(Debug)]
pub(crate) struct AlignedVector {
    storage: Vec<f64>,
    begin: usize,
    len: usize,
}

impl AlignedVector {
    /// Zeros, with the component `first` at the beginning of a cache line.
    pub fn zeros(len: usize, first: usize) -> Self {
        const LINE: usize = DOUBLES_PER_CACHE_LINE;
        let storage = vec![0.0; len + 2 * LINE];
        // The component `first` is placed at the next cache line, whose distance `align_offset` gives. Where
        // `align_offset` cannot compute it, the vector is not aligned, which costs only time.
        let offset = storage.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE);
        let begin = (offset + LINE - first % LINE) % LINE;
        AlignedVector { storage, begin, len }
    }

    /// A copy of a slice with its first component at the beginning of a cache line.
    pub fn from_slice(x: &[f64]) -> Self {
        let mut aligned = Self::zeros(x.len(), 0);
        aligned.copy_from_slice(x);
        aligned
    }

    /// The unknowns, padded with one fixed component at each end; the first unknown is at the beginning of a cache
    /// line.
    pub fn padded(x: &[f64]) -> Self {
        let mut aligned = Self::zeros(x.len() + 2, 1);
        if let Some(inner) = aligned.get_mut(1..=x.len()) {
            inner.copy_from_slice(x);
        }
        aligned
    }
}

impl Deref for AlignedVector {
    type Target = [f64];
    #[inline]
    fn deref(&self) -> &[f64] {
        &self.storage[self.begin..self.begin + self.len]
    }
}

impl DerefMut for AlignedVector {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.storage[self.begin..self.begin + self.len]
    }
}
