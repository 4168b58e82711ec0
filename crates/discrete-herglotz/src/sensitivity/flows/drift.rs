//! The derivative of a drift with linear drag.

use super::coefficients::CoefficientDerivatives;
use super::exponential_integrals::{length, moment};
use super::sources::Sources;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::array::from_fn;
use crate::sensitivity::parametric_system::Quantity;
use crate::splitting::drag::{Drag, QUADRATURE_NODES};
use crate::splitting::separable::SeparableForm;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, Derivatives, Parametric, PhasePoint, VelocityPoint};

/// The drift over a time s from the time t, `q += l M^-1 p`, `p = e^g p`, `z = e^g (z + l p.M^-1 p / 2)`, where g is the
/// integral of the rate gamma, and l that of `e^g`.
pub(super) struct Drift<'f, L, const N: usize> {
    pub form: &'f SeparableForm<&'f L, N>,
    /// The rate; `None` for a drift without drag.
    pub drag: Option<&'f Drag<N>>,
    pub t: f64,
    pub s: f64,
}

/// The integrals g and l, with their derivatives in each parameter, in the time of the start, and in the duration.
struct Integrals {
    g: f64,
    l: f64,
    derivatives: Vec<[f64; 2]>,
}

impl<L: Parametric<N>, const N: usize> Drift<'_, L, N> {
    /// Applies the drift to a state, with its derivatives.
    pub fn linearise(
        &self,
        of: Option<(&mut Sources<'_>, &[CoefficientDerivatives<N>])>,
        state: &mut PhasePoint<N>,
    ) -> SubFlow<N> {
        let coefficients = of.as_ref().map_or(&[][..], |(_, coefficients)| *coefficients);
        let with_sources = of.is_some();
        let Integrals { g, l, derivatives } = self.integrals(of);
        let PhasePoint { q, p, z } = *state;
        let v = self.form.velocity(&p);
        let inverse = self.form.inverse.as_ref().map_or_else(SMatrix::identity, |inverse| **inverse);
        let growth = g.exp();
        let half = 0.5 * p.dot(&v);
        let state_map = TangentMatrix {
            qp: inverse * l,
            pp: SMatrix::identity() * growth,
            zp: v * (growth * l),
            zz: growth,
            ..TangentMatrix::identity()
        };
        *state = PhasePoint { q: q + v * l, p: p * growth, z: growth * (z + l * half) };
        let mut sources = Vec::new();
        if with_sources {
            sources.reserve(derivatives.len());
            for (k, [dg, dl]) in derivatives.into_iter().enumerate() {
                // dv = -M^-1 dM v at a fixed p.
                let dv = coefficients.get(k).map_or_else(SVector::zeros, |of| -(inverse * (of.mass * v)));
                sources.push(ChartVector {
                    x: v * dl + dv * l,
                    y: state.p * dg,
                    z: state.z * dg + growth * (dl * half + 0.5 * l * p.dot(&dv)),
                });
            }
        }
        SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
    }

    fn integrals(&self, of: Option<(&mut Sources<'_>, &[CoefficientDerivatives<N>])>) -> Integrals {
        let s = self.s;
        let (q, z) = match self.drag {
            Some(Drag::Timed { q, z }) => (*q, *z),
            constant => {
                let gamma = if let Some(Drag::Constant(gamma)) = constant { *gamma } else { 0.0 };
                let mut derivatives = Vec::new();
                if let Some((_, coefficients)) = of {
                    let lasts = moment(gamma, s);
                    let drags = constant.is_some();
                    derivatives.extend(
                        coefficients.iter().map(|of| if drags { [s * of.gamma, lasts * of.gamma] } else { [0.0; 2] }),
                    );
                    derivatives.extend([[0.0; 2], [gamma, (gamma * s).exp()]]);
                }
                return Integrals { g: gamma * s, l: length(gamma, s), derivatives };
            }
        };
        let lagrangian = self.form.lagrangian;
        let rest = VelocityPoint { q, v: SVector::zeros(), z };
        let table = Coefficients::of(QUADRATURE_NODES);
        let time = |j: usize| self.t + table.c[j].0 * s;
        let rates: [f64; QUADRATURE_NODES] = from_fn(|j| lagrangian.rate(time(j), &rest));
        // The integral of a function with these values, and those from the start to each node.
        let whole = |x: &[f64; QUADRATURE_NODES]| (0..QUADRATURE_NODES).map(|i| table.b[i].0 * x[i]).sum::<f64>();
        let part =
            |x: &[f64; QUADRATURE_NODES], i: usize| (0..QUADRATURE_NODES).map(|j| table.a[i][j].0 * x[j]).sum::<f64>();
        let factors: [f64; QUADRATURE_NODES] = from_fn(|i| (s * part(&rates, i)).exp());
        let (g, l) = (s * whole(&rates), s * whole(&factors));
        let mut derivatives = Vec::new();
        if let Some((of, _)) = of {
            let moved = |slopes: &[f64; QUADRATURE_NODES]| {
                let changes: [f64; QUADRATURE_NODES] = from_fn(|i| factors[i] * s * part(slopes, i));
                [s * whole(slopes), s * whole(&changes)]
            };
            for quantity in (0..of.count()).map(Quantity::Parameter) {
                let slopes = from_fn(|j| of.at(quantity, time(j), &rest).gradient.z);
                derivatives.push(moved(&slopes));
            }
            let slopes: [f64; QUADRATURE_NODES] = from_fn(|j| of.at(Quantity::Time, time(j), &rest).gradient.z);
            derivatives.push(moved(&slopes));
            // The rates at the nodes move with the duration, and the integrals are multiples of it.
            let [by_rates, by_factors] = moved(&from_fn(|j| table.c[j].0 * slopes[j]));
            let stretched: [f64; QUADRATURE_NODES] = from_fn(|i| factors[i] * part(&rates, i));
            derivatives.push([by_rates + whole(&rates), by_factors + whole(&factors) + s * whole(&stretched)]);
        }
        Integrals { g, l, derivatives }
    }
}
