//! The modules of which differentials are elements.

use crate::Scalar;
use nalgebra::SVector;
use std::fmt::Debug;

/// An element of the free module of differentials: one component of `T` for each direction.
///
/// The type determines the directions: [`SVector`] has `N` directions, [`AugmentedVector`] `N + 1`, and
/// [`ChartVector`](crate::ChartVector) all `2N + 1` coordinates of a contact manifold. Only the requested directional
/// derivatives are carried.
pub trait TangentVector<T>: Copy + PartialEq + Debug + 'static {
    /// The differential of a constant.
    fn null() -> Self;
    /// Applies `f` to each component.
    fn each(self, f: impl FnMut(T) -> T) -> Self;
    /// Combines the components of two elements by `f`.
    fn join(self, other: Self, f: impl FnMut(T, T) -> T) -> Self;
    /// `a self`.
    fn scaled(self, a: T) -> Self;
    /// `a self + b other`.
    fn combined(self, a: T, other: Self, b: T) -> Self;
}

impl<T: Scalar, const N: usize> TangentVector<T> for SVector<T, N> {
    #[inline(always)]
    fn null() -> Self {
        SVector::from_array_storage(nalgebra::ArrayStorage([[T::zero(); N]]))
    }
    #[inline(always)]
    fn each(mut self, mut f: impl FnMut(T) -> T) -> Self {
        for a in self.data.0[0].iter_mut() {
            *a = f(*a);
        }
        self
    }
    #[inline(always)]
    fn join(mut self, other: Self, mut f: impl FnMut(T, T) -> T) -> Self {
        for (a, b) in self.data.0[0].iter_mut().zip(other.data.0[0]) {
            *a = f(*a, b);
        }
        self
    }
    #[inline(always)]
    fn scaled(mut self, a: T) -> Self {
        for x in self.data.0[0].iter_mut() {
            *x *= a;
        }
        self
    }
    #[inline(always)]
    fn combined(mut self, a: T, other: Self, b: T) -> Self {
        for (x, y) in self.data.0[0].iter_mut().zip(other.data.0[0]) {
            *x = *x * a + b * y;
        }
        self
    }
}

/// `N` directions and one more: an element of `T^N x T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AugmentedVector<const N: usize, T = f64> {
    /// The first `N` components.
    pub x: SVector<T, N>,
    /// The last component.
    pub z: T,
}

impl<T: Scalar, const N: usize> TangentVector<T> for AugmentedVector<N, T> {
    #[inline(always)]
    fn null() -> Self {
        AugmentedVector { x: TangentVector::null(), z: T::zero() }
    }
    #[inline(always)]
    fn each(self, mut f: impl FnMut(T) -> T) -> Self {
        AugmentedVector { x: TangentVector::each(self.x, &mut f), z: f(self.z) }
    }
    #[inline(always)]
    fn join(self, other: Self, mut f: impl FnMut(T, T) -> T) -> Self {
        AugmentedVector { x: TangentVector::join(self.x, other.x, &mut f), z: f(self.z, other.z) }
    }
    #[inline(always)]
    fn scaled(self, a: T) -> Self {
        AugmentedVector { x: self.x.scaled(a), z: self.z * a }
    }
    #[inline(always)]
    fn combined(self, a: T, other: Self, b: T) -> Self {
        AugmentedVector { x: self.x.combined(a, other.x, b), z: self.z * a + b * other.z }
    }
}
