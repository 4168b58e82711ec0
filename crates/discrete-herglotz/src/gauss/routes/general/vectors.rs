//! The vectors of the general step at its stages.

use crate::numbers::registers::Stages;

/// The number of vectors that are stored beside the matrix of the iteration: all of them for at most four coordinates.
const NEARBY: usize = 20;

/// Five vectors for each coordinate. For few coordinates they are within the struct, next to the matrix that multiplies
/// them: a processor delays a load if the last twelve bits of its address agree with those of a recent store.
#[repr(C)]
pub(crate) struct StageVectors {
    nearby: [Stages; NEARBY],
    /// Empty if all vectors are in `nearby`.
    many: Vec<Stages>,
    n: usize,
}

/// The vectors by kind, each with one entry for each coordinate.
pub(crate) struct Vectors<'w> {
    /// The velocities of the stages, and `L_v`.
    pub v: &'w mut [Stages],
    pub l_v: &'w mut [Stages],
    /// V and `rho L_q`, multiplied by the weights `h b`, and by g in transformed time.
    pub moved: &'w mut [Stages],
    pub force: &'w mut [Stages],
    /// The positions of the stages.
    pub x: &'w mut [Stages],
}

impl StageVectors {
    /// The vectors for `n` coordinates.
    pub fn zeros(n: usize) -> Self {
        let many = if 5 * n <= NEARBY { Vec::new() } else { vec![Stages::ZERO; 5 * n] };
        StageVectors { nearby: [Stages::ZERO; NEARBY], many, n }
    }

    /// The vectors for `n` coordinates, which a kernel knows at compile time.
    #[inline(always)]
    pub fn for_dimension(&mut self, n: usize) -> Vectors<'_> {
        let all = if 5 * n <= NEARBY { &mut self.nearby[..5 * n] } else { &mut self.many[..5 * n] };
        let (v, rest) = all.split_at_mut(n);
        let (l_v, rest) = rest.split_at_mut(n);
        let (moved, rest) = rest.split_at_mut(n);
        let (force, x) = rest.split_at_mut(n);
        Vectors { v, l_v, moved, force, x }
    }

    #[inline(always)]
    pub fn split(&mut self) -> Vectors<'_> {
        self.for_dimension(self.n)
    }

    /// The vectors that are saved first, v, `L_v`, moved and force, and the positions.
    pub fn moving_and_positions(&self) -> (&[Stages], &[Stages]) {
        self.all().split_at(4 * self.n)
    }

    /// The same, to restore them.
    pub fn moving_and_positions_mut(&mut self) -> (&mut [Stages], &mut [Stages]) {
        let n = self.n;
        let all = if 5 * n <= NEARBY { &mut self.nearby[..5 * n] } else { &mut self.many[..5 * n] };
        all.split_at_mut(4 * n)
    }

    pub fn v(&self) -> &[Stages] {
        self.part(0)
    }

    pub fn l_v(&self) -> &[Stages] {
        self.part(1)
    }

    pub fn moved(&self) -> &[Stages] {
        self.part(2)
    }

    pub fn force(&self) -> &[Stages] {
        self.part(3)
    }

    fn part(&self, kind: usize) -> &[Stages] {
        &self.all()[kind * self.n..][..self.n]
    }

    fn all(&self) -> &[Stages] {
        if 5 * self.n <= NEARBY { &self.nearby[..5 * self.n] } else { &self.many }
    }
}
