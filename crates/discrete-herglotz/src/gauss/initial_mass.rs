//! The mass matrix at the start of a run.

use crate::gauss::system::{PointRef, SystemAtPoints};
use crate::system::mass_matrix::inverse;
use crate::{InputError, StepError};
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_abs_or_nan;

/// The mass matrix W at the start of a run, and its inverse.
pub(crate) struct InitialMass {
    pub w: DMatrix<f64>,
    pub inverse: DMatrix<f64>,
}

impl InitialMass {
    /// # Errors
    /// [`InputError::FirstStep`] if W is singular to round-off.
    pub fn of(system: &dyn SystemAtPoints, t: f64, start: PointRef<'_>) -> Result<Self, InputError> {
        let n = system.dimension();
        let mut w = DMatrix::zeros(n, n);
        system.mass_matrix(t, start, &mut w);
        let inverse = inverse(&w).map_err(|e| InputError::FirstStep(StepError::Singular { pivot: e.pivot }))?;
        // This condition number is invariant under scaling of the coordinates: |W^-1| |W| = 1 for every diagonal W.
        let product = |i: usize, j: usize| (0..n).map(|k| inverse[(i, k)].abs() * w[(k, j)].abs()).sum::<f64>();
        let condition = max_abs_or_nan((0..n).map(|i| (0..n).map(|j| product(i, j)).sum()));
        if condition.is_nan() || condition > 0.1 / f64::EPSILON {
            return Err(InputError::FirstStep(StepError::Singular { pivot: 1.0 / condition }));
        }
        Ok(InitialMass { w, inverse })
    }
}
