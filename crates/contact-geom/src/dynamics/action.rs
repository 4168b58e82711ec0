//! One-parameter groups acting on Q, their lifts to the contact manifolds, and their momenta.

use crate::{
    ChartVector, Derivatives, Dual, GeometryError, Lagrangian, Scalar, VelocityPoint, numbers::max_abs_or_nan,
};
use nalgebra::SVector;

type Line<T> = SVector<T, 1>;

/// A one-parameter group of diffeomorphisms of Q, given as a generic function: `act(0, q) = q` and
/// `act(s, act(r, q)) = act(s + r, q)`.
///
/// A Lie group G acts through the one-parameter groups `exp(s xi)` of its Lie algebra's elements; the momentum of each
/// is a component of the momentum map.
pub trait OneParameterGroup<const N: usize> {
    /// The image of `q` under the group element of parameter `s`.
    fn act<T: Scalar>(&self, s: T, q: &SVector<T, N>) -> SVector<T, N>;

    /// The infinitesimal generator `xi_Q(q) = d/ds act(s, q)` at `s = 0`.
    #[inline]
    fn generator<T: Scalar>(&self, q: &SVector<T, N>) -> SVector<T, N> {
        let s = Dual { re: T::zero(), d: Line::new(T::one()) };
        self.act(s, &q.map(Dual::constant)).map(|c| c.d[0])
    }

    /// The derivative of `act(s, .)` at `q` applied to `v`, together with the image of `q`: the tangent lift.
    #[inline]
    fn tangent_lift<T: Scalar>(&self, s: T, q: &SVector<T, N>, v: &SVector<T, N>) -> (SVector<T, N>, SVector<T, N>) {
        let moving = SVector::from_fn(|i, _| Dual { re: q[i], d: Line::new(v[i]) });
        let image = self.act(Dual::constant(s), &moving);
        (image.map(|c| c.re), image.map(|c| c.d[0]))
    }

    /// The lift to TQ x R, `(q, v, z) -> (act q, T act v, z)`; paper, section 2.2.2.
    #[inline]
    fn on_velocities<T: Scalar>(&self, s: T, x: &VelocityPoint<N, T>) -> VelocityPoint<N, T> {
        let (q, v) = self.tangent_lift(s, &x.q, &x.v);
        VelocityPoint { q, v, z: x.z }
    }

    /// The lift to Q x Q x R, `(q0, q1, z0) -> (act q0, act q1, z0)`; paper, section 3.2.
    #[inline]
    fn on_discrete<T: Scalar>(&self, s: T, x: &ChartVector<N, T>) -> ChartVector<N, T> {
        ChartVector { x: self.act(s, &x.x), y: self.act(s, &x.y), z: x.z }
    }

    /// The generator of the lift to TQ x R, `(xi_Q(q), T xi_Q . v, 0)`.
    #[inline]
    fn velocity_generator<T: Scalar>(&self, x: &VelocityPoint<N, T>) -> ChartVector<N, T> {
        let moving = SVector::from_fn(|i, _| Dual { re: x.q[i], d: Line::new(x.v[i]) });
        let xi = self.generator(&moving);
        ChartVector { x: xi.map(|c| c.re), y: xi.map(|c| c.d[0]), z: T::zero() }
    }

    /// The momentum `J = p . xi_Q(q) = -eta(xi)`. The sign is the same on the continuous and on the discrete side; see
    /// the errata to the paper's sections 2.2.2 and 3.2.
    #[inline]
    fn momentum<T: Scalar>(&self, q: &SVector<T, N>, p: &SVector<T, N>) -> T {
        p.dot(&self.generator(q))
    }

    /// The defect of the invariance of L to first order in the group's parameter: `|dL(xi_TQxR)|`, relative to the sum
    /// of the absolute terms. It is zero (to round-off) at every point if and only if the group is a symmetry of L.
    fn symmetry_defect(&self, lagrangian: &impl Lagrangian<N>, t: f64, x: &VelocityPoint<N>) -> f64 {
        let (g, xi) = (lagrangian.gradient(t, x), self.velocity_generator(x));
        let size = g.x.abs().dot(&xi.x.abs()) + g.y.abs().dot(&xi.y.abs());
        if size == 0.0 { 0.0 } else { g.dot(&xi).abs() / size }
    }
}

impl<const N: usize, G: OneParameterGroup<N>> OneParameterGroup<N> for &G {
    fn act<T: Scalar>(&self, s: T, q: &SVector<T, N>) -> SVector<T, N> {
        (**self).act(s, q)
    }
}

/// The most common one-parameter groups of mechanics, as data. Systems list their symmetries in this form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Symmetry<const N: usize> {
    /// `q + s a`.
    Translation(SVector<f64, N>),
    /// SO(2): rotation by the angle `s` in the plane of the coordinates of these two different indices.
    Rotation(usize, usize),
    /// Rotation by the angle `s` in several planes at once, as in a common rotation of several bodies: in the plane of
    /// the coordinates i and `planes[i]`, for each i that has one. No coordinate lies in two planes.
    Rotations([Option<usize>; N]),
    /// An element of SO(3), for N = 3: rotation by the angle `s` about this unit vector.
    Axis(SVector<f64, N>),
    /// `q_i e^(s w_i)`.
    Scaling(SVector<f64, N>),
}

impl<const N: usize> Symmetry<N> {
    /// Rotation in the plane of two coordinates.
    ///
    /// # Errors
    /// [`GeometryError::WrongSize`] unless both indices are below `N` and differ.
    pub fn rotation(i: usize, j: usize) -> Result<Self, GeometryError> {
        if i == j || i >= N || j >= N {
            return Err(GeometryError::WrongSize {
                what: "the plane of rotation",
                expected: N,
                found: i.max(j).saturating_add(1),
            });
        }
        Ok(Symmetry::Rotation(i, j))
    }

    /// Rotation in the planes of several pairs of coordinates at once.
    ///
    /// # Errors
    /// [`GeometryError::WrongSize`] unless all indices are below `N` and differ.
    pub fn rotations(pairs: &[(usize, usize)]) -> Result<Self, GeometryError> {
        let (mut planes, mut taken) = ([None; N], [false; N]);
        for &(i, j) in pairs {
            Self::rotation(i, j)?;
            if std::mem::replace(&mut taken[i], true) || std::mem::replace(&mut taken[j], true) {
                let what = "the list of coordinates of the planes of rotation, which must all differ,";
                return Err(GeometryError::WrongSize { what, expected: N, found: 2 * pairs.len() });
            }
            planes[i] = Some(j);
        }
        Ok(Symmetry::Rotations(planes))
    }

    /// Rotation about an axis of R^3, given by any non-zero vector.
    ///
    /// # Errors
    /// [`GeometryError::WrongSize`] unless `N = 3`; [`GeometryError::NonFinite`] if the axis is zero or not finite.
    pub fn axis(axis: [f64; 3]) -> Result<Self, GeometryError> {
        if N != 3 {
            return Err(GeometryError::WrongSize { what: "the axis of rotation", expected: N, found: 3 });
        }
        // Scaled by the largest component, since the squares of very large components overflow and those of very small
        // ones vanish.
        let most = max_abs_or_nan(axis);
        let axis = axis.map(|a| a / most);
        let length = SVector::from(axis).norm();
        let unit: SVector<f64, N> = SVector::from_fn(|i, _| axis[i] / length);
        match unit.iter().position(|c| !c.is_finite()) {
            Some(index) => Err(GeometryError::NonFinite { what: "axis / |axis|", index, value: unit[index] }),
            None => Ok(Symmetry::Axis(unit)),
        }
    }
}

impl<const N: usize> OneParameterGroup<N> for Symmetry<N> {
    #[inline]
    fn act<T: Scalar>(&self, s: T, q: &SVector<T, N>) -> SVector<T, N> {
        match self {
            Symmetry::Translation(a) => SVector::from_fn(|i, _| q[i] + s * a[i]),
            Symmetry::Rotation(i, j) => {
                let (sin, cos) = s.sin_cos();
                let mut image = *q;
                image[*i] = q[*i] * cos - q[*j] * sin;
                image[*j] = q[*i] * sin + q[*j] * cos;
                image
            }
            Symmetry::Rotations(planes) => {
                let (sin, cos) = s.sin_cos();
                let mut image = *q;
                for (i, j) in planes.iter().enumerate().filter_map(|(i, j)| j.filter(|j| *j < N).map(|j| (i, j))) {
                    image[i] = q[i] * cos - q[j] * sin;
                    image[j] = q[i] * sin + q[j] * cos;
                }
                image
            }
            Symmetry::Axis(a) => {
                // Rodrigues: q + sin(s) a x q + 2 sin^2(s/2) a x (a x q).
                let cross = |u: &SVector<T, N>| {
                    SVector::<T, N>::from_fn(|i, _| {
                        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                        u[k] * a[j] - u[j] * a[k]
                    })
                };
                let once = cross(q);
                let twice = cross(&once);
                let half = (s * 0.5).sin();
                let versine = half * half * 2.0;
                let sin = s.sin();
                SVector::from_fn(|i, _| q[i] + sin * once[i] + versine * twice[i])
            }
            Symmetry::Scaling(w) => SVector::from_fn(|i, _| q[i] * (s * w[i]).exp()),
        }
    }
}
