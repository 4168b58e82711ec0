use crate::gauss::dynamic::system::Typed;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::Stages;
use contact_geom::Lagrangian;

/// To be written.
pub(crate) trait SeparableKernel {
    /// To be written.
    fn stage_values(&self, arch: Instructions, s: usize, t: f64, times: &Stages, x: &[Stages], v: &[Stages]) -> Stages;
}

impl<L: Lagrangian<N>, const N: usize> SeparableKernel for Typed<'_, L, N> {
    fn stage_values(&self, _: Instructions, _: usize, _: f64, _: &Stages, _: &[Stages], _: &[Stages]) -> Stages {
        Stages::ZERO
    }
}
