//! Lists of pieces.

use super::ContactPiece;
use crate::hamiltonian::ContactIncrement;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianDerivatives, PhasePoint, Scalar};

/// A list of [`ContactPiece`]s: a tuple of up to eight of different types, or a vector of pieces of one type, as of an
/// enum.
pub trait PieceList<const N: usize> {
    /// The map of one of the pieces over a time.
    type Map: Clone + std::fmt::Debug;

    /// The number of pieces.
    fn count(&self) -> usize;

    /// The sum of the pieces, and the sum of their magnitudes.
    fn sum<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> (T, f64);

    /// The contact Hamiltonian vector field of the piece of this index; `None` beyond the last.
    fn field(&self, index: usize, t: f64, x: &PhasePoint<N>) -> Option<ChartVector<N>>;

    /// The map of the piece of this index over a time; `None` beyond the last.
    fn over(&self, index: usize, tau: f64) -> Option<Self::Map>;

    /// The increment of a state by a map.
    fn change<T: Scalar>(&self, map: &Self::Map, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T>;
}

macro_rules! tuple {
    ($($Piece:ident $index:tt),+) => {
        impl<const N: usize, $($Piece: ContactPiece<N>),+> PieceList<N> for ($($Piece,)+) {
            /// All but one are `None`.
            type Map = ($(Option<$Piece::Map>,)+);

            fn count(&self) -> usize {
                [$($index),+].len()
            }
            fn sum<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> (T, f64) {
                let values = [$(self.$index.value(t, q, p, z)),+];
                values.into_iter().fold((T::zero(), 0.0), |(sum, size), value| (sum + value, size + value.re().abs()))
            }
            fn field(&self, index: usize, t: f64, x: &PhasePoint<N>) -> Option<ChartVector<N>> {
                $(if index == $index {
                    return Some(self.$index.contact_field(t, x));
                })+
                None
            }
            fn over(&self, index: usize, tau: f64) -> Option<Self::Map> {
                let map = ($((index == $index).then(|| self.$index.over(tau)),)+);
                (index < self.count()).then_some(map)
            }
            #[inline]
            fn change<T: Scalar>(&self, map: &Self::Map, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T> {
                $(if let Some(map) = &map.$index {
                    return self.$index.change(map, t, x);
                })+
                ContactIncrement::zero()
            }
        }
    };
}

tuple!(A 0);
tuple!(A 0, B 1);
tuple!(A 0, B 1, C 2);
tuple!(A 0, B 1, C 2, D 3);
tuple!(A 0, B 1, C 2, D 3, E 4);
tuple!(A 0, B 1, C 2, D 3, E 4, F 5);
tuple!(A 0, B 1, C 2, D 3, E 4, F 5, G 6);
tuple!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7);

impl<const N: usize, P: ContactPiece<N>> PieceList<N> for Vec<P> {
    /// The index of the piece, and its map.
    type Map = (usize, P::Map);

    fn count(&self) -> usize {
        self.len()
    }
    fn sum<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> (T, f64) {
        self.iter()
            .map(|piece| piece.value(t, q, p, z))
            .fold((T::zero(), 0.0), |(sum, size), value| (sum + value, size + value.re().abs()))
    }
    fn field(&self, index: usize, t: f64, x: &PhasePoint<N>) -> Option<ChartVector<N>> {
        self.get(index).map(|piece| piece.contact_field(t, x))
    }
    fn over(&self, index: usize, tau: f64) -> Option<Self::Map> {
        self.get(index).map(|piece| (index, piece.over(tau)))
    }
    #[inline]
    fn change<T: Scalar>(&self, (index, map): &Self::Map, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T> {
        self.get(*index).map_or_else(ContactIncrement::zero, |piece| piece.change(map, t, x))
    }
}

/// The contact Hamiltonian that is the sum of pieces.
///
/// ```
/// use contact_geom::{ContactHamiltonian, nalgebra::{SMatrix, SVector}};
/// use discrete_herglotz::hamiltonian::{AffineFlow, PieceSum, Prolonged, Quadratic};
/// let one = SMatrix::<f64, 1, 1>::identity();
/// let h = PieceSum((Quadratic::new(one, one * 0.0, one, -0.1), Prolonged(AffineFlow { qq: one, ..AffineFlow::ZERO })));
/// assert_eq!(h.value(0.0, &SVector::from([1.0]), &SVector::from([2.0]), 0.0), 4.5);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PieceSum<P>(pub P);

impl<P: PieceList<N>, const N: usize> ContactHamiltonian<N> for PieceSum<P> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.0.sum(t, q, p, z).0
    }
}
