//! Inertia tensors.

use super::GroupError;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// The inertia tensor of a rigid body about a point, in the body: symmetric, positive definite, with principal moments
/// that satisfy the triangle inequality.
///
/// ```
/// use contact_geom::groups::Inertia;
/// let top = Inertia::principal([0.234375, 0.46875, 0.234375])?.about(15.0, [0.0, 1.0, 0.0])?; // the fixed point
/// assert_eq!(top.matrix()[(0, 0)], 15.234375);
/// assert!(Inertia::principal([1.0, 1.0, 3.0]).is_err());
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    matrix: Matrix3<f64>,
    moments: Vector3<f64>,
    axes: Matrix3<f64>,
}

/// By this part of the largest moment the triangle inequality may be violated: the round-off of a flat body.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

impl Inertia {
    /// The tensor with this matrix.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NotSymmetric`], [`GroupError::NotPositive`],
    /// [`GroupError::TriangleInequality`].
    pub fn new(matrix: Matrix3<f64>) -> Result<Self, GroupError> {
        if let Some(&value) = matrix.iter().find(|x| !x.is_finite()) {
            return Err(GroupError::NonFinite { what: "an entry of the inertia tensor", value });
        }
        let size = matrix.iter().fold(0.0, |size, x: &f64| if x.abs() > size { x.abs() } else { size });
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let difference = (matrix[(i, j)] - matrix[(j, i)]).abs();
            if difference > ROUNDING * size {
                return Err(GroupError::NotSymmetric { what: "inertia tensor", difference });
            }
        }
        let matrix = (matrix + matrix.transpose()) * 0.5;
        let diagonal = matrix[(0, 1)] == 0.0 && matrix[(0, 2)] == 0.0 && matrix[(1, 2)] == 0.0;
        let (moments, axes) = if diagonal {
            (matrix.diagonal(), Matrix3::identity())
        } else {
            let eigen = SymmetricEigen::new(matrix);
            let mut axes = eigen.eigenvectors;
            if axes.determinant() < 0.0 {
                axes.neg_mut();
            }
            (eigen.eigenvalues, axes)
        };
        if let Some(&value) = moments.iter().find(|x| !x.is_finite()) {
            return Err(GroupError::NonFinite { what: "a principal moment of inertia", value });
        }
        let mut sorted = [moments[0], moments[1], moments[2]];
        sorted.sort_by(f64::total_cmp);
        if sorted[0] <= 0.0 {
            return Err(GroupError::NotPositive { what: "inertia tensor", smallest: sorted[0] });
        }
        if sorted[2] > (sorted[0] + sorted[1]) * (1.0 + ROUNDING) {
            return Err(GroupError::TriangleInequality { moments: sorted });
        }
        Ok(Inertia { matrix, moments, axes })
    }

    /// The tensor with these principal moments about the axes of the body.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn principal(moments: [f64; 3]) -> Result<Self, GroupError> {
        Self::new(Matrix3::from_diagonal(&moments.into()))
    }

    /// The tensor about a point, from this one about the centre of mass, which is at `centre` from the point: the
    /// theorem of Huygens and Steiner, `J + m (|X|^2 1 - X X^T)`.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn about(&self, mass: f64, centre: [f64; 3]) -> Result<Self, GroupError> {
        let x = Vector3::from(centre);
        Self::new(self.matrix + (Matrix3::identity() * x.dot(&x) - x * x.transpose()) * mass)
    }

    /// The matrix, kinetic energy `omega . J omega / 2`.
    pub fn matrix(&self) -> &Matrix3<f64> {
        &self.matrix
    }

    /// The principal moments, in the order of [`axes`](Self::axes).
    pub fn moments(&self) -> &Vector3<f64> {
        &self.moments
    }

    /// The principal axes in the body, right-handed, the columns of a rotation matrix.
    pub fn axes(&self) -> &Matrix3<f64> {
        &self.axes
    }
}
