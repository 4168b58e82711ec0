//! The matrix of the iteration of a condensed step, and the vectors that it multiplies.

use crate::gauss::tables::condensed::Preconditioned;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::Saved;

/// The largest number of coordinates for which the vectors are adjacent to the matrix.
const FEW: usize = 4;

/// The matrix of the iteration, and four vectors over the stages.
///
/// For few coordinates they are adjacent, within 4096 bytes: a processor delays a load if the last twelve bits of its
/// address agree with those of a recent store (4K aliasing).
#[repr(C)]
pub(crate) struct Vectors {
    left: Preconditioned,
    /// The vectors one after another for few coordinates.
    few: [Stages; 4 * FEW],
    /// The same for more coordinates.
    many: Vec<Stages>,
    n: usize,
}

/// References to the matrix and to the vectors.
pub(crate) struct Parts<'r> {
    pub left: &'r mut Preconditioned,
    /// The unknown of the iteration: the acceleration without the linear force, `a_i + kappa Q_i`.
    pub rest: &'r mut [Stages],
    /// The positions.
    pub x: &'r mut [Stages],
    /// The accelerations of the last iteration.
    pub a: &'r mut [Stages],
    /// The part of the stage positions that is constant in an iteration: the terms of the state, and the terms with the
    /// tails of the matrices.
    pub base: &'r mut [Stages],
}

impl Vectors {
    /// The vectors of n coordinates, all 0.
    pub fn new(left: Preconditioned, n: usize) -> Self {
        let many = if n <= FEW { Vec::new() } else { vec![Stages::ZERO; 4 * n] };
        Vectors { left, few: [Stages::ZERO; 4 * FEW], many, n }
    }

    /// All parts; n is the number of coordinates, which is a constant in kernels.
    #[inline(always)]
    pub fn parts(&mut self, n: usize) -> Parts<'_> {
        let rows = if n <= FEW { &mut self.few[..4 * n] } else { &mut self.many[..4 * n] };
        let (rest, rows) = rows.split_at_mut(n);
        let (x, rows) = rows.split_at_mut(n);
        let (a, base) = rows.split_at_mut(n);
        Parts { left: &mut self.left, rest, x, a, base }
    }

    /// The matrix.
    pub fn left(&self) -> &Preconditioned {
        &self.left
    }

    /// The accelerations and the positions.
    pub fn solved(&self) -> [&[Stages]; 2] {
        let (rows, n) = (self.rows(), self.n);
        [&rows[2 * n..3 * n], &rows[n..2 * n]]
    }

    /// `rest`, `x`, `a` and `base` one after another.
    fn rows(&self) -> &[Stages] {
        if self.n <= FEW { &self.few[..4 * self.n] } else { &self.many }
    }
}

/// The vectors; the matrix is determined by the words that the route saves.
impl Saved for Vectors {
    fn save(&self, to: &mut Vec<u64>) {
        self.rows().save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        let n = self.n;
        let Parts { rest, x, a, base, .. } = self.parts(n);
        [rest, x, a, base].into_iter().try_for_each(|vector| vector.load(from))
    }
}
