//! Points of T*Q x R and TQ x R, and derivatives there, of systems whose number of coordinates is known at run time.

use crate::Vector;
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_abs_or_nan;
use contact_geom::{ChartVector, GeometryError, Hessian, PhasePoint, VelocityPoint};

/// A state `(q, p, z)` of a motion: a point of T\*Q x R. It is a [`PhasePoint`] whose number of coordinates is known at
/// run time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// The position.
    pub q: Vector,
    /// The momentum.
    pub p: Vector,
    /// The action.
    pub z: f64,
}

/// A point `(q, v, z)` of TQ x R. It is a [`VelocityPoint`] whose number of coordinates is known at run time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// The position.
    pub q: Vector,
    /// The velocity.
    pub v: Vector,
    /// The action.
    pub z: f64,
}

/// The components of a covector or of a tangent vector at a point of TQ x R or T\*Q x R, such as the gradient
/// `(L_q, L_v, L_z)` of a Lagrangian.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Components {
    /// Those of the position.
    pub x: Vector,
    /// Those of the velocity or the momentum.
    pub y: Vector,
    /// That of the action.
    pub z: f64,
}

/// The second partial derivatives of a function at a point `(q, v, z)`.
#[derive(Clone, Debug, PartialEq)]
pub struct SecondDerivatives {
    /// Those in q.
    pub qq: DMatrix<f64>,
    /// Those in q (rows) and v (columns).
    pub qv: DMatrix<f64>,
    /// Those in v.
    pub vv: DMatrix<f64>,
    /// Those in q and z.
    pub qz: Vector,
    /// Those in v and z.
    pub vz: Vector,
    /// That in z.
    pub zz: f64,
}

macro_rules! of_chart {
    ($name:ident { $x:ident, $y:ident }, $fixed:ident { $fx:ident, $fy:ident }) => {
        impl $name {
            /// The point with these coordinates.
            #[inline]
            pub fn new($x: impl Into<Vector>, $y: impl Into<Vector>, z: f64) -> Self {
                $name { $x: $x.into(), $y: $y.into(), z }
            }

            /// The same with a number of coordinates that is known at compile time; NaN for those that it does not have.
            #[inline]
            pub fn fixed<const N: usize>(&self) -> $fixed<N> {
                $fixed { $fx: self.$x.fixed(), $fy: self.$y.fixed(), z: self.z }
            }

            /// Whether every coordinate is finite.
            #[inline]
            pub fn is_finite(&self) -> bool {
                self.$x.iter().chain(&self.$y).all(|x| x.is_finite()) && self.z.is_finite()
            }
        }

        impl<const N: usize> From<$fixed<N>> for $name {
            #[inline]
            fn from(point: $fixed<N>) -> Self {
                Self::from(&point)
            }
        }

        impl<const N: usize> From<&$fixed<N>> for $name {
            #[inline]
            fn from(point: &$fixed<N>) -> Self {
                $name { $x: point.$fx.into(), $y: point.$fy.into(), z: point.z }
            }
        }

        impl<const N: usize> From<&$name> for $fixed<N> {
            #[inline]
            fn from(point: &$name) -> Self {
                point.fixed()
            }
        }

        impl<const N: usize> PartialEq<$fixed<N>> for $name {
            #[inline]
            fn eq(&self, other: &$fixed<N>) -> bool {
                self.$x == other.$fx && self.$y == other.$fy && self.z == other.z
            }
        }
    };
}

of_chart!(State { q, p }, PhasePoint { q, p });
of_chart!(Point { q, v }, VelocityPoint { q, v });
of_chart!(Components { x, y }, ChartVector { x, y });

impl Components {
    /// The components 0, for n coordinates.
    #[inline]
    pub fn zeros(n: usize) -> Self {
        Components { x: Vector::zeros(n), y: Vector::zeros(n), z: 0.0 }
    }

    /// The sum.
    #[inline]
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.x += &other.x;
        self.y += &other.y;
        self.z += other.z;
        self
    }

    /// The difference.
    #[inline]
    pub(crate) fn minus(mut self, other: &Self) -> Self {
        self.x -= &other.x;
        self.y -= &other.y;
        self.z -= other.z;
        self
    }

    /// The product with a number.
    #[inline]
    pub(crate) fn scale(&self, factor: f64) -> Self {
        Components { x: &self.x * factor, y: &self.y * factor, z: self.z * factor }
    }

    /// The sum of the products of the components.
    #[inline]
    pub fn dot(&self, other: &Self) -> f64 {
        self.x.dot(&other.x) + self.y.dot(&other.y) + self.z * other.z
    }

    /// The largest absolute component; NaN where a component is NaN.
    #[inline]
    pub(crate) fn max_abs_or_nan(&self) -> f64 {
        max_abs_or_nan(self.x.iter().chain(&self.y).copied().chain([self.z]))
    }
}

impl State {
    /// Checks that every coordinate is finite.
    ///
    /// # Errors
    /// [`GeometryError::NonFinite`] names the first coordinate that is not.
    pub fn check(&self) -> Result<(), GeometryError> {
        for (what, entries) in [("q", &self.q[..]), ("p", &self.p[..]), ("z", &[self.z][..])] {
            if let Some(index) = entries.iter().position(|e| !e.is_finite()) {
                return Err(GeometryError::NonFinite { what, index, value: entries[index] });
            }
        }
        Ok(())
    }
}

impl<const N: usize> From<&Hessian<N>> for SecondDerivatives {
    #[inline]
    fn from(of: &Hessian<N>) -> Self {
        let matrix = |m: &[f64]| DMatrix::from_column_slice(N, N, m);
        SecondDerivatives {
            qq: matrix(of.qq.as_slice()),
            qv: matrix(of.qv.as_slice()),
            vv: matrix(of.vv.as_slice()),
            qz: of.qz.into(),
            vz: of.vz.into(),
            zz: of.zz,
        }
    }
}
