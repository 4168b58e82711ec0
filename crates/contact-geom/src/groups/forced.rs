//! Lagrangians on a group with a force.

use super::{GroupLagrangian, GroupPartials, LieGroup};
use crate::Scalar;
use crate::support::linear::SingularMatrix;
use nalgebra::SVector;

/// A force in the body that has no potential, such as a thrust or the drag of a medium.
pub trait GroupForce<G: LieGroup<N>, const N: usize> {
    /// The force `f(t, g, xi, z)`, an element of the dual of the algebra: its virtual work is `f . (g^-1 delta g)`.
    fn value<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> SVector<T, N>;

    /// Whether the force acts; one that does not is not evaluated.
    fn acts(&self) -> bool {
        true
    }
}

/// A force that may be absent.
impl<G: LieGroup<N>, F: GroupForce<G, N>, const N: usize> GroupForce<G, N> for Option<F> {
    fn value<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> SVector<T, N> {
        match self {
            Some(force) => force.value(t, g, xi, z),
            None => SVector::zeros(),
        }
    }
    fn acts(&self) -> bool {
        self.as_ref().is_some_and(F::acts)
    }
}

/// A Lagrangian with a force, by the principle of Lagrange, d'Alembert and Herglotz:
/// `Pidot = ad_xi^T Pi + l_g + l_z Pi + f`, `zdot = l`.
///
/// The defect of the contact form of its motion is the virtual work of the force.
///
/// ```
/// use contact_geom::Scalar;
/// use contact_geom::groups::{
///     GroupForce, GroupForced, GroupLagrangian, Inertia, LieGroup, NoPotential, RigidBody, Rotation, Rotations,
/// };
/// use contact_geom::nalgebra::SVector;
/// /// A torque against the rotation about the first axis.
/// struct Brake;
/// impl GroupForce<Rotations, 3> for Brake {
///     fn value<T: Scalar>(&self, _t: T, _g: &Rotation<T>, xi: &SVector<T, 3>, _z: T) -> SVector<T, 3> {
///         SVector::from([xi[0] * -0.2, T::zero(), T::zero()])
///     }
/// }
/// let body = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 3.0])?, NoPotential, 0.0)?;
/// let braked = GroupForced { lagrangian: body, force: Brake };
/// let torque = braked.applied_force(0.0, &Rotations::identity(), &SVector::from([1.0, 0.0, 0.0]), 0.0);
/// assert_eq!(torque[0], -0.2);
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupForced<L, F> {
    /// The Lagrangian.
    pub lagrangian: L,
    /// The force.
    pub force: F,
}

impl<G, L, F, const N: usize> GroupLagrangian<G, N> for GroupForced<L, F>
where
    G: LieGroup<N>,
    L: GroupLagrangian<G, N>,
    F: GroupForce<G, N>,
{
    fn value<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T {
        self.lagrangian.value(t, g, xi, z)
    }
    fn constant_rate(&self) -> Option<f64> {
        self.lagrangian.constant_rate()
    }
    #[inline]
    fn applied_force<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> SVector<T, N> {
        self.force.value(t, g, xi, z) + self.lagrangian.applied_force(t, g, xi, z)
    }
    fn is_forced(&self) -> bool {
        self.force.acts() || self.lagrangian.is_forced()
    }
    #[inline]
    fn partials<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> GroupPartials<N, T> {
        self.lagrangian.partials(t, g, xi, z)
    }
    #[inline]
    fn solve_mass<T: Scalar>(
        &self,
        t: T,
        g: &G::Element<T>,
        xi: &SVector<T, N>,
        z: T,
        b: &SVector<T, N>,
    ) -> Result<SVector<T, N>, SingularMatrix> {
        self.lagrangian.solve_mass(t, g, xi, z, b)
    }
}
