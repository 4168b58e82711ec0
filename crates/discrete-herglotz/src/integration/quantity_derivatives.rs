//! The derivatives of a Lagrangian and of its force with respect to a parameter or the time.

use contact_geom::ChartVector;
use contact_geom::nalgebra::SVector;

/// The derivatives of L, of its gradient, and of the force with respect to a quantity: `L_theta`,
/// `(L_qtheta, L_vtheta, L_ztheta)`, `f_theta`.
pub(crate) struct QuantityDerivatives<const N: usize> {
    pub l: f64,
    pub gradient: ChartVector<N>,
    pub force: SVector<f64, N>,
}
