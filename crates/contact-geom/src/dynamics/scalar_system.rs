//! Lagrangians that are written over scalars and slices, with any number of coordinates.

use crate::Scalar;
use std::sync::Arc;

/// A Lagrangian with its derivatives, written over a [`Scalar`] and over slices with one number for each coordinate, as an
/// interpreted formula is. It is evaluated at all stages of a step at once, in SIMD registers.
///
/// In each function N is the number of coordinates where the caller knows it at compile time, and 0 otherwise.
pub trait ScalarSystem {
    /// The number n of coordinates.
    fn dimension(&self) -> usize;

    /// The value `L(t, q, v, z)`.
    fn value<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T) -> T;

    /// The value, and `L_q`, `L_v` and `L_z`, which are written.
    fn with_gradient<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T, to: Slopes<'_, T>) -> T;

    /// `L_q`, of a Lagrangian for which it is a function of time and positions.
    fn force<T: Scalar, const N: usize>(&self, t: T, q: &[T], to: &mut [T]);

    /// `W = L_vv`, by columns.
    fn mass_matrix<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T, to: &mut [T]);

    /// The value with the gradient, as [`with_gradient`](Self::with_gradient), and the second derivatives `L_qq`, `L_qv`, `L_vv`,
    /// `L_qz`, `L_vz`, `L_zz`, which are written in this order: matrices of n × n entries by columns (in `L_qv` the rows belong
    /// to q), vectors of n entries, and one number.
    fn with_second_derivatives<T: Scalar, const N: usize>(
        &self,
        at: Arguments<'_, T>,
        to: Slopes<'_, T>,
        second: [&mut [T]; 6],
    ) -> T;

    /// The number of parameters, where [`explicit`](Self::explicit) has the derivatives in them and in time. `None`, the
    /// default: these are found by differences.
    fn parameters(&self) -> Option<usize> {
        None
    }

    /// The derivative of L in a parameter, or in the time if none is given, which is returned, with those of its gradient and
    /// of the applied force, which are written. NaN where [`parameters`](Self::parameters) is `None`.
    fn explicit<T: Scalar>(&self, of: Option<usize>, at: Arguments<'_, T>, to: Slopes<'_, T>, force: &mut [T]) -> T {
        let _ = (of, at);
        let none = T::from(f64::NAN);
        for slope in to.q.iter_mut().chain(to.v).chain([to.z]).chain(force) {
            *slope = none;
        }
        none
    }

    /// Whether there is an applied force.
    fn has_force(&self) -> bool {
        false
    }

    /// The applied force, if there is one.
    fn applied_force<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T, to: &mut [T]) {
        let _ = (t, q, v, z);
        to.fill(T::zero());
    }
}

/// A time and a point of TQ x R.
#[derive(Clone, Copy, Debug)]
pub struct Arguments<'s, T> {
    /// The time.
    pub t: T,
    /// The position.
    pub q: &'s [T],
    /// The velocity.
    pub v: &'s [T],
    /// The action.
    pub z: T,
}

/// Where the gradient of a Lagrangian is written.
#[derive(Debug)]
pub struct Slopes<'s, T> {
    /// `L_q`.
    pub q: &'s mut [T],
    /// `L_v`.
    pub v: &'s mut [T],
    /// `L_z`.
    pub z: &'s mut T,
}

/// A function of a [`ScalarSystem`]; see [`Lagrangian::over_slices`](crate::Lagrangian::over_slices).
pub trait SlicesVisitor {
    /// Its result.
    type Output;

    /// Calls it.
    fn visit<F: ScalarSystem + 'static>(self, system: Arc<F>) -> Self::Output;
}
