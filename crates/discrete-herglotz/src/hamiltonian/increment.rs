//! The increment of a state under a conformally contact map.

use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, Dual, PhasePoint, Scalar, support::seed};

/// The increment of a state `(q, p, z)` under a conformally contact map, with its conformal factor. Increments are
/// computed without the cancellation of a difference of states, so that they can be added by compensated summation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactIncrement<const N: usize, T = f64> {
    /// `q1 - q0`.
    pub q: SVector<T, N>,
    /// `p1 - p0`.
    pub p: SVector<T, N>,
    /// `z1 - z0`.
    pub z: T,
    /// `sigma - 1`.
    pub sigma_minus_one: T,
}

impl<T: Scalar, const N: usize> ContactIncrement<N, T> {
    /// The increment of the identity map.
    pub fn zero() -> Self {
        let zero = SVector::from_element(T::zero());
        ContactIncrement { q: zero, p: zero, z: T::zero(), sigma_minus_one: T::zero() }
    }

    /// The increment of a map that is not defined at a state: NaN.
    pub fn undefined() -> Self {
        let none = T::from(f64::NAN);
        let vector = SVector::from_element(none);
        ContactIncrement { q: vector, p: vector, z: none, sigma_minus_one: none }
    }

    /// The state after the map.
    pub fn after(&self, x: &PhasePoint<N, T>) -> PhasePoint<N, T> {
        PhasePoint { q: x.q + self.q, p: x.p + self.p, z: x.z + self.z }
    }
}

/// The derivative of a map at a state, as a matrix with the coordinates in the order q, p, z.
pub(crate) fn jacobian<E, const N: usize>(
    x: &PhasePoint<N>,
    map: impl Fn(&SeededPoint<N>) -> Result<SeededPoint<N>, E>,
) -> Result<DMatrix<f64>, E> {
    let end = map(&seed(&ChartVector::from(*x)).into())?;
    let row = |i: usize| match i {
        _ if i < N => end.q[i].d,
        _ if i < 2 * N => end.p[i - N].d,
        _ => end.z.d,
    };
    Ok(DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| row(i).component(j)))
}

/// A state with its derivatives in the coordinates of another.
pub(crate) type SeededPoint<const N: usize> = PhasePoint<N, Dual<f64, ChartVector<N>>>;
