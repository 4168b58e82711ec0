//! Consistent initial values of a run, and the structure and mass matrix of its Lagrangian there.

use crate::solve::mass_matrix::{inverted, kept_mass_matrix};
use crate::{InputError, StepError, integration::check_claims, theory::legendre_inverse};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{GeometryError, Lagrangian, PhasePoint, Structure, VelocityPoint, numbers::max_abs_or_nan};

/// The initial values of a run.
pub(crate) struct ConsistentStart<const N: usize> {
    pub start: VelocityPoint<N>,
    pub structure: Structure,
    /// The mass matrix W and its inverse.
    pub w: Box<SMatrix<f64, N, N>>,
    pub inverse: Box<SMatrix<f64, N, N>>,
}

impl<const N: usize> ConsistentStart<N> {
    /// Computes the initial velocity from the momentum, checks the declared structure there unless a checked one is
    /// given, and inverts W.
    pub fn of(
        lagrangian: &impl Lagrangian<N>,
        probed: Option<Structure>,
        t0: f64,
        state: &PhasePoint<N>,
        guess: SVector<f64, N>,
    ) -> Result<Self, InputError> {
        state.check()?;
        if !t0.is_finite() {
            return Err(GeometryError::NonFinite { what: "t0", index: 0, value: t0 }.into());
        }
        let start = legendre_inverse(lagrangian, t0, state, &guess).map_err(InputError::FirstStep)?;
        let structure = probed.map_or_else(|| check_claims(lagrangian, t0, &start), Ok)?;
        let w = kept_mass_matrix(lagrangian, t0, &start);
        let inverse = inverted(&w).map_err(|e| InputError::FirstStep(StepError::Singular { pivot: e.pivot }))?;
        // This condition number is invariant under scaling of the coordinates: |W^-1| |W| = 1 for every diagonal W.
        let condition = condition_of(&inverse, &w);
        if condition.is_nan() || condition > 0.1 / f64::EPSILON {
            return Err(InputError::FirstStep(StepError::Singular { pivot: 1.0 / condition }));
        }
        Ok(ConsistentStart { start, structure, w, inverse })
    }
}

/// The largest row sum of `|W^-1| |W|`; entry by entry, to save stack space.
fn condition_of<const N: usize>(inverse: &SMatrix<f64, N, N>, w: &SMatrix<f64, N, N>) -> f64 {
    let product = |i: usize, j: usize| (0..N).map(|k| inverse[(i, k)].abs() * w[(k, j)].abs()).sum::<f64>();
    max_abs_or_nan((0..N).map(|i| (0..N).map(|j| product(i, j)).sum()))
}
