//! A formula as a local term.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, VelocityPoint};
use formula_lagrangian::FormulaLagrangian;
use sparse_herglotz::Potential;

/// The part of a formula without velocities and z: minus a potential energy of `K` coordinates.
pub(super) struct AtRest<const K: usize>(pub FormulaLagrangian<K>);

/// The zero vector.
#[inline(always)]
fn zeros<T: Scalar, const K: usize>() -> SVector<T, K> {
    SVector::from_fn(|_, _| T::zero())
}

impl<const K: usize> Potential<K> for AtRest<K> {
    #[inline(always)]
    fn energy<T: Scalar>(&self, t: T, q: &SVector<T, K>, _c: &[T; 0]) -> T {
        -self.0.value(t, q, &zeros(), T::zero())
    }

    #[inline(always)]
    fn gradient<T: Scalar>(&self, t: T, q: &SVector<T, K>, _c: &[T; 0]) -> SVector<T, K> {
        let at = VelocityPoint { q: *q, v: zeros(), z: T::zero() };
        // Formulas have their force in closed form.
        let force = self.0.closed_force(t, &at).unwrap_or_else(|| SVector::from_fn(|_, _| T::from(f64::NAN)));
        SVector::from_fn(|i, _| -force[i])
    }
}
