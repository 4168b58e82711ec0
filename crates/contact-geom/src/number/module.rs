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

#[allow(clippy::needless_range_loop, reason = "an iterator is compiled once more for each type of differential")]
impl<T: Scalar, const N: usize> TangentVector<T> for SVector<T, N> {
    #[inline(always)]
    fn null() -> Self {
        SVector::from_array_storage(nalgebra::ArrayStorage([[T::zero(); N]]))
    }
    #[inline(always)]
    fn each(mut self, mut f: impl FnMut(T) -> T) -> Self {
        let mine = &mut self.data.0[0];
        for i in 0..N {
            mine[i] = f(mine[i]);
        }
        self
    }
    #[inline(always)]
    fn join(mut self, other: Self, mut f: impl FnMut(T, T) -> T) -> Self {
        let (mine, others) = (&mut self.data.0[0], &other.data.0[0]);
        for i in 0..N {
            mine[i] = f(mine[i], others[i]);
        }
        self
    }
    #[inline(always)]
    fn scaled(mut self, a: T) -> Self {
        let mine = &mut self.data.0[0];
        for i in 0..N {
            mine[i] *= a;
        }
        self
    }
    #[inline(always)]
    fn combined(mut self, a: T, other: Self, b: T) -> Self {
        let (mine, others) = (&mut self.data.0[0], &other.data.0[0]);
        for i in 0..N {
            mine[i] = mine[i] * a + b * others[i];
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
