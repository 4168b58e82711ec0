//! States of a motion as losses see them, and the derivatives of losses.

use crate::{State, Vector};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Dual, Scalar};

/// A state of a motion over a [`Scalar`], for a fixed number of coordinates: the argument of a [`Loss`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndState<const N: usize, T = f64> {
    /// The time.
    pub t: T,
    /// The position.
    pub q: SVector<T, N>,
    /// The velocity.
    pub v: SVector<T, N>,
    /// The momentum.
    pub p: SVector<T, N>,
    /// The action.
    pub z: T,
}

/// A function of the end of a run, written once as a generic function, as a [`Lagrangian`](contact_geom::Lagrangian) is:
/// its derivatives are found by automatic differentiation.
///
/// ```
/// use contact_geom::Scalar;
/// use discrete_herglotz::sensitivity::{EndState, Loss};
/// struct Miss { target: f64 }
/// impl Loss<1> for Miss {
///     fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
///         (end.q[0] - self.target).powi(2) + end.v[0] * end.v[0] * 0.1
///     }
/// }
/// ```
pub trait Loss<const N: usize> {
    /// The value.
    fn value<T: Scalar>(&self, end: &EndState<N, T>) -> T;
}

/// A time of a motion, with the state there, its velocity and its momentum.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionState {
    /// The time.
    pub t: f64,
    /// The position.
    pub q: Vector,
    /// The velocity; NaN where no velocity has the momentum of the state.
    pub v: Vector,
    /// The momentum.
    pub p: Vector,
    /// The action.
    pub z: f64,
}

/// The partial derivatives of a number in a [`MotionState`], each component for fixed others; those of v and p are added,
/// as p depends on v.
#[derive(Clone, Debug, PartialEq)]
pub struct EndCovector {
    /// In the time.
    pub t: f64,
    /// In the position.
    pub q: Vector,
    /// In the velocity.
    pub v: Vector,
    /// In the momentum.
    pub p: Vector,
    /// In the action.
    pub z: f64,
}

impl EndCovector {
    /// No dependence, for n coordinates.
    pub fn zero(n: usize) -> Self {
        let zero = || Vector::zeros(n);
        EndCovector { t: 0.0, q: zero(), v: zero(), p: zero(), z: 0.0 }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.q.iter().chain(&self.v).chain(&self.p).chain([&self.t, &self.z]).all(|x| x.is_finite())
    }
}

impl MotionState {
    /// The state at a time, with its velocity.
    pub(crate) fn at(t: f64, state: &State, v: &Vector) -> Self {
        MotionState { t, q: state.q.clone(), v: v.clone(), p: state.p.clone(), z: state.z }
    }

    /// The same for a number of coordinates that is known at compile time; NaN for coordinates that it does not have.
    pub fn fixed<const N: usize>(&self) -> EndState<N> {
        EndState { t: self.t, q: self.q.fixed(), v: self.v.fixed(), p: self.p.fixed(), z: self.z }
    }

    /// A loss of this state, with its partial derivatives. Both are NaN for a loss of another number of coordinates.
    pub fn differentiate<const N: usize>(&self, loss: &impl Loss<N>) -> (f64, EndCovector) {
        if self.q.len() != N {
            let none = || Vector::repeat(self.q.len(), f64::NAN);
            return (f64::NAN, EndCovector { t: f64::NAN, q: none(), v: none(), p: none(), z: f64::NAN });
        }
        let state = self.fixed::<N>();
        let mut seeded = state.constant();
        for i in 0..N {
            seeded.q[i].d.x[i] = 1.0;
            seeded.p[i].d.y[i] = 1.0;
        }
        seeded.z.d.z = 1.0;
        let value = loss.value(&seeded);
        let mut seeded = state.constant();
        for i in 0..N {
            seeded.v[i].d.x[i] = 1.0;
        }
        seeded.t.d.z = 1.0;
        let rest = loss.value(&seeded);
        let covector =
            EndCovector { t: rest.d.z, q: value.d.x.into(), v: rest.d.x.into(), p: value.d.y.into(), z: value.d.z };
        (value.re, covector)
    }
}

impl<const N: usize> EndState<N> {
    /// The state as constants, for which derivatives are seeded afterwards.
    fn constant(&self) -> EndState<N, Dual<f64, ChartVector<N>>> {
        let EndState { t, q, v, p, z } = self;
        let [q, v, p] = [q, v, p].map(|x| x.map(Dual::from));
        EndState { t: Dual::from(*t), q, v, p, z: Dual::from(*z) }
    }
}
