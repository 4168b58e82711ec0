//! Potentials on a group.

use super::rotation::cross;
use super::{LieGroup, Rotation, Rotations};
use crate::dynamics::parameters::indexed_names;
use crate::{Dual, Scalar};
use nalgebra::SVector;

/// A potential `V(g)` on a Lie group.
pub trait GroupPotential<G: LieGroup<N>, const N: usize> {
    /// The value `V(g)`.
    fn value<T: Scalar>(&self, g: &G::Element<T>) -> T;

    /// The value with the left-trivialised gradient, `d/ds V(g exp(s eta)) = gradient . eta`; by default by dual
    /// numbers.
    fn with_gradient<T: Scalar>(&self, g: &G::Element<T>) -> (T, SVector<T, N>) {
        type Seed<T, const N: usize> = Dual<T, SVector<T, N>>;
        let mut eta = SVector::<Seed<T, N>, N>::zeros();
        for i in 0..N {
            eta[i].d[i] = T::one();
        }
        let value = self.value(&G::compose(&G::lift(g, Seed::<T, N>::constant), &G::exp(&eta)));
        (value.re, value.d)
    }

    /// The names of the parameters of the potential, with respect to which motions can be differentiated; by default
    /// there are none.
    fn parameter_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The value for any values of the parameters, as many as there are names.
    fn value_at<T: Scalar>(&self, _theta: &[T], g: &G::Element<T>) -> T {
        self.value(g)
    }
}

/// No potential: the free body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoPotential;

impl<G: LieGroup<N>, const N: usize> GroupPotential<G, N> for NoPotential {
    #[inline]
    fn value<T: Scalar>(&self, _g: &G::Element<T>) -> T {
        T::zero()
    }
    #[inline]
    fn with_gradient<T: Scalar>(&self, _g: &G::Element<T>) -> (T, SVector<T, N>) {
        (T::zero(), SVector::zeros())
    }
}

/// Uniform gravity on a body with a fixed point, `V(R) = -weight . (R X)`: the weight is the mass times the
/// acceleration of gravity, a vector in space, and X leads from the fixed point to the centre of mass, in the body. The
/// rotations about the weight leave it invariant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformGravity {
    /// The weight, a force in space.
    pub weight: [f64; 3],
    /// The centre of mass X in the body.
    pub centre: [f64; 3],
}

/// `weight[0..3]` and `centre[0..3]`.
impl GroupPotential<Rotations, 3> for UniformGravity {
    #[inline]
    fn value<T: Scalar>(&self, g: &Rotation<T>) -> T {
        let [weight, centre] = [self.weight, self.centre].map(|x| SVector::from(x.map(T::from)));
        -g.apply(&centre).dot(&weight)
    }

    /// `V = -X . Gamma` with the weight in the body `Gamma = R^T weight`; the gradient is `Gamma x X`.
    #[inline]
    fn with_gradient<T: Scalar>(&self, g: &Rotation<T>) -> (T, SVector<T, 3>) {
        let weight = g.apply_inverse(&SVector::from(self.weight.map(T::from)));
        let centre = SVector::from(self.centre.map(T::from));
        (-centre.dot(&weight), cross(&weight, &centre))
    }

    fn parameter_names(&self) -> Vec<String> {
        indexed_names("weight", 3).chain(indexed_names("centre", 3)).collect()
    }

    fn parameters(&self) -> Vec<f64> {
        self.weight.into_iter().chain(self.centre).collect()
    }

    fn value_at<T: Scalar>(&self, theta: &[T], g: &Rotation<T>) -> T {
        let [a, b, c, x, y, z] = *theta else { return T::from(f64::NAN) };
        -g.apply(&SVector::from([x, y, z])).dot(&SVector::from([a, b, c]))
    }
}
