use crate::gauss::dynamic::system::Typed;
use contact_geom::Lagrangian;

/// To be written.
pub(crate) trait HamiltonianKernel {}

impl<L: Lagrangian<N>, const N: usize> HamiltonianKernel for Typed<'_, L, N> {}
