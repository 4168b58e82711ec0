//! The Legendrian graphs of exact flows.

use super::Sample;
use crate::ExactError;
use contact_geom::{ChartVector, Dual, Lagrangian, legendre, legendrian_defect, support::seed};

/// Statement 48: the graph of `phi_h` on T\*Q x R at `r = ln sigma_h` is Legendrian, with the coordinates of TQ x R as
/// parameters of the graph. The derivatives are those of the flow on dual numbers.
pub(super) fn graph<S: Lagrangian<N>, const N: usize>(at: &Sample<'_, S, N>) -> Result<f64, ExactError<N>> {
    let motion = at.exponential.varied(at.t, at.x)?;
    let time = |t: f64| Dual::<f64, ChartVector<N>>::constant(t);
    let x0 = legendre(at.system, time(at.t), &seed(&ChartVector::from(*at.x)).into());
    let x1 = legendre(at.system, time(at.t + at.h), &motion.end);
    Ok(legendrian_defect(&x0, &x1, motion.b).largest() / at.growth()?)
}
