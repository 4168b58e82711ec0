//! Rigid bodies with linear drag.

use super::{GroupError, GroupLagrangian, GroupPartials, GroupPotential, Inertia, LieGroup};
use crate::Scalar;
use crate::numbers::dot;
use crate::support::linear::SingularMatrix;
use nalgebra::{SMatrix, SVector, SymmetricEigen};

/// A left-invariant kinetic energy with a potential and linear drag, `l = xi . M xi/2 - V(g) + gamma z`, on any group:
/// a rigid body about a fixed point on SO(3), a body in space on SE(3), several bodies on a product.
///
/// ```
/// use contact_geom::groups::{GroupLagrangian, Inertia, NoPotential, RigidBody, Rotations};
/// let body = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 3.0])?, NoPotential, -0.1)?;
/// let rate = GroupLagrangian::<Rotations, 3>::constant_rate(&body);
/// assert_eq!(rate, Some(-0.1));
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidBody<V, const N: usize> {
    mass: SMatrix<f64, N, N>,
    inverse: SMatrix<f64, N, N>,
    potential: V,
    gamma: f64,
}

impl<V> RigidBody<V, 3> {
    /// A body about a fixed point, on [`Rotations`](super::Rotations).
    ///
    /// # Errors
    /// [`GroupError::NonFinite`] for gamma.
    pub fn rotating(inertia: &Inertia, potential: V, gamma: f64) -> Result<Self, GroupError> {
        RigidBody::new(*inertia.matrix(), potential, gamma)
    }
}

impl<V> RigidBody<V, 6> {
    /// A body in space, on [`RigidMotions`](super::RigidMotions), with its origin at the centre of mass.
    ///
    /// # Errors
    /// [`GroupError::NotPositive`] for the mass, [`GroupError::NonFinite`] for gamma.
    pub fn moving(inertia: &Inertia, mass: f64, potential: V, gamma: f64) -> Result<Self, GroupError> {
        let block = |i: usize, j: usize| match (i < 3, j < 3) {
            (true, true) => inertia.matrix()[(i, j)],
            (false, false) if i == j => mass,
            _ => 0.0,
        };
        RigidBody::new(SMatrix::from_fn(block), potential, gamma)
    }
}

impl<V, const N: usize> RigidBody<V, N> {
    /// The body with the kinetic energy `xi . M xi/2`, M the mass matrix in the body.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NotSymmetric`], [`GroupError::NotPositive`].
    pub fn new(mass: SMatrix<f64, N, N>, potential: V, gamma: f64) -> Result<Self, GroupError> {
        if !gamma.is_finite() {
            return Err(GroupError::NonFinite { what: "the rate gamma", value: gamma });
        }
        if let Some(&value) = mass.iter().find(|x| !x.is_finite()) {
            return Err(GroupError::NonFinite { what: "an entry of the mass matrix", value });
        }
        for (i, j) in (0..N).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let difference = (mass[(i, j)] - mass[(j, i)]).abs();
            if difference > 8.0 * f64::EPSILON * (mass[(i, i)].abs() + mass[(j, j)].abs()) {
                return Err(GroupError::NotSymmetric { what: "mass matrix", difference });
            }
        }
        let dynamic = dynamic_matrix(&mass);
        let smallest = SymmetricEigen::new(dynamic.clone()).eigenvalues.min();
        let not_positive = GroupError::NotPositive { what: "mass matrix", smallest };
        if smallest.is_nan() || smallest <= 0.0 {
            return Err(not_positive);
        }
        let inverse = dynamic.try_inverse().ok_or(not_positive)?;
        let inverse = SMatrix::<f64, N, N>::from_fn(|i, j| 0.5 * (inverse[(i, j)] + inverse[(j, i)]));
        if let Some(&value) = inverse.iter().find(|x| !x.is_finite()) {
            // Products of its entries overflow.
            return Err(GroupError::NonFinite { what: "an entry of the inverse of the mass matrix", value });
        }
        Ok(RigidBody { mass, inverse, potential, gamma })
    }

    /// The mass matrix M in the body.
    pub fn mass(&self) -> &SMatrix<f64, N, N> {
        &self.mass
    }

    /// The potential.
    pub fn potential(&self) -> &V {
        &self.potential
    }

    /// The rate gamma, negative for dissipation.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// The body momentum `Pi = M xi` of a body velocity.
    #[inline]
    pub fn momentum<T: Scalar>(&self, xi: &SVector<T, N>) -> SVector<T, N> {
        product(&self.mass, xi)
    }

    /// The body velocity `xi = M^-1 Pi` of a body momentum.
    #[inline]
    pub fn velocity<T: Scalar>(&self, momentum: &SVector<T, N>) -> SVector<T, N> {
        product(&self.inverse, momentum)
    }

    /// The energy `Pi . M^-1 Pi/2 + V(g) - gamma z`.
    pub fn energy<G: LieGroup<N>>(&self, g: &G::Element<f64>, momentum: &SVector<f64, N>, z: f64) -> f64
    where
        V: GroupPotential<G, N>,
    {
        0.5 * momentum.dot(&self.velocity(momentum)) + self.potential.value(g) - self.gamma * z
    }
}

/// The matrix with dimensions at run time, for which nalgebra's factorisations are implemented for every N.
fn dynamic_matrix<const N: usize>(m: &SMatrix<f64, N, N>) -> nalgebra::DMatrix<f64> {
    nalgebra::DMatrix::from_fn(N, N, |i, j| m[(i, j)])
}

/// A matrix of numbers times a vector.
#[inline]
fn product<T: Scalar, const N: usize>(m: &SMatrix<f64, N, N>, x: &SVector<T, N>) -> SVector<T, N> {
    SVector::from_fn(|i, _| {
        let mut sum = T::zero();
        for j in 0..N {
            sum += x[j] * m[(i, j)];
        }
        sum
    })
}

impl<G: LieGroup<N>, V: GroupPotential<G, N>, const N: usize> GroupLagrangian<G, N> for RigidBody<V, N> {
    fn value<T: Scalar>(&self, _t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T {
        xi.dot(&self.momentum(xi)) * 0.5 - self.potential.value(g) + z * self.gamma
    }

    fn constant_rate(&self) -> Option<f64> {
        Some(self.gamma)
    }

    #[inline]
    fn partials<T: Scalar>(&self, _t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> GroupPartials<N, T> {
        let (potential, gradient) = self.potential.with_gradient(g);
        let momentum = self.momentum(xi);
        GroupPartials {
            value: dot(xi, momentum) * 0.5 - potential + z * self.gamma,
            force: -gradient,
            momentum,
            rate: T::from(self.gamma),
        }
    }

    #[inline]
    fn solve_mass<T: Scalar>(
        &self,
        _t: T,
        _g: &G::Element<T>,
        _xi: &SVector<T, N>,
        _z: T,
        b: &SVector<T, N>,
    ) -> Result<SVector<T, N>, SingularMatrix> {
        Ok(self.velocity(b))
    }
}
