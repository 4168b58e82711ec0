//! Lagrangians on a Lie group.

use super::LieGroup;
use crate::support::linear::{SingularMatrix, solve};
use crate::{ChartVector, Dual, Scalar};
use nalgebra::{SMatrix, SVector};

/// A Lagrangian `l(t, g, xi, z)` on a Lie group, with the body velocity `xi = g^-1 gdot`, written once as a generic
/// function.
///
/// The motion makes the final action critical, where `zdot = l`. Its equations are those of Euler, Poincaré and
/// Herglotz, with the body momentum `Pi = l_xi` and the left-trivialised derivative `l_g`:
///
/// `gdot = g xi`, `Pidot = ad_xi^T Pi + l_g + l_z Pi`, `zdot = l`
///
/// (arXiv 2512.17424). A force that has no potential, such as a thrust, is added to `l_g`:
/// [`applied_force`](Self::applied_force). Only [`value`](Self::value) is needed; closed derivatives make steps faster.
pub trait GroupLagrangian<G: LieGroup<N>, const N: usize> {
    /// The value `l(t, g, xi, z)`.
    fn value<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T;

    /// The rate gamma if `l = l_0(t, g, xi) + gamma z` with a constant gamma; `None`, the default, makes no claim.
    fn constant_rate(&self) -> Option<f64> {
        None
    }

    /// The force in the body that has no potential, by the principle of Lagrange, d'Alembert and Herglotz: its virtual
    /// work is `force . (g^-1 delta g)`, a torque on SO(3). By default it is 0.
    #[inline]
    fn applied_force<T: Scalar>(&self, _t: T, _g: &G::Element<T>, _xi: &SVector<T, N>, _z: T) -> SVector<T, N> {
        SVector::zeros()
    }

    /// Whether there is an [applied force](Self::applied_force), with which the flow is not contact.
    fn is_forced(&self) -> bool {
        false
    }

    /// The value with its first derivatives, by default by dual numbers.
    fn partials<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> GroupPartials<N, T> {
        partials_of::<G, T, N>(t, g, xi, z, |t, g, xi, z| self.value(t, g, xi, z))
    }

    /// Solves `l_xixi x = b` for the mass matrix `l_xixi`, by default with second derivatives by dual numbers.
    ///
    /// # Errors
    /// [`SingularMatrix`] where the Lagrangian is not regular.
    fn solve_mass<T: Scalar>(
        &self,
        t: T,
        g: &G::Element<T>,
        xi: &SVector<T, N>,
        z: T,
        b: &SVector<T, N>,
    ) -> Result<SVector<T, N>, SingularMatrix> {
        type Once<T, const N: usize> = Dual<T, SVector<T, N>>;
        type Twice<T, const N: usize> = Dual<Once<T, N>, SVector<Once<T, N>, N>>;
        let constant = |x: T| Twice::<T, N>::constant(Once::<T, N>::constant(x));
        let mut velocity = xi.map(constant);
        for i in 0..N {
            velocity[i].re.d[i] = T::one();
            velocity[i].d[i] = Once::<T, N>::constant(T::one());
        }
        let value = self.value(constant(t), &G::lift(g, constant), &velocity, constant(z));
        let mut mass = SMatrix::<T, N, N>::from_fn(|i, j| value.d[i].d[j]);
        let mut x = *b;
        solve(&mut mass, &mut x)?;
        Ok(x)
    }
}

/// A number with its derivatives along body coordinates `(eta, xi, z)` at `g exp(eta)`.
pub(super) type Seed<T, const N: usize> = Dual<T, ChartVector<N, T>>;

/// The value with its first derivatives, from a function on dual numbers.
#[inline]
pub(super) fn partials_of<G: LieGroup<N>, T: Scalar, const N: usize>(
    t: T,
    g: &G::Element<T>,
    xi: &SVector<T, N>,
    z: T,
    value: impl FnOnce(Seed<T, N>, &G::Element<Seed<T, N>>, &SVector<Seed<T, N>, N>, Seed<T, N>) -> Seed<T, N>,
) -> GroupPartials<N, T> {
    let mut eta = SVector::<Seed<T, N>, N>::zeros();
    let mut velocity = xi.map(Seed::<T, N>::constant);
    for i in 0..N {
        eta[i].d.x[i] = T::one();
        velocity[i].d.y[i] = T::one();
    }
    let mut action = Seed::<T, N>::constant(z);
    action.d.z = T::one();
    let moved = G::compose(&G::lift(g, Seed::<T, N>::constant), &G::exp(&eta));
    let value = value(Dual::constant(t), &moved, &velocity, action);
    GroupPartials { value: value.re, force: value.d.x, momentum: value.d.y, rate: value.d.z }
}

impl<G: LieGroup<N>, L: GroupLagrangian<G, N>, const N: usize> GroupLagrangian<G, N> for &L {
    fn value<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> T {
        (**self).value(t, g, xi, z)
    }
    fn constant_rate(&self) -> Option<f64> {
        (**self).constant_rate()
    }
    fn applied_force<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> SVector<T, N> {
        (**self).applied_force(t, g, xi, z)
    }
    fn is_forced(&self) -> bool {
        (**self).is_forced()
    }
    fn partials<T: Scalar>(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> GroupPartials<N, T> {
        (**self).partials(t, g, xi, z)
    }
    fn solve_mass<T: Scalar>(
        &self,
        t: T,
        g: &G::Element<T>,
        xi: &SVector<T, N>,
        z: T,
        b: &SVector<T, N>,
    ) -> Result<SVector<T, N>, SingularMatrix> {
        (**self).solve_mass(t, g, xi, z, b)
    }
}

/// The value of a Lagrangian on a group with its first derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupPartials<const N: usize, T = f64> {
    /// The value l.
    pub value: T,
    /// The left-trivialised derivative in g: `d/ds l(g exp(s eta)) = force . eta`.
    pub force: SVector<T, N>,
    /// The body momentum `Pi = l_xi`.
    pub momentum: SVector<T, N>,
    /// The rate `l_z`.
    pub rate: T,
}
