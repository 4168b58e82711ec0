use crate::gauss::dynamic::system::Typed;
use contact_geom::Lagrangian;

/// To be written.
pub(crate) trait SeparableKernel {}

impl<L: Lagrangian<N>, const N: usize> SeparableKernel for Typed<'_, L, N> {}
