//! Functions to be minimized.

use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// A smooth function on `R^N` that an optimizer minimizes.
pub trait Objective<const N: usize> {
    /// The value of the function.
    fn value<T: Scalar>(&self, q: &SVector<T, N>) -> T;
}

/// The quartic function `f(q) = (u^T S u)^2` with `u = q - 1` and `S_ij = correlation^|i - j|`: convex, with the minimum
/// 0 at `q = (1, .., 1)`, where the Hessian is 0. With the correlation 0.9, the default, it is an example of Bravetti,
/// Daza-Torres, Flores-Arguedas and Betancourt, "Bregman dynamics, contact transformations and convex optimization",
/// Information Geometry 6 (2023).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quartic {
    /// The correlation of neighbouring coordinates.
    pub correlation: f64,
}

impl Default for Quartic {
    fn default() -> Self {
        Quartic { correlation: 0.9 }
    }
}

impl<const N: usize> Objective<N> for Quartic {
    #[inline(always)]
    fn value<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        // With `a_i = u_i + c a_(i-1)`: `u^T S u` is the sum of `u_i (2 a_i - u_i)`.
        let (mut sum, mut a) = (T::zero(), T::zero());
        for i in 0..N {
            let u = q[i] - 1.0;
            a = a * self.correlation + u;
            sum += u * (a * 2.0 - u);
        }
        sum * sum
    }
}
