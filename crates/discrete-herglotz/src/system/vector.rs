//! Vectors of coordinates.

use contact_geom::nalgebra::{DVectorView, SVector};
use contact_geom::numbers::max_abs_or_nan;
use smallvec::SmallVec;
use std::fmt::{Debug, Formatter};
use std::ops::{Add, AddAssign, Deref, DerefMut, Div, Mul, Neg, Sub, SubAssign};

/// The number of coordinates up to which a vector needs no memory on the heap.
const INLINE: usize = 8;

/// A vector with one number for each coordinate of a system; their number is known at run time. It is read as a slice,
/// has the arithmetic of vectors, and converts from and to nalgebra's vectors of fixed length.
///
/// ```
/// use contact_geom::nalgebra::{SVector, vector};
/// use discrete_herglotz::Vector;
/// let q = Vector::from([3.0, 4.0]);
/// assert_eq!((q[0], q.norm()), (3.0, 5.0));
/// assert_eq!(&q - vector![1.0, 1.0], Vector::from([2.0, 3.0]));
/// let fixed: SVector<f64, 2> = q.fixed();
/// # assert_eq!(fixed, vector![3.0, 4.0]);
/// ```
#[derive(Clone, Default, PartialEq)]
pub struct Vector(SmallVec<[f64; INLINE]>);

impl Vector {
    /// The vector 0 of this length.
    pub fn zeros(n: usize) -> Self {
        Self::repeat(n, 0.0)
    }

    /// The vector of this length whose components are all the same.
    pub fn repeat(n: usize, x: f64) -> Self {
        Vector(SmallVec::from_elem(x, n))
    }

    /// The vector of this length whose i-th component is `f(i)`.
    pub fn from_fn(n: usize, f: impl FnMut(usize) -> f64) -> Self {
        (0..n).map(f).collect()
    }

    /// The components.
    pub fn as_slice(&self) -> &[f64] {
        &self.0
    }

    /// The components of a vector of fixed length; NaN for components that this vector does not have.
    pub fn fixed<const N: usize>(&self) -> SVector<f64, N> {
        SVector::from_fn(|i, _| self.0.get(i).copied().unwrap_or(f64::NAN))
    }

    /// The vector with a function of each component.
    pub fn map(&self, mut f: impl FnMut(f64) -> f64) -> Self {
        self.iter().map(|x| f(*x)).collect()
    }

    /// The scalar product.
    pub fn dot(&self, other: &[f64]) -> f64 {
        let n = self.len().min(other.len());
        let (a, b) = (&self.0[..n], &other[..n]);
        match (a, b) {
            // The order of the sum is nalgebra's for vectors of length four.
            ([a0, a1, a2, a3], [b0, b1, b2, b3]) => (a0 * b0 + a2 * b2) + (a1 * b1 + a3 * b3),
            _ => DVectorView::from_slice(a, n).dot(&DVectorView::from_slice(b, n)),
        }
    }

    /// The square of the Euclidean norm.
    pub fn norm_squared(&self) -> f64 {
        self.dot(self)
    }

    /// The Euclidean norm.
    pub fn norm(&self) -> f64 {
        self.norm_squared().sqrt()
    }

    /// The largest absolute component; NaN where a component is NaN.
    pub fn amax(&self) -> f64 {
        max_abs_or_nan(self.iter().copied())
    }

    /// The quotients of the components.
    pub fn component_div(&self, other: &[f64]) -> Self {
        self.iter().zip(other).map(|(x, y)| x / y).collect()
    }
}

impl Debug for Vector {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl Deref for Vector {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        &self.0
    }
}

impl DerefMut for Vector {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl FromIterator<f64> for Vector {
    fn from_iter<I: IntoIterator<Item = f64>>(components: I) -> Self {
        Vector(components.into_iter().collect())
    }
}

impl<'v> IntoIterator for &'v Vector {
    type Item = &'v f64;
    type IntoIter = std::slice::Iter<'v, f64>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl From<&[f64]> for Vector {
    fn from(components: &[f64]) -> Self {
        Vector(SmallVec::from_slice(components))
    }
}

impl<const N: usize> From<[f64; N]> for Vector {
    fn from(components: [f64; N]) -> Self {
        components.as_slice().into()
    }
}

impl<const N: usize> From<SVector<f64, N>> for Vector {
    fn from(components: SVector<f64, N>) -> Self {
        components.as_slice().into()
    }
}

impl<const N: usize> From<&SVector<f64, N>> for Vector {
    fn from(components: &SVector<f64, N>) -> Self {
        components.as_slice().into()
    }
}

impl<const N: usize> From<&Vector> for SVector<f64, N> {
    fn from(vector: &Vector) -> Self {
        vector.fixed()
    }
}

impl<const N: usize> PartialEq<SVector<f64, N>> for Vector {
    fn eq(&self, other: &SVector<f64, N>) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<const N: usize> PartialEq<Vector> for SVector<f64, N> {
    fn eq(&self, other: &Vector) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<const N: usize> PartialEq<[f64; N]> for Vector {
    fn eq(&self, other: &[f64; N]) -> bool {
        self.as_slice() == other.as_slice()
    }
}

/// Sums and differences; the left one is changed in place where it is owned.
macro_rules! sum {
    ($trait:ident $method:ident, $assign:ident $assign_method:ident: $op:tt) => {
        impl $assign<&[f64]> for Vector {
            fn $assign_method(&mut self, other: &[f64]) {
                self.iter_mut().zip(other).for_each(|(x, y)| *x = *x $op y);
            }
        }
        impl $assign<&Vector> for Vector {
            fn $assign_method(&mut self, other: &Vector) {
                self.$assign_method(other.as_slice());
            }
        }
        impl $assign for Vector {
            fn $assign_method(&mut self, other: Vector) {
                self.$assign_method(other.as_slice());
            }
        }
        impl $trait<&Vector> for Vector {
            type Output = Vector;
            fn $method(mut self, other: &Vector) -> Vector {
                self.$assign_method(other.as_slice());
                self
            }
        }
        impl $trait for Vector {
            type Output = Vector;
            fn $method(self, other: Vector) -> Vector {
                self.$method(&other)
            }
        }
        impl $trait<&Vector> for &Vector {
            type Output = Vector;
            fn $method(self, other: &Vector) -> Vector {
                self.iter().zip(other).map(|(x, y)| x $op y).collect()
            }
        }
        impl $trait<Vector> for &Vector {
            type Output = Vector;
            fn $method(self, other: Vector) -> Vector {
                self.$method(&other)
            }
        }
        impl<const N: usize> $trait<SVector<f64, N>> for Vector {
            type Output = Vector;
            fn $method(mut self, other: SVector<f64, N>) -> Vector {
                self.$assign_method(other.as_slice());
                self
            }
        }
        impl<const N: usize> $trait<SVector<f64, N>> for &Vector {
            type Output = Vector;
            fn $method(self, other: SVector<f64, N>) -> Vector {
                self.clone().$method(other)
            }
        }
        impl<const N: usize> $trait<&Vector> for SVector<f64, N> {
            type Output = Vector;
            fn $method(self, other: &Vector) -> Vector {
                Vector::from(self).$method(other)
            }
        }
        impl<const N: usize> $trait<Vector> for SVector<f64, N> {
            type Output = Vector;
            fn $method(self, other: Vector) -> Vector {
                Vector::from(self).$method(&other)
            }
        }
    };
}

sum!(Add add, AddAssign add_assign: +);
sum!(Sub sub, SubAssign sub_assign: -);

/// Products and quotients with a number.
macro_rules! scaled {
    ($trait:ident $method:ident: $op:tt) => {
        impl $trait<f64> for Vector {
            type Output = Vector;
            fn $method(mut self, factor: f64) -> Vector {
                self.iter_mut().for_each(|x| *x = *x $op factor);
                self
            }
        }
        impl $trait<f64> for &Vector {
            type Output = Vector;
            fn $method(self, factor: f64) -> Vector {
                self.map(|x| x $op factor)
            }
        }
    };
}

scaled!(Mul mul: *);
scaled!(Div div: /);

impl Neg for Vector {
    type Output = Vector;
    fn neg(self) -> Vector {
        self.map(|x| -x)
    }
}
