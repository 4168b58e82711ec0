//! The kinetic part of separable Lagrangians.

use crate::integration::SystemProblem;
use crate::system::mass_matrix::{BLOCK, inverse_by_columns};
use crate::system::products::times;
use crate::{InputError, Point, Vector};
use contact_geom::nalgebra::DMatrix;

/// The kinetic part `v.Mv/2` of a separable Lagrangian, with its constant mass matrix.
pub(super) struct Kinetic {
    mass: DMatrix<f64>,
    /// The inverse mass matrix; `None` for the identity.
    inverse: Option<DMatrix<f64>>,
}

impl Kinetic {
    /// That of a problem whose claims are verified.
    ///
    /// # Errors
    /// [`InputError::Unclaimed`] for a Lagrangian that is not separable; [`InputError::Geometry`] for a singular mass matrix.
    pub(super) fn of(problem: &SystemProblem<'_>) -> Result<Self, InputError> {
        let (system, t, rest) = (&problem.system, problem.t0, rest_of(problem));
        if !system.structure().separable {
            return Err(InputError::Unclaimed { claim: "separable" });
        }
        let n = system.dimension();
        let mass = if n > BLOCK { system.mass_matrix(t, &rest) } else { system.hessian(t, &rest).vv };
        let inverse = if mass == DMatrix::identity(n, n) {
            None
        } else {
            let inverse = inverse_by_columns(&mass);
            Some(inverse.map_err(|e| e.of("the mass matrix L_vv", "use a regular Lagrangian"))?)
        };
        Ok(Kinetic { mass, inverse })
    }

    /// `M^-1 p`.
    pub(super) fn velocity(&self, p: &Vector) -> Vector {
        self.inverse.as_ref().map_or_else(|| p.clone(), |inverse| times(inverse, p))
    }

    /// `M^-1`.
    pub(super) fn inverse(&self) -> DMatrix<f64> {
        let n = self.mass.nrows();
        self.inverse.clone().unwrap_or_else(|| DMatrix::identity(n, n))
    }

    /// The diagonal of M; `None` if another entry is not zero.
    pub(super) fn diagonal_mass(&self) -> Option<Vector> {
        let n = self.mass.nrows();
        let diagonal = (0..n).all(|i| (0..n).all(|j| i == j || self.mass[(i, j)] == 0.0));
        diagonal.then(|| Vector::from_fn(n, |i| self.mass[(i, i)]))
    }
}

/// The start of a problem at rest, where coefficients are evaluated.
pub(super) fn rest_of(problem: &SystemProblem<'_>) -> Point {
    let q = problem.state.q.clone();
    Point { v: Vector::zeros(q.len()), q, z: problem.state.z }
}
