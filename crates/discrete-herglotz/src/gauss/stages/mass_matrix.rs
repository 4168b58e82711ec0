//! The inverse mass matrix of the general step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::numbers::lanes::Lanes;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::Saved;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Structure, support::linear, vector};
use pulp::Simd;

/// The inverse mass matrix, which maps momentum residuals to changes of velocity.
pub(crate) enum Mass<const N: usize> {
    /// `W^-1` if it is constant.
    Constant(Box<SMatrix<f64, N, N>>),
    /// `W^-1` at the stages, by rows, recomputed in each step.
    Stages(Box<[[Stages; N]]>),
}

impl<const N: usize> Mass<N> {
    /// Uses `W^-1` at the start of the run if it is constant.
    pub fn new(structure: &Structure, inverse: Box<SMatrix<f64, N, N>>) -> Self {
        if structure.constant_mass || structure.separable {
            Mass::Constant(inverse)
        } else {
            Mass::Stages(vec![[Stages::ZERO; N]; N].into())
        }
    }

    /// Computes `W^-1` at a block of stages; `false` if W is singular there.
    #[inline(always)]
    pub fn invert<S: Simd>(&mut self, r: usize, w: &SMatrix<Lanes<S>, N, N>) -> bool {
        let Mass::Stages(stored) = self else { return true };
        for j in 0..N {
            let mut column: SVector<Lanes<S>, N> = vector!(|i| Lanes::splat(if i == j { 1.0 } else { 0.0 }));
            if linear::solve_in_kernel(&mut w.clone(), &mut column).is_err() {
                return false;
            }
            for i in 0..N {
                stored[i][j].set(r, column[i]);
            }
        }
        true
    }

    /// Stores `W^-1` of a stage, and repeats it for all following stages.
    pub fn keep(&mut self, stage: usize, inverse: &SMatrix<f64, N, N>) {
        let Mass::Stages(stored) = self else { return };
        for (i, row) in stored.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                entry.0[stage..].fill(inverse[(i, j)]);
            }
        }
    }

    /// An entry of `W^-1` at a block of stages.
    #[inline(always)]
    pub fn inverse<S: Simd>(&self, i: usize, j: usize, r: usize) -> Lanes<S> {
        match self {
            Mass::Constant(w) => Lanes::splat(w[(i, j)]),
            Mass::Stages(w) => w[i][j].block(r),
        }
    }
}

/// A constant `W^-1` is not saved; that at the stages is part of the last step.
impl<const N: usize> Saved for Mass<N> {
    fn save(&self, to: &mut Vec<u64>) {
        if let Mass::Stages(rows) = self {
            rows.iter().for_each(|row| row.save(to));
        }
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        if let Mass::Stages(rows) = self {
            rows.iter_mut().try_for_each(|row| row.load(from))?;
        }
        Some(())
    }
}
