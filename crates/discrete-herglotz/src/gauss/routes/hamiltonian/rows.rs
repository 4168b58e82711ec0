//! The vectors of a step at its stages.

use crate::numbers::registers::Stages;

/// The right-hand sides of the stage equations and the stages, one row for each component, in one allocation: a
/// processor delays a load if the last twelve bits of its address agree with those of a recent store.
///
/// The order is that of [`Rows`]: the right-hand sides of y = (q, P, z, 1 - rho), and then the rows of the stages.
pub(crate) struct StageRows {
    rows: Vec<Stages>,
    /// The number of coordinates.
    n: usize,
}

/// The rows for N coordinates.
pub(super) struct Rows<'w, const N: usize> {
    /// The right-hand sides, multiplied by the weights `h b`: `H_p`, `-rho H_q`, `p . H_p - H` and `-rho H_z`.
    pub moved: &'w mut [Stages; N],
    pub force: &'w mut [Stages; N],
    pub l: &'w mut Stages,
    pub rate: &'w mut Stages,
    /// The velocities `H_p`.
    pub v: &'w mut [Stages; N],
    /// The stages: positions, momenta, actions, `1 - rho`.
    pub x: &'w mut [Stages; N],
    pub p: &'w mut [Stages; N],
    pub z: &'w mut Stages,
    pub one_minus_rho: &'w mut Stages,
}

impl StageRows {
    pub fn zeros(n: usize) -> Self {
        StageRows { rows: vec![Stages::ZERO; 5 * n + 4], n }
    }

    /// The rows for a number of coordinates that is known at compile time; `None` if it is another number.
    #[inline(always)]
    pub(super) fn for_dimension<const N: usize>(&mut self) -> Option<Rows<'_, N>> {
        let (moved, rest) = self.rows.split_first_chunk_mut()?;
        let (force, rest) = rest.split_first_chunk_mut()?;
        let ([l, rate], rest) = rest.split_first_chunk_mut()?;
        let (v, rest) = rest.split_first_chunk_mut()?;
        let (x, rest) = rest.split_first_chunk_mut()?;
        let (p, rest) = rest.split_first_chunk_mut()?;
        let [z, one_minus_rho] = rest.first_chunk_mut()?;
        Some(Rows { moved, force, l, rate, v, x, p, z, one_minus_rho })
    }

    /// The right-hand sides, in the order of y.
    pub fn right_hand_sides(&self) -> &[Stages] {
        &self.rows[..2 * self.n + 2]
    }

    pub fn right_hand_sides_mut(&mut self) -> &mut [Stages] {
        &mut self.rows[..2 * self.n + 2]
    }

    /// The velocities and the stages: positions, momenta, actions, `1 - rho`.
    pub fn stages(&self) -> &[Stages] {
        &self.rows[2 * self.n + 2..]
    }

    pub fn stages_mut(&mut self) -> &mut [Stages] {
        &mut self.rows[2 * self.n + 2..]
    }

    pub fn moved(&self) -> &[Stages] {
        &self.right_hand_sides()[..self.n]
    }

    pub fn force(&self) -> &[Stages] {
        &self.right_hand_sides()[self.n..2 * self.n]
    }

    pub fn l(&self) -> &Stages {
        &self.right_hand_sides()[2 * self.n]
    }

    pub fn rate(&self) -> &Stages {
        &self.right_hand_sides()[2 * self.n + 1]
    }

    pub fn v(&self) -> &[Stages] {
        &self.stages()[..self.n]
    }

    pub fn x(&self) -> &[Stages] {
        &self.stages()[self.n..2 * self.n]
    }

    pub fn p(&self) -> &[Stages] {
        &self.stages()[2 * self.n..3 * self.n]
    }

    pub fn z(&self) -> &Stages {
        &self.stages()[3 * self.n]
    }

    pub fn one_minus_rho(&self) -> &Stages {
        &self.stages()[3 * self.n + 1]
    }
}
