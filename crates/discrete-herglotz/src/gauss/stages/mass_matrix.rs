//! The inverse mass matrix of the general step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::MAX_DIMENSION_IN_LANES;
use crate::gauss::system::{PointRef, SystemAtPoints};
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::Saved;
use crate::system::mass_matrix::MAX_BY_COLUMNS;
use contact_geom::nalgebra::{DMatrix, DMatrixViewMut, DVectorViewMut, SMatrix, SVector};
use contact_geom::{Structure, support::linear, vector};
use pulp::Simd;

/// The inverse mass matrix, which maps momentum residuals to changes of velocity.
pub(crate) enum Mass {
    /// `W^-1` if it is constant.
    Constant(DMatrix<f64>),
    /// `W^-1` at the stages, recomputed in each step.
    Stages(Box<StageInverses>),
}

/// `W^-1` at the stages.
pub(crate) struct StageInverses {
    /// The entries, by rows.
    rows: Vec<Stages>,
    /// The workspace for an inversion at one stage, if W is not inverted in SIMD lanes.
    one: Option<OneStage>,
}

/// The workspace for an inversion at one stage.
struct OneStage {
    w: DMatrix<f64>,
    /// A copy of W, which the solution overwrites.
    copy: DMatrix<f64>,
    inverse: DMatrix<f64>,
}

impl Mass {
    /// Uses `W^-1` at the start of the run if it is constant; `by_points` states that the system is evaluated at one point
    /// at a time.
    pub fn new(structure: &Structure, inverse: DMatrix<f64>, by_points: bool) -> Self {
        if structure.constant_mass || structure.separable {
            return Mass::Constant(inverse);
        }
        let n = inverse.nrows();
        let zeros = || DMatrix::zeros(n, n);
        let one =
            (by_points || n > MAX_DIMENSION_IN_LANES).then(|| OneStage { w: zeros(), copy: zeros(), inverse: zeros() });
        Mass::Stages(Box::new(StageInverses { rows: vec![Stages::ZERO; n * n], one }))
    }

    /// Computes `W^-1` at a block of stages; `false` if W is singular there.
    #[inline(always)]
    pub fn invert<S: Simd, const N: usize>(&mut self, r: usize, w: &SMatrix<Lanes<S>, N, N>) -> bool {
        let Mass::Stages(stored) = self else { return true };
        let rows = &mut stored.rows[..N * N];
        for j in 0..N {
            let mut column: SVector<Lanes<S>, N> = vector!(|i| Lanes::splat(if i == j { 1.0 } else { 0.0 }));
            if linear::solve_in_kernel(&mut w.clone(), &mut column).is_err() {
                return false;
            }
            for i in 0..N {
                rows[i * N + j].set(r, column[i]);
            }
        }
        true
    }

    /// The same for n coordinates, where n is known at run time, with W by columns.
    #[inline(always)]
    pub fn invert_slice<S: Simd>(&mut self, r: usize, n: usize, w: &[Lanes<S>]) -> bool {
        let Mass::Stages(stored) = self else { return true };
        let rows = &mut stored.rows[..n * n];
        for j in 0..n {
            let mut copy = [Lanes::<S>::splat(0.0); MAX_DIMENSION_IN_LANES * MAX_DIMENSION_IN_LANES];
            copy[..n * n].copy_from_slice(w);
            let mut column = [Lanes::<S>::splat(0.0); MAX_DIMENSION_IN_LANES];
            column[j] = Lanes::splat(1.0);
            let mut matrix = DMatrixViewMut::from_slice(&mut copy[..n * n], n, n);
            let solved = linear::solve_in_kernel(&mut matrix, &mut DVectorViewMut::from_slice(&mut column[..n], n));
            if solved.is_err() {
                return false;
            }
            for i in 0..n {
                rows[i * n + j].set(r, column[i]);
            }
        }
        true
    }

    /// Computes `W^-1` at one stage, if W is not inverted in SIMD lanes, and repeats it for all following stages; `false`
    /// if W is singular there.
    pub fn invert_stage(&mut self, system: &dyn SystemAtPoints, stage: usize, t: f64, x: PointRef<'_>) -> bool {
        let Mass::Stages(stored) = self else { return true };
        let StageInverses { rows, one: Some(OneStage { w, copy, inverse }) } = &mut **stored else { return true };
        system.mass_matrix(t, x, w);
        let n = w.nrows();
        if n > MAX_BY_COLUMNS {
            inverse.copy_from(w);
            if !inverse.try_inverse_mut() {
                return false;
            }
        } else {
            inverse.fill_with_identity();
            for mut column in inverse.column_iter_mut() {
                copy.copy_from(w);
                if linear::solve(copy, &mut column).is_err() {
                    return false;
                }
            }
        }
        for i in 0..n {
            for j in 0..n {
                rows[i * n + j].0[stage..].fill(inverse[(i, j)]);
            }
        }
        true
    }

    /// Whether W is inverted at one stage after another.
    pub fn is_inverted_by_stages(&self) -> bool {
        matches!(self, Mass::Stages(stored) if stored.one.is_some())
    }

    /// `W^-1` as a kernel for n coordinates reads it.
    #[inline(always)]
    pub fn inverse(&self, n: usize) -> InverseMass<'_> {
        match self {
            Mass::Constant(w) => InverseMass::Constant(&w.as_slice()[..n * n]),
            Mass::Stages(stored) => InverseMass::Stages(&stored.rows[..n * n]),
        }
    }
}

/// The entries of `W^-1`.
#[derive(Clone, Copy)]
pub(crate) enum InverseMass<'r> {
    /// By columns.
    Constant(&'r [f64]),
    /// By rows.
    Stages(&'r [Stages]),
}

impl InverseMass<'_> {
    /// An entry, for n coordinates, at a block of stages.
    #[inline(always)]
    pub fn entry<S: Simd>(&self, n: usize, i: usize, j: usize, r: usize) -> Lanes<S> {
        match self {
            InverseMass::Constant(w) => Lanes::splat(w[j * n + i]),
            InverseMass::Stages(w) => w[i * n + j].block(r),
        }
    }
}

/// A constant `W^-1` is not saved; that at the stages is part of the last step.
impl Saved for Mass {
    fn save(&self, to: &mut Vec<u64>) {
        if let Mass::Stages(stored) = self {
            stored.rows.save(to);
        }
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        if let Mass::Stages(stored) = self {
            stored.rows.load(from)?;
        }
        Some(())
    }
}
