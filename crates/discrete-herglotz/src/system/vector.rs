//! Vectors of coordinates.

use contact_geom::nalgebra::{DMatrix, DVectorView, SVector};
use contact_geom::numbers::max_abs_or_nan;
use std::fmt::{Debug, Formatter};
use std::ops::{Add, AddAssign, Deref, DerefMut, Div, Mul, Neg, Sub, SubAssign};

/// The number of coordinates up to which a vector needs no memory on the heap: a state then has 120 bytes, which are
/// copied without a call.
const FEW: usize = 4;

/// A vector with one number for each coordinate of a system; their number is known at run time. It is read as a slice,
/// has the arithmetic of vectors, and converts from and to nalgebra's vectors of fixed length. The sum and the difference
/// of vectors of different lengths have the components NaN.
///
/// ```
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::Vector;
/// let q = Vector::from([3.0, 4.0]);
/// assert_eq!((q[0], q.norm()), (3.0, 5.0));
/// assert_eq!(&q - SVector::from([1.0, 1.0]), Vector::from([2.0, 3.0]));
/// let fixed: SVector<f64, 2> = q.fixed();
/// # assert_eq!(fixed, SVector::from([3.0, 4.0]));
/// ```
#[derive(Default)]
pub struct Vector {
    n: usize,
    /// The components, if they are few; their padding has any values.
    few: [f64; FEW],
    /// The components otherwise.
    many: Option<Box<[f64]>>,
}

impl Vector {
    /// The vector 0 of this length.
    #[inline]
    pub fn zeros(n: usize) -> Self {
        Vector { n, few: [0.0; FEW], many: (n > FEW).then(|| vec![0.0; n].into()) }
    }

    /// The vector of this length whose components are all the same.
    #[inline]
    pub fn repeat(n: usize, x: f64) -> Self {
        Vector { n, few: [x; FEW], many: (n > FEW).then(|| vec![x; n].into()) }
    }

    /// The vector of this length whose i-th component is `f(i)`.
    #[inline]
    pub fn from_fn(n: usize, mut f: impl FnMut(usize) -> f64) -> Self {
        let mut vector = Vector::zeros(n);
        vector.iter_mut().enumerate().for_each(|(i, x)| *x = f(i));
        vector
    }

    /// The components.
    #[inline]
    pub fn as_slice(&self) -> &[f64] {
        self.many.as_deref().unwrap_or(&self.few[..self.n.min(FEW)])
    }

    /// The components of a vector of fixed length; NaN for components that this vector does not have.
    #[inline]
    pub fn fixed<const N: usize>(&self) -> SVector<f64, N> {
        let x = self.as_slice();
        match <[f64; N]>::try_from(x) {
            Ok(x) => x.into(),
            Err(_) => SVector::from_fn(|i, _| x.get(i).copied().unwrap_or(f64::NAN)),
        }
    }

    /// The product of a matrix and a vector; its components are NaN if the numbers of columns and of components differ.
    pub fn product(matrix: &DMatrix<f64>, x: &[f64]) -> Self {
        let mut product = Vector::zeros(matrix.nrows());
        if matrix.ncols() != x.len() {
            product.fill(f64::NAN);
        }
        for (column, x) in matrix.column_iter().zip(x) {
            product.iter_mut().zip(&column).for_each(|(sum, entry)| *sum += entry * x);
        }
        product
    }

    /// The vector with a function of each component.
    #[inline]
    pub fn map(&self, mut f: impl FnMut(f64) -> f64) -> Self {
        let mut vector = self.clone();
        vector.iter_mut().for_each(|x| *x = f(*x));
        vector
    }

    /// The scalar product; NaN for vectors of different lengths.
    pub fn dot(&self, other: &[f64]) -> f64 {
        let (a, b, n) = (self.as_slice(), other, self.n);
        match (a, b) {
            _ if b.len() != n => f64::NAN,
            // The order of the sum is nalgebra's for vectors of length four.
            ([a0, a1, a2, a3], [b0, b1, b2, b3]) => (a0 * b0 + a2 * b2) + (a1 * b1 + a3 * b3),
            _ => DVectorView::from_slice(a, n).dot(&DVectorView::from_slice(b, n)),
        }
    }

    /// The square of the Euclidean norm.
    #[inline]
    pub fn norm_squared(&self) -> f64 {
        self.dot(self)
    }

    /// The Euclidean norm.
    #[inline]
    pub fn norm(&self) -> f64 {
        self.norm_squared().sqrt()
    }

    /// The largest absolute component; NaN where a component is NaN.
    #[inline]
    pub fn amax(&self) -> f64 {
        max_abs_or_nan(self.iter().copied())
    }

    /// The result of arithmetic with a vector of another length.
    #[cold]
    fn become_undefined(&mut self, other: usize) {
        *self = Vector::repeat(self.n.max(other), f64::NAN);
    }

    /// The quotients of the components; NaN for components that the other vector does not have.
    #[inline]
    pub fn component_div(&self, other: &[f64]) -> Self {
        Vector::from_fn(self.n, |i| self[i] / other.get(i).copied().unwrap_or(f64::NAN))
    }
}

impl Clone for Vector {
    #[inline]
    fn clone(&self) -> Self {
        Vector { n: self.n, few: self.few, many: self.many.clone() }
    }
}

impl PartialEq for Vector {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl Debug for Vector {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl Deref for Vector {
    type Target = [f64];
    #[inline]
    fn deref(&self) -> &[f64] {
        self.as_slice()
    }
}

impl DerefMut for Vector {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        match &mut self.many {
            Some(many) => many,
            None => &mut self.few[..self.n.min(FEW)],
        }
    }
}

impl FromIterator<f64> for Vector {
    #[inline]
    fn from_iter<I: IntoIterator<Item = f64>>(components: I) -> Self {
        let (mut vector, mut components) = (Vector::default(), components.into_iter());
        for (to, x) in vector.few.iter_mut().zip(&mut components) {
            *to = x;
            vector.n += 1;
        }
        if vector.n == FEW
            && let Some(next) = components.next()
        {
            let many: Vec<f64> = vector.few.into_iter().chain([next]).chain(components).collect();
            (vector.n, vector.many) = (many.len(), Some(many.into()));
        }
        vector
    }
}

impl<'v> IntoIterator for &'v Vector {
    type Item = &'v f64;
    type IntoIter = std::slice::Iter<'v, f64>;
    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.as_slice().iter()
    }
}

impl From<&[f64]> for Vector {
    #[inline]
    fn from(components: &[f64]) -> Self {
        let mut vector = Vector::zeros(components.len());
        vector.copy_from_slice(components);
        vector
    }
}

impl From<Vec<f64>> for Vector {
    fn from(x: Vec<f64>) -> Self {
        Vector::from(x.as_slice())
    }
}

impl<const N: usize> From<[f64; N]> for Vector {
    #[inline]
    fn from(components: [f64; N]) -> Self {
        components.as_slice().into()
    }
}

impl<const N: usize> From<SVector<f64, N>> for Vector {
    #[inline]
    fn from(components: SVector<f64, N>) -> Self {
        Vector::from(&components)
    }
}

impl<const N: usize> From<&SVector<f64, N>> for Vector {
    #[inline]
    fn from(components: &SVector<f64, N>) -> Self {
        if const { N > FEW } {
            return components.as_slice().into();
        }
        let mut few = [0.0; FEW];
        few[..N].copy_from_slice(components.as_slice());
        Vector { n: N, few, many: None }
    }
}

impl<const N: usize> From<&Vector> for SVector<f64, N> {
    #[inline]
    fn from(vector: &Vector) -> Self {
        vector.fixed()
    }
}

impl<const N: usize> PartialEq<SVector<f64, N>> for Vector {
    #[inline]
    fn eq(&self, other: &SVector<f64, N>) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<const N: usize> PartialEq<Vector> for SVector<f64, N> {
    #[inline]
    fn eq(&self, other: &Vector) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<const N: usize> PartialEq<[f64; N]> for Vector {
    #[inline]
    fn eq(&self, other: &[f64; N]) -> bool {
        self.as_slice() == other.as_slice()
    }
}

/// Sums and differences; the left one is changed in place where it is owned.
macro_rules! sum {
    ($trait:ident $method:ident, $assign:ident $assign_method:ident: $op:tt) => {
        impl $assign<&[f64]> for Vector {
            #[inline]
            fn $assign_method(&mut self, other: &[f64]) {
                if self.n != other.len() {
                    self.become_undefined(other.len());
                }
                self.iter_mut().zip(other).for_each(|(x, y)| *x = *x $op y);
            }
        }
        impl $assign<&Vector> for Vector {
            #[inline]
            fn $assign_method(&mut self, other: &Vector) {
                if let (None, None, true) = (&self.many, &other.many, self.n == other.n) {
                    // All of them at once, with the padding: their number is known at compile time.
                    self.few.iter_mut().zip(&other.few).for_each(|(x, y)| *x = *x $op y);
                } else {
                    self.$assign_method(other.as_slice());
                }
            }
        }
        impl $assign for Vector {
            #[inline]
            fn $assign_method(&mut self, other: Vector) {
                self.$assign_method(other.as_slice());
            }
        }
        impl $trait<&Vector> for Vector {
            type Output = Vector;
            #[inline]
            fn $method(mut self, other: &Vector) -> Vector {
                self.$assign_method(other);
                self
            }
        }
        impl $trait for Vector {
            type Output = Vector;
            #[inline]
            fn $method(self, other: Vector) -> Vector {
                self.$method(&other)
            }
        }
        impl $trait<&Vector> for &Vector {
            type Output = Vector;
            #[inline]
            fn $method(self, other: &Vector) -> Vector {
                let mut result = self.clone();
                result.$assign_method(other);
                result
            }
        }
        impl $trait<Vector> for &Vector {
            type Output = Vector;
            #[inline]
            fn $method(self, other: Vector) -> Vector {
                self.$method(&other)
            }
        }
        impl<const N: usize> $trait<SVector<f64, N>> for Vector {
            type Output = Vector;
            #[inline]
            fn $method(mut self, other: SVector<f64, N>) -> Vector {
                self.$assign_method(other.as_slice());
                self
            }
        }
        impl<const N: usize> $trait<SVector<f64, N>> for &Vector {
            type Output = Vector;
            #[inline]
            fn $method(self, other: SVector<f64, N>) -> Vector {
                self.clone().$method(other)
            }
        }
        impl<const N: usize> $trait<&Vector> for SVector<f64, N> {
            type Output = Vector;
            #[inline]
            fn $method(self, other: &Vector) -> Vector {
                Vector::from(self).$method(other)
            }
        }
        impl<const N: usize> $trait<Vector> for SVector<f64, N> {
            type Output = Vector;
            #[inline]
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
    ($trait:ident $method:ident: $assign:tt) => {
        impl $trait<f64> for Vector {
            type Output = Vector;
            #[inline]
            fn $method(mut self, factor: f64) -> Vector {
                match &mut self.many {
                    None => self.few.iter_mut().for_each(|x| *x $assign factor),
                    Some(many) => many.iter_mut().for_each(|x| *x $assign factor),
                }
                self
            }
        }
        impl $trait<f64> for &Vector {
            type Output = Vector;
            #[inline]
            fn $method(self, factor: f64) -> Vector {
                self.clone().$method(factor)
            }
        }
    };
}

scaled!(Mul mul: *=);
scaled!(Div div: /=);

impl Neg for Vector {
    type Output = Vector;
    #[inline]
    fn neg(self) -> Vector {
        self.map(|x| -x)
    }
}
