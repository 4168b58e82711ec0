//! A system over slices as a Lagrangian with few coordinates, whose kernels are those of any Lagrangian.

use contact_geom::nalgebra::{ArrayStorage, SMatrix, SVector};
use contact_geom::{ChartVector, Hints, Lagrangian, Scalar, VelocityPoint, vector};
use contact_geom::{ScalarSystem, Slopes};

/// A [`ScalarSystem`] of N coordinates.
pub(crate) struct OverSlices<'f, F>(pub &'f F);

/// A number that was written through a slice; moved as a number, see [`Stages::block`](crate::numbers::registers::Stages::block).
#[inline(always)]
fn whole<T: Scalar>(x: T) -> T {
    -(-x)
}

#[inline(always)]
fn whole_vector<T: Scalar, const N: usize>(x: &SVector<T, N>) -> SVector<T, N> {
    vector!(|i| whole(x[i]))
}

impl<F: ScalarSystem, const N: usize> Lagrangian<N> for OverSlices<'_, F> {
    const HINTS: Hints = Hints { proved: true, interpreted: true, forced: true, ..Hints::NONE };

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value::<T, N>(t, q.as_slice(), v.as_slice(), z)
    }

    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        let (mut force, mut momentum, mut rate): (SVector<T, N>, SVector<T, N>, T) =
            (vector!(|_| T::zero()), vector!(|_| T::zero()), T::zero());
        let to = Slopes { q: force.as_mut_slice(), v: momentum.as_mut_slice(), z: &mut rate };
        let value = self.0.with_gradient::<T, N>(t, x.q.as_slice(), x.v.as_slice(), x.z, to);
        let gradient = ChartVector { x: whole_vector(&force), y: whole_vector(&momentum), z: whole(rate) };
        Some((whole(value), gradient))
    }

    #[inline(always)]
    fn closed_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SVector<T, N>> {
        let mut force: SVector<T, N> = vector!(|_| T::zero());
        self.0.force::<T, N>(t, x.q.as_slice(), force.as_mut_slice());
        Some(whole_vector(&force))
    }

    #[inline(always)]
    fn closed_mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SMatrix<T, N, N>> {
        let mut w: SMatrix<T, N, N> = SMatrix::from_array_storage(ArrayStorage([[T::zero(); N]; N]));
        self.0.mass_matrix::<T, N>(t, x.q.as_slice(), x.v.as_slice(), x.z, w.as_mut_slice());
        Some(w)
    }

    #[inline(always)]
    fn applied_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let mut force: SVector<T, N> = vector!(|_| T::zero());
        if self.0.has_force() {
            self.0.applied_force::<T, N>(t, x.q.as_slice(), x.v.as_slice(), x.z, force.as_mut_slice());
        }
        whole_vector(&force)
    }
}
