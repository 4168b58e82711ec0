//! Statements on symmetries and their momenta.

use crate::DiscreteLagrangian;
use crate::statements::measures::jets;
use crate::theory::{discrete_flow, discrete_momentum};
use contact_geom::{
    ChartVector, ContactForm, DiscretePoint, EtaMinus, EtaPlus, GeometryError, OneParameterGroup, Scalar, Smooth,
    Symmetry, conformality,
    numbers::{MaxAbsOrNan, MaxOrNan},
};

/// The lift of a group element to Q x Q x R.
struct Diagonal<'a, const N: usize>(&'a Symmetry<N>);

impl<const N: usize> Smooth<N> for Diagonal<'_, N> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        Ok(self.0.on_discrete(T::from(0.6), x))
    }
}

/// Statement 26: the lifted action preserves eta+ and eta-, and `J_d o Phi_d = sigma_d J_d`.
pub(super) fn momentum_is_dissipated<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    group: &Symmetry<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let point = (*x).into();
    let (minus, plus) = (EtaMinus(jets(ld, t)), EtaPlus(jets(ld, t)));
    let (on_minus, on_plus) = (
        conformality(&minus, &minus, &Diagonal(group), &point)?,
        conformality(&plus, &plus, &Diagonal(group), &point)?,
    );
    let contact = on_minus
        .defect
        .max_or_nan(on_plus.defect)
        .max_or_nan((on_minus.sigma - 1.0).abs())
        .max_or_nan((on_plus.sigma - 1.0).abs());
    let h = ld.step_size();
    let image = discrete_flow(ld, t, x)?;
    let (before, after) = (discrete_momentum(ld, group, t, x)?, discrete_momentum(ld, group, t + h, &image)?);
    // p1 is computed from rounded positions: its error is W/h times their round-off, and J_d multiplies it by the
    // generator.
    let xi = group.generator(&image.q0).max_abs_or_nan();
    let size =
        before.abs().max_or_nan(xi * ld.second_jet(t + h, &image)?.d12.max_abs_or_nan() * image.q1.max_abs_or_nan());
    let sign = (before + minus.eta(&point)?.x.dot(&group.generator(&x.q0))).abs() / size;
    Ok(contact.max_or_nan(sign).max_or_nan((after - ld.jet(t, x)?.sigma() * before).abs() / size))
}
