//! The mass matrix at the start of a run.

use crate::solve::mass_matrix::{inverted, kept_mass_matrix};
use crate::{InputError, Problem, StepError};
use contact_geom::nalgebra::SMatrix;
use contact_geom::{Lagrangian, numbers::max_abs_or_nan};

/// The mass matrix W at the start of a run, and its inverse.
pub(crate) struct InitialMass<const N: usize> {
    pub w: Box<SMatrix<f64, N, N>>,
    pub inverse: Box<SMatrix<f64, N, N>>,
}

impl<const N: usize> InitialMass<N> {
    /// # Errors
    /// [`InputError::FirstStep`] if W is singular to round-off.
    pub fn of<L: Lagrangian<N>>(problem: &Problem<'_, L, N>) -> Result<Self, InputError> {
        let w = kept_mass_matrix(problem.lagrangian, problem.t0, &problem.start);
        let inverse = inverted(&w).map_err(|e| InputError::FirstStep(StepError::Singular { pivot: e.pivot }))?;
        // This condition number is invariant under scaling of the coordinates: |W^-1| |W| = 1 for every diagonal W.
        let condition = condition_of(&inverse, &w);
        if condition.is_nan() || condition > 0.1 / f64::EPSILON {
            return Err(InputError::FirstStep(StepError::Singular { pivot: 1.0 / condition }));
        }
        Ok(InitialMass { w, inverse })
    }
}

/// The largest row sum of `|W^-1| |W|`; entry by entry, to save stack space.
fn condition_of<const N: usize>(inverse: &SMatrix<f64, N, N>, w: &SMatrix<f64, N, N>) -> f64 {
    let product = |i: usize, j: usize| (0..N).map(|k| inverse[(i, k)].abs() * w[(k, j)].abs()).sum::<f64>();
    max_abs_or_nan((0..N).map(|i| (0..N).map(|j| product(i, j)).sum()))
}
