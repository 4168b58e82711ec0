//! The stages of a contact Lobatto step, and its memory.

use super::linear_system::LinearSystem;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, Scalar};

/// One stage.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage<const N: usize, const M: usize, T> {
    pub v: SVector<T, N>,
    pub rho: T,
    pub z: T,
    /// The impulse of the constraints.
    pub y: SVector<T, M>,
    pub q: SVector<T, N>,
    pub value: T,
    pub gradient: ChartVector<N, T>,
    pub c: SVector<T, M>,
    pub g: SMatrix<T, M, N>,
    /// The applied force f; 0 where there is none.
    pub applied: SVector<T, N>,
    /// `h rho (L_q + f) + G^T Y`.
    pub force: SVector<T, N>,
}

/// The memory of a step.
#[derive(Clone, Debug)]
pub(super) struct Workspace<const N: usize, const M: usize, T = f64> {
    pub stages: Vec<Stage<N, M, T>>,
    pub residual: Vec<T>,
    pub system: LinearSystem,
    /// The residual and the system of the velocity at the end.
    pub last_residual: Vec<T>,
    pub last_system: LinearSystem,
    pub evaluations: u64,
}

impl<const N: usize, const M: usize, T: Scalar> Workspace<N, M, T> {
    /// Memory for no stages, which takes the place of that in use; it allocates nothing.
    pub fn empty() -> Self {
        let (system, last_system) = (LinearSystem::new(0), LinearSystem::new(0));
        let (stages, residual, last_residual) = (Vec::new(), Vec::new(), Vec::new());
        Workspace { stages, residual, system, last_residual, last_system, evaluations: 0 }
    }

    pub fn new(s: usize) -> Self {
        let zero = T::zero();
        let (x, y) = (SVector::from_fn(|_, _| zero), SVector::from_fn(|_, _| zero));
        let stage = Stage {
            v: x,
            rho: T::one(),
            z: zero,
            y,
            q: x,
            value: zero,
            gradient: ChartVector { x, y: x, z: zero },
            c: y,
            g: SMatrix::from_fn(|_, _| zero),
            applied: x,
            force: x,
        };
        let n = s * (N + 2) + (s - 1) * M;
        Workspace {
            stages: vec![stage; s],
            residual: vec![zero; n],
            system: LinearSystem::new(n),
            last_residual: vec![zero; N + M],
            last_system: LinearSystem::new(N + M),
            evaluations: 0,
        }
    }
}
