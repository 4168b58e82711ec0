//! The derivative of the projection of a start to holonomic constraints.

use crate::StepError;
use contact_geom::nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// The derivative of the projection of a start `(q, v)` to constraints `c(q) = 0`, `G(q) v = 0` with `G = c_q`, at a start that
/// satisfies them: positions move along `W^-1 G^T`, and so do velocities,
///
/// `dq -> dq - W^-1 G^T S (G dq + c_theta)`, `dv -> dv - W^-1 G^T S (G dv + (G v)_q dq + (G v)_theta)`, `S = (G W^-1 G^T)^-1`,
///
/// with the projected dq in the second formula. It is the identity along the constraints.
#[derive(Clone, Debug, PartialEq)]
pub struct StartProjection {
    /// `W^-1 G^T S`.
    pub(crate) response: DMatrix<f64>,
    /// G.
    pub(crate) jacobian: DMatrix<f64>,
    /// `(G v)_q`.
    pub(crate) curvature: DMatrix<f64>,
    /// `c_theta` and `(G v)_theta` for each parameter; `None` for one that the constraints do not contain.
    pub(crate) parameters: Vec<Option<[DVector<f64>; 2]>>,
}

impl StartProjection {
    /// Of the constraints with these indices: from G and `(G v)_q`, from `W^-1`, and from `c_theta` and `(G v)_theta`.
    ///
    /// # Errors
    /// [`StepError::Singular`] where the constraints are dependent.
    pub(crate) fn new<const N: usize, const M: usize>(
        rows: &[usize],
        (g, curvature): (&SMatrix<f64, M, N>, &SMatrix<f64, M, N>),
        inverse: &SMatrix<f64, N, N>,
        parameters: impl Iterator<Item = Option<[SVector<f64, M>; 2]>>,
    ) -> Result<Self, StepError> {
        let matrix = |of: &SMatrix<f64, M, N>| DMatrix::from_fn(rows.len(), N, |a, i| of[(rows[a], i)]);
        let vector = |of: SVector<f64, M>| DVector::from_fn(rows.len(), |a, _| of[rows[a]]);
        let jacobian = matrix(g);
        let along = DMatrix::from_fn(N, N, |i, j| inverse[(i, j)]) * jacobian.transpose();
        let s = (&jacobian * &along).try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?;
        Ok(StartProjection {
            response: along * s,
            jacobian,
            curvature: matrix(curvature),
            parameters: parameters.map(|of| of.map(|both| both.map(vector))).collect(),
        })
    }
}
