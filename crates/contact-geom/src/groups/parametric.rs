//! Parameters of Lagrangians on groups, with respect to which motions can be differentiated.

use super::lagrangian::partials_of;
use super::{GroupForce, GroupForced, GroupLagrangian, GroupPartials, GroupPotential, LieGroup, RigidBody};
use crate::Scalar;
use nalgebra::SVector;

/// A Lagrangian on a group with named parameters `theta`, which can be evaluated for any values of them.
pub trait ParametricGroupLagrangian<G: LieGroup<N>, const N: usize>: GroupLagrangian<G, N> {
    /// The names of the parameters, without repetition.
    fn parameter_names(&self) -> Vec<String>;

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64>;

    /// The value `l(t, g, xi, z; theta)`, for as many values as there are names.
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T;

    /// The [rate](GroupLagrangian::constant_rate), where it is constant.
    fn constant_rate_at<T: Scalar>(&self, _theta: &[T]) -> Option<T> {
        self.constant_rate().map(T::from)
    }

    /// The first derivatives, by dual numbers.
    fn partials_at<T: Scalar>(
        &self,
        theta: &[T],
        t: T,
        g: &G::Element<T>,
        xi: &SVector<T, N>,
        z: T,
    ) -> GroupPartials<N, T> {
        let theta: Vec<_> = theta.iter().map(|x| super::lagrangian::Seed::<T, N>::constant(*x)).collect();
        partials_of::<G, T, N>(t, g, xi, z, |t, g, xi, z| self.value_at(&theta, t, g, xi, z))
    }
}

impl<G, L, const N: usize> ParametricGroupLagrangian<G, N> for &L
where
    G: LieGroup<N>,
    L: ParametricGroupLagrangian<G, N>,
{
    fn parameter_names(&self) -> Vec<String> {
        (**self).parameter_names()
    }
    fn parameters(&self) -> Vec<f64> {
        (**self).parameters()
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T {
        (**self).value_at(theta, t, g, xi, z)
    }
    fn constant_rate_at<T: Scalar>(&self, theta: &[T]) -> Option<T> {
        (**self).constant_rate_at(theta)
    }
}

/// The entries `M[i][j]` with `i <= j` of the mass matrix, the parameters of the potential, and `gamma`.
impl<G, V, const N: usize> ParametricGroupLagrangian<G, N> for RigidBody<V, N>
where
    G: LieGroup<N>,
    V: GroupPotential<G, N>,
{
    fn parameter_names(&self) -> Vec<String> {
        let entries = upper_triangle::<N>().map(|(i, j)| format!("M[{i}][{j}]"));
        entries.chain(self.potential().parameter_names()).chain(["gamma".to_owned()]).collect()
    }

    fn parameters(&self) -> Vec<f64> {
        let entries = upper_triangle::<N>().map(|index| self.mass()[index]);
        entries.chain(self.potential().parameters()).chain([self.gamma()]).collect()
    }

    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T {
        let Some((gamma, theta)) = theta.split_last() else { return T::from(f64::NAN) };
        let Some((mass, of_potential)) = theta.split_at_checked(N * (N + 1) / 2) else { return T::from(f64::NAN) };
        let mut kinetic = T::zero();
        for ((i, j), m) in upper_triangle::<N>().zip(mass) {
            kinetic += *m * xi[i] * xi[j] * if i == j { 0.5 } else { 1.0 };
        }
        kinetic - self.potential().value_at(of_potential, g) + z * *gamma
    }

    fn constant_rate_at<T: Scalar>(&self, theta: &[T]) -> Option<T> {
        theta.last().copied()
    }
}

/// The index pairs `(i, j)` with `i <= j < N`, row by row.
fn upper_triangle<const N: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..N).flat_map(|i| (i..N).map(move |j| (i, j)))
}

/// The parameters of the Lagrangian; those of the force are constant.
impl<G, L, F, const N: usize> ParametricGroupLagrangian<G, N> for GroupForced<L, F>
where
    G: LieGroup<N>,
    L: ParametricGroupLagrangian<G, N>,
    F: GroupForce<G, N>,
{
    fn parameter_names(&self) -> Vec<String> {
        self.lagrangian.parameter_names()
    }
    fn parameters(&self) -> Vec<f64> {
        self.lagrangian.parameters()
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T {
        self.lagrangian.value_at(theta, t, g, xi, z)
    }
    fn constant_rate_at<T: Scalar>(&self, theta: &[T]) -> Option<T> {
        self.lagrangian.constant_rate_at(theta)
    }
}
