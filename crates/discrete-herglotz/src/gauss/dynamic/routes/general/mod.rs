use crate::gauss::dynamic::system::Typed;
use contact_geom::Lagrangian;

/// To be written.
pub(crate) trait GeneralKernel {}

impl<L: Lagrangian<N>, const N: usize> GeneralKernel for Typed<'_, L, N> {}
