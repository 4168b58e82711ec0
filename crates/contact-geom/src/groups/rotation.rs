//! The rotations of space, SO(3).

use super::lie_group::add_compensated;
use super::stumpff::{arc_tangent_ratio, stumpff};
use super::{GroupError, LieGroup};
use crate::Scalar;
use crate::numbers::dot;
use nalgebra::{SMatrix, SVector};

/// The group SO(3) of rotations of space, by unit quaternions. The algebra is R^3 with the vector product.
///
/// `exp(xi)` turns by `|xi|` about xi. With Stumpff's functions at `x = |xi|^2`,
/// `dexp_xi v = v - c_2 xi x v + c_3 xi x (xi x v)` and `dexp_xi^-1 v = v + xi x v/2 + d xi x (xi x v)`, where
/// `d = (1 - (theta/2) cot(theta/2))/theta^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rotations {}

/// A rotation as a unit quaternion `w + u`; both signs are the same rotation.
///
/// ```
/// use contact_geom::{groups::Rotation, nalgebra::SVector};
/// let quarter = Rotation::from_quaternion([0.5f64.sqrt(), 0.0, 0.0, 0.5f64.sqrt()])?; // about the third axis
/// assert!((quarter.apply(&SVector::from([1.0, 0.0, 0.0])) - SVector::from([0.0, 1.0, 0.0])).amax() < 1e-15);
/// assert!(Rotation::from_quaternion([1.0, 1.0, 0.0, 0.0]).is_err());
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<T = f64> {
    /// The real part, `cos(theta/2)`.
    pub w: T,
    /// The vector part, `sin(theta/2)` times the axis.
    pub u: SVector<T, 3>,
}

/// A quaternion whose norm differs from 1 by at most this, the round-off of a text with eight digits, is accepted and
/// normalised.
const UNIT: f64 = 1e-8;

impl Rotation {
    /// The rotation of a unit quaternion `[w, x, y, z]`, real part first. It is normalised to round-off.
    ///
    /// # Errors
    /// [`GroupError::NonUnitQuaternion`] if the norm differs from 1 by more than 1e-8, [`GroupError::NonFinite`].
    pub fn from_quaternion(q: [f64; 4]) -> Result<Self, GroupError> {
        if let Some(&value) = q.iter().find(|x| !x.is_finite()) {
            return Err(GroupError::NonFinite { what: "an entry of the quaternion", value });
        }
        let g = Rotation { w: q[0], u: SVector::from([q[1], q[2], q[3]]) };
        Rotations::check(&g)?;
        Ok(g.normalised())
    }

    /// The quaternion `[w, x, y, z]`.
    pub fn quaternion(&self) -> [f64; 4] {
        [self.w, self.u[0], self.u[1], self.u[2]]
    }
}

impl<T: Scalar> Rotation<T> {
    /// The image of a vector.
    #[inline]
    pub fn apply(&self, x: &SVector<T, 3>) -> SVector<T, 3> {
        let twice = cross(&self.u, x) * T::from(2.0);
        x + twice * self.w + cross(&self.u, &twice)
    }

    /// The image of a vector under the inverse rotation.
    #[inline]
    pub fn apply_inverse(&self, x: &SVector<T, 3>) -> SVector<T, 3> {
        let twice = cross(x, &self.u) * T::from(2.0);
        x + twice * self.w + cross(&twice, &self.u)
    }

    /// The matrix, whose columns are the images of the axes.
    pub fn matrix(&self) -> SMatrix<T, 3, 3> {
        let mut matrix = SMatrix::<T, 3, 3>::zeros();
        for k in 0..3 {
            let mut e = SVector::<T, 3>::zeros();
            e[k] = T::one();
            matrix.set_column(k, &self.apply(&e));
        }
        matrix
    }

    /// The quaternion divided by its norm.
    pub fn normalised(&self) -> Self {
        let inverse = (self.w * self.w + dot(self.u, self.u)).sqrt().recip();
        Rotation { w: self.w * inverse, u: self.u * inverse }
    }
}

/// The vector product.
#[inline]
pub(super) fn cross<T: Scalar>(a: &SVector<T, 3>, b: &SVector<T, 3>) -> SVector<T, 3> {
    SVector::from([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
}

impl LieGroup<3> for Rotations {
    type Element<T: Scalar> = Rotation<T>;

    fn identity<T: Scalar>() -> Rotation<T> {
        Rotation { w: T::one(), u: SVector::zeros() }
    }

    #[inline]
    fn compose<T: Scalar>(a: &Rotation<T>, b: &Rotation<T>) -> Rotation<T> {
        Rotation { w: a.w * b.w - dot(a.u, b.u), u: b.u * a.w + a.u * b.w + cross(&a.u, &b.u) }
    }

    #[inline]
    fn inverse<T: Scalar>(g: &Rotation<T>) -> Rotation<T> {
        Rotation { w: g.w, u: -g.u }
    }

    #[inline]
    fn exp<T: Scalar>(xi: &SVector<T, 3>) -> Rotation<T> {
        let c = stumpff(dot(xi, xi) * 0.25);
        Rotation { w: c[0], u: xi * (c[1] * 0.5) }
    }

    /// `4 atan(|u|/(|q| + w))` times the axis, with the sign of the quaternion for which `w >= 0`; accurate for all
    /// angles up to pi.
    fn log<T: Scalar>(g: &Rotation<T>) -> SVector<T, 3> {
        let (w, u) = if g.w.re() < 0.0 { (-g.w, -g.u) } else { (g.w, g.u) };
        let square = dot(u, u);
        let inverse = ((square + w * w).sqrt() + w).recip();
        u * (arc_tangent_ratio(square * inverse * inverse) * inverse * 4.0)
    }

    #[inline]
    fn adjoint<T: Scalar>(g: &Rotation<T>, xi: &SVector<T, 3>) -> SVector<T, 3> {
        g.apply(xi)
    }

    #[inline]
    fn coadjoint<T: Scalar>(g: &Rotation<T>, mu: &SVector<T, 3>) -> SVector<T, 3> {
        g.apply_inverse(mu)
    }

    #[inline]
    fn bracket<T: Scalar>(a: &SVector<T, 3>, b: &SVector<T, 3>) -> SVector<T, 3> {
        cross(a, b)
    }

    #[inline]
    fn cobracket<T: Scalar>(a: &SVector<T, 3>, mu: &SVector<T, 3>) -> SVector<T, 3> {
        cross(mu, a)
    }

    #[inline]
    fn dexp<T: Scalar>(xi: &SVector<T, 3>, v: &SVector<T, 3>) -> SVector<T, 3> {
        let c = stumpff(dot(xi, xi));
        let once = cross(xi, v);
        v - once * c[2] + cross(xi, &once) * c[3]
    }

    #[inline]
    fn dexp_inverse<T: Scalar>(xi: &SVector<T, 3>, v: &SVector<T, 3>) -> SVector<T, 3> {
        let half = stumpff(dot(xi, xi) * 0.25);
        let once = cross(xi, v);
        v + once * T::from(0.5) + cross(xi, &once) * ((half[2] - half[3]) / (half[1] * 4.0))
    }

    #[inline]
    fn dexp_transposed<T: Scalar>(xi: &SVector<T, 3>, mu: &SVector<T, 3>) -> SVector<T, 3> {
        Self::dexp(&-xi, mu)
    }

    #[inline]
    fn dexp_inverse_transposed<T: Scalar>(xi: &SVector<T, 3>, p: &SVector<T, 3>) -> SVector<T, 3> {
        Self::dexp_inverse(&-xi, p)
    }

    /// With `2x c_k' = c_(k-1) - k c_k`: `c_2' = c_4 - c_3/2` and `c_3' = (3 c_5 - c_4)/2`.
    #[inline]
    fn dexp_gradient<T: Scalar>(xi: &SVector<T, 3>, v: &SVector<T, 3>, mu: &SVector<T, 3>) -> SVector<T, 3> {
        let x = dot(xi, xi);
        let c = stumpff(x);
        let (xv, xm, vm) = (dot(xi, v), dot(xi, mu), dot(v, mu));
        let turn = cross(v, mu);
        let along = dot(xi, turn) * (c[3] - c[4] * 2.0) + (xm * xv - x * vm) * (c[5] * 3.0 - c[4]) - c[3] * vm * 2.0;
        xi * along - turn * c[2] + (mu * xv + v * xm) * c[3]
    }

    #[inline]
    fn lift<T: Scalar, S: Scalar>(g: &Rotation<T>, constant: impl Fn(T) -> S + Copy) -> Rotation<S> {
        Rotation { w: constant(g.w), u: g.u.map(constant) }
    }

    fn angle(xi: &SVector<f64, 3>) -> f64 {
        xi.norm()
    }

    fn check(g: &Rotation) -> Result<(), GroupError> {
        let norm = (g.w * g.w + dot(g.u, g.u)).sqrt();
        // A NaN is not within the band.
        if (norm - 1.0).abs() <= UNIT { Ok(()) } else { Err(GroupError::NonUnitQuaternion { norm }) }
    }

    fn advance(g: &mut Rotation, rest: &mut Rotation, xi: &SVector<f64, 3>) {
        let c = stumpff(dot(xi, xi) * 0.25);
        // exp(xi) - 1, the real part without cancellation.
        let change = Rotation { w: -0.25 * dot(xi, xi) * c[2], u: xi * (0.5 * c[1]) };
        let step = Rotations::compose(g, &change);
        // The rest is turned along; its product with the change is below it by the size of the step.
        let turned = Rotations::compose(rest, &Rotation { w: 1.0 + change.w, u: change.u });
        *rest = turned;
        add_compensated(&mut g.w, &mut rest.w, step.w);
        for k in 0..3 {
            add_compensated(&mut g.u[k], &mut rest.u[k], step.u[k]);
        }
        // The norm is corrected to first order in its deviation from 1.
        let excess = 0.5 * (1.0 - (g.w * g.w + dot(g.u, g.u)));
        let (w, u) = (excess * g.w, g.u * excess);
        add_compensated(&mut g.w, &mut rest.w, w);
        for k in 0..3 {
            add_compensated(&mut g.u[k], &mut rest.u[k], u[k]);
        }
    }

    fn null() -> Rotation {
        Rotation { w: 0.0, u: SVector::zeros() }
    }
}
