//! A matrix at each stage of a step.

use crate::numbers::registers::Stages;
use std::ops::{Index, IndexMut};

/// A vector at each stage, one entry for each coordinate.
pub(crate) type StageVector = Vec<Stages>;

/// The vector 0 at each stage.
pub(crate) fn stage_vector(n: usize) -> StageVector {
    vec![Stages::ZERO; n]
}

/// A matrix of n rows and columns at each stage, by rows.
#[derive(Clone, Debug)]
pub(crate) struct StageMatrix {
    n: usize,
    entries: Vec<Stages>,
}

impl StageMatrix {
    pub fn zeros(n: usize) -> Self {
        StageMatrix { n, entries: vec![Stages::ZERO; n * n] }
    }

    /// Copies the entries of another matrix of the same size.
    #[inline(always)]
    pub fn copy_from(&mut self, other: &Self) {
        self.entries.copy_from_slice(&other.entries);
    }
}

impl Index<(usize, usize)> for StageMatrix {
    type Output = Stages;

    #[inline(always)]
    fn index(&self, (i, j): (usize, usize)) -> &Stages {
        &self.entries[i * self.n + j]
    }
}

impl IndexMut<(usize, usize)> for StageMatrix {
    #[inline(always)]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut Stages {
        &mut self.entries[i * self.n + j]
    }
}
