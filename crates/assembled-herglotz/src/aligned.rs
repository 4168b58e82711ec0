//! Vectors that begin where a vector register does.

use std::ops::{Deref, DerefMut};

/// The numbers in a line of the cache, or in the widest register.
const LINE: usize = 8;

/// A vector of which one component is at the beginning of a line of the cache: registers that are read and written one after the other from there
/// on do not lie across two lines.
#[derive(Debug)]
pub(crate) struct Aligned {
    all: Vec<f64>,
    begin: usize,
    len: usize,
}

impl Aligned {
    /// Zeros, with the component `first` at the beginning of a line.
    pub fn zeros(len: usize, first: usize) -> Self {
        let all = vec![0.0; len + 2 * LINE];
        // As many as `align_offset` leaves to the next line, and `first` before it. Where it cannot tell nothing is lost but time.
        let offset = all.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE);
        let begin = (offset + LINE - first % LINE) % LINE;
        Aligned { all, begin, len }
    }

    /// A copy of a slice with its first component at the beginning of a line.
    pub fn from_slice(x: &[f64]) -> Self {
        let mut aligned = Self::zeros(x.len(), 0);
        aligned.copy_from_slice(x);
        aligned
    }

    /// Unknowns between two fixed places, the first of them at the beginning of a line.
    pub fn between_fixed(x: &[f64]) -> Self {
        let mut aligned = Self::zeros(x.len() + 2, 1);
        if let Some(inner) = aligned.get_mut(1..=x.len()) {
            inner.copy_from_slice(x);
        }
        aligned
    }
}

impl Deref for Aligned {
    type Target = [f64];
    #[inline]
    fn deref(&self) -> &[f64] {
        &self.all[self.begin..self.begin + self.len]
    }
}

impl DerefMut for Aligned {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.all[self.begin..self.begin + self.len]
    }
}
