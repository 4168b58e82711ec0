//! Points of the three contact manifolds, and the coordinates that they share.

use crate::{
    Dual, GeometryError, Scalar,
    numbers::{MaxAbsOrNan, MaxOrNan, TangentVector},
};
use nalgebra::{DVector, SVector};

/// The coordinates `(x, y, z)` in `R^N x R^N x R` of a point in a chart, of a tangent vector or of a covector.
///
/// All three contact manifolds have this shape: `(q, p, z)` on T\*Q x R, `(q, v, z)` on TQ x R, `(q0, q1, z0)` on
/// Q x Q x R. As a matrix index the order is `x_1..x_N, y_1..y_N, z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartVector<const N: usize, T = f64> {
    /// The first block: `q`, or `q0`.
    pub x: SVector<T, N>,
    /// The second block: `p`, `v`, or `q1`.
    pub y: SVector<T, N>,
    /// The last coordinate: the action `z`.
    pub z: T,
}

impl<T: Scalar, const N: usize> TangentVector<T> for ChartVector<N, T> {
    #[inline(always)]
    fn null() -> Self {
        ChartVector { x: TangentVector::null(), y: TangentVector::null(), z: T::zero() }
    }
    #[inline(always)]
    fn each(self, mut f: impl FnMut(T) -> T) -> Self {
        ChartVector { x: TangentVector::each(self.x, &mut f), y: TangentVector::each(self.y, &mut f), z: f(self.z) }
    }
    #[inline(always)]
    fn join(self, other: Self, mut f: impl FnMut(T, T) -> T) -> Self {
        ChartVector {
            x: TangentVector::join(self.x, other.x, &mut f),
            y: TangentVector::join(self.y, other.y, &mut f),
            z: f(self.z, other.z),
        }
    }
    #[inline(always)]
    fn scaled(self, a: T) -> Self {
        ChartVector { x: self.x.scaled(a), y: self.y.scaled(a), z: self.z * a }
    }
    #[inline(always)]
    fn combined(self, a: T, other: Self, b: T) -> Self {
        let (x, y) = (self.x.combined(a, other.x, b), self.y.combined(a, other.y, b));
        ChartVector { x, y, z: self.z * a + b * other.z }
    }
}

impl<T: Scalar, const N: usize> ChartVector<N, T> {
    /// The pairing of a covector with a vector: the sum of the products of their components.
    #[inline]
    pub fn dot(&self, other: &Self) -> T {
        self.x.dot(&other.x) + self.y.dot(&other.y) + self.z * other.z
    }

    /// This element times `a`.
    #[inline]
    pub fn scale(self, a: T) -> Self {
        self.each(|c| c * a)
    }

    /// The sum of two elements.
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        self.join(other, |a, b| a + b)
    }

    /// The difference of two elements.
    #[inline]
    pub fn minus(self, other: Self) -> Self {
        self.join(other, |a, b| a - b)
    }
}

impl<const N: usize> ChartVector<N> {
    /// The dimension `2N + 1` of the manifold.
    pub const DIMENSION: usize = 2 * N + 1;

    /// The component of index `i` in the order `x, y, z`; 0 beyond the last.
    #[inline]
    pub fn component(&self, i: usize) -> f64 {
        match i {
            _ if i < N => self.x[i],
            _ if i < 2 * N => self.y[i - N],
            _ if i == 2 * N => self.z,
            _ => 0.0,
        }
    }

    /// The element whose component of index `i` is `f(i)`.
    pub fn from_fn(mut f: impl FnMut(usize) -> f64) -> Self {
        ChartVector { x: SVector::from_fn(|i, _| f(i)), y: SVector::from_fn(|i, _| f(N + i)), z: f(2 * N) }
    }

    /// The components as a vector of dimension `2N + 1`.
    pub fn to_vector(&self) -> DVector<f64> {
        DVector::from_fn(Self::DIMENSION, |i, _| self.component(i))
    }

    /// The largest absolute component; NaN where a component is NaN, unlike nalgebra's function of this name.
    pub fn amax(&self) -> f64 {
        self.x.max_abs_or_nan().max_or_nan(self.y.max_abs_or_nan()).max_or_nan(self.z.abs())
    }

    /// Whether every component is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        let [x, y] = [self.x.data.0[0], self.y.data.0[0]];
        x.iter().all(|c| c.is_finite()) && y.iter().all(|c| c.is_finite()) && self.z.is_finite()
    }
}

impl<const N: usize> MaxAbsOrNan for ChartVector<N> {
    #[inline]
    fn max_abs_or_nan(&self) -> f64 {
        self.amax()
    }
}

/// The point of a chart as duals whose differentials are the `2N + 1` coordinate directions: the identity map together
/// with its derivative.
#[inline]
pub fn seed<T: Scalar, const N: usize>(point: &ChartVector<N, T>) -> ChartVector<N, Dual<T, ChartVector<N, T>>> {
    let mut seeded: ChartVector<N, Dual<T, ChartVector<N, T>>> =
        ChartVector { x: point.x.map(Dual::constant), y: point.y.map(Dual::constant), z: Dual::constant(point.z) };
    for i in 0..N {
        seeded.x[i].d.x[i] = T::one();
        seeded.y[i].d.y[i] = T::one();
    }
    seeded.z.d.z = T::one();
    seeded
}

macro_rules! point {
    ($(#[$doc:meta])* $name:ident, $x:ident: $x_doc:literal, $y:ident: $y_doc:literal, $z:ident: $z_doc:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name<const N: usize, T = f64> {
            #[doc = $x_doc]
            pub $x: SVector<T, N>,
            #[doc = $y_doc]
            pub $y: SVector<T, N>,
            #[doc = $z_doc]
            pub $z: T,
        }

        impl<const N: usize, T> $name<N, T> {
            /// The point with these coordinates.
            #[inline]
            pub fn new($x: impl Into<SVector<T, N>>, $y: impl Into<SVector<T, N>>, $z: T) -> Self {
                $name { $x: $x.into(), $y: $y.into(), $z }
            }
        }

        impl<const N: usize> $name<N> {
            /// The point with coordinates from slices.
            ///
            /// # Errors
            /// [`GeometryError::WrongSize`] unless both slices have `N` entries, [`GeometryError::NonFinite`] where an
            /// entry is not finite.
            pub fn from_slices($x: &[f64], $y: &[f64], $z: f64) -> Result<Self, GeometryError> {
                let point = $name {
                    $x: sized(stringify!($x), $x)?,
                    $y: sized(stringify!($y), $y)?,
                    $z,
                };
                point.check()?;
                Ok(point)
            }

            /// Checks that every coordinate is finite.
            ///
            /// # Errors
            /// [`GeometryError::NonFinite`] names the first coordinate that is not.
            pub fn check(&self) -> Result<(), GeometryError> {
                finite(stringify!($x), self.$x.as_slice())?;
                finite(stringify!($y), self.$y.as_slice())?;
                finite(stringify!($z), &[self.$z])
            }
        }

        impl<const N: usize, T> From<$name<N, T>> for ChartVector<N, T> {
            #[inline]
            fn from(point: $name<N, T>) -> Self {
                ChartVector { x: point.$x, y: point.$y, z: point.$z }
            }
        }

        impl<const N: usize, T> From<ChartVector<N, T>> for $name<N, T> {
            #[inline]
            fn from(point: ChartVector<N, T>) -> Self {
                $name { $x: point.x, $y: point.y, $z: point.z }
            }
        }
    };
}

point!(
    /// A point `(q, v, z)` of TQ x R: position, velocity, action.
    VelocityPoint, q: "Position.", v: "Velocity, position per time.", z: "Action."
);
point!(
    /// A point `(q, p, z)` of T\*Q x R: position, momentum, action. Flows act on points of this type.
    PhasePoint, q: "Position.", p: "Momentum, action per position.", z: "Action."
);
point!(
    /// A point `(q0, q1, z0)` of Q x Q x R: two positions a time step apart, and the action at the first.
    DiscretePoint, q0: "Position at the start of the step.", q1: "Position at its end.", z0: "Action at its start."
);

/// The entries as a vector of dimension `N`.
fn sized<const N: usize>(what: &'static str, entries: &[f64]) -> Result<SVector<f64, N>, GeometryError> {
    if entries.len() != N {
        return Err(GeometryError::WrongSize { what, expected: N, found: entries.len() });
    }
    Ok(SVector::from_column_slice(entries))
}

/// Checks that every entry is finite.
fn finite(what: &'static str, entries: &[f64]) -> Result<(), GeometryError> {
    match entries.iter().position(|e| !e.is_finite()) {
        Some(index) => Err(GeometryError::NonFinite { what, index, value: entries[index] }),
        None => Ok(()),
    }
}
