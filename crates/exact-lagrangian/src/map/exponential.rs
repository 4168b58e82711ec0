//! The contact exponential map and its differential.

use crate::{ExactError, Motion, herglotz_flow};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{ChartVector, DiscretePoint, Lagrangian, Regularity, Scalar, VelocityPoint, support::seed};
use contact_geom::{Dual, GeometryError, Smooth};
use discrete_herglotz::InputError;

/// The contact exponential map `exp_h : (q0, v0, z0) -> (q0, q1, z0)` of a regular Lagrangian, where `q1` is the
/// position of the motion after a time h; paper, section 4.1. Its inverse is the exact retraction,
/// [`retract`](Self::retract).
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use exact_lagrangian::ContactExponential;
///
/// let exp = ContactExponential::new(Pendulum::default(), 0.5)?;
/// let x = VelocityPoint::new([1.0], [0.3], 0.0);
/// let back = exp.retract(0.0, &exp.at(0.0, &x)?)?;
/// assert!((back.start.v[0] - 0.3).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ContactExponential<L> {
    pub(crate) lagrangian: L,
    pub(crate) h: f64,
}

/// A motion on dual numbers, with its derivatives with respect to all coordinates of the start.
pub(crate) type Varied<const N: usize> = Motion<N, Dual<f64, ChartVector<N>>>;

/// The exponential map's value and derivatives at a point of TQ x R.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ExponentialDifferential<const N: usize> {
    /// The image `(q0, q1, z0)`.
    pub image: DiscretePoint<N>,
    /// `dq1/dq0`.
    pub q: SMatrix<f64, N, N>,
    /// `dq1/dv0`; the map is a local diffeomorphism where it is regular.
    pub v: SMatrix<f64, N, N>,
    /// `dq1/dz0`.
    pub z: SVector<f64, N>,
}

impl<const N: usize> ExponentialDifferential<N> {
    /// The linearisation `T exp_h` in the coordinates' order: rows `(1, 0, 0)`, `(dq1/dq0, dq1/dv0, dq1/dz0)`,
    /// `(0, 0, 1)`.
    pub fn jacobian(&self) -> DMatrix<f64> {
        DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match (i, j) {
            (i, j) if i >= N && i < 2 * N => match j {
                _ if j < N => self.q[(i - N, j)],
                _ if j < 2 * N => self.v[(i - N, j - N)],
                _ => self.z[i - N],
            },
            (i, j) if i == j => 1.0,
            _ => 0.0,
        })
    }

    /// The singular values of `dq1/dv0`: the map is a local diffeomorphism where the smallest does not vanish. For
    /// small h all of them are about h.
    pub fn regularity(&self) -> Regularity {
        singular_values(&self.v)
    }
}

/// The singular values of a small matrix.
pub(crate) fn singular_values<const N: usize>(m: &SMatrix<f64, N, N>) -> Regularity {
    Regularity::of(DMatrix::from_fn(N, N, |i, j| m[(i, j)]))
}

impl<L> ContactExponential<L> {
    /// The exponential map of a Lagrangian for a time step.
    ///
    /// # Errors
    /// [`InputError::Step`] unless `h` is positive and finite.
    pub fn new(lagrangian: L, h: f64) -> Result<Self, InputError> {
        if h > 0.0 && h.is_finite() { Ok(ContactExponential { lagrangian, h }) } else { Err(InputError::Step { h }) }
    }

    /// The time step.
    pub fn step_size(&self) -> f64 {
        self.h
    }

    /// The image `(q0, q1, z0)` of a point at time t, over any scalar.
    ///
    /// # Errors
    /// Those of [`herglotz_flow`]; in particular [`ExactError::OutsideDomain`] outside `U_h`.
    pub fn at<T: Scalar, const N: usize>(
        &self,
        t: f64,
        x: &VelocityPoint<N, T>,
    ) -> Result<DiscretePoint<N, T>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let motion = herglotz_flow(&self.lagrangian, t, x, self.h)?;
        Ok(DiscretePoint { q0: x.q, q1: motion.end.q, z0: x.z })
    }

    /// The image of a point with the derivatives of the map, by the first variational equation.
    ///
    /// # Errors
    /// Those of [`herglotz_flow`].
    pub fn differential<const N: usize>(
        &self,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Result<ExponentialDifferential<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let q1 = self.varied(t, x)?.end.q;
        Ok(ExponentialDifferential {
            image: DiscretePoint { q0: x.q, q1: q1.map(|c| c.re), z0: x.z },
            q: SMatrix::from_fn(|i, j| q1[i].d.x[j]),
            v: SMatrix::from_fn(|i, j| q1[i].d.y[j]),
            z: SVector::from_fn(|i, _| q1[i].d.z),
        })
    }

    /// The motion with its derivatives with respect to all coordinates of the start.
    pub(crate) fn varied<const N: usize>(&self, t: f64, x: &VelocityPoint<N>) -> Result<Varied<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        herglotz_flow(&self.lagrangian, t, &seed(&ChartVector::from(*x)).into(), self.h)
    }
}

/// The flow of the Herglotz vector field after a fixed time, as a map of TQ x R that can be differentiated.
#[derive(Clone, Copy, Debug)]
pub struct HerglotzFlow<'a, L> {
    /// The Lagrangian.
    pub lagrangian: &'a L,
    /// The time at the start.
    pub t: f64,
    /// The duration; a negative one runs backward in time.
    pub duration: f64,
}

impl<const N: usize, L: Lagrangian<N>> Smooth<N> for HerglotzFlow<'_, L> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        Ok(herglotz_flow(self.lagrangian, self.t, &(*x).into(), self.duration)?.end.into())
    }
}
