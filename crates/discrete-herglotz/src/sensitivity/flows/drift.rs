//! The derivative of a drift with linear drag.

use super::coefficients::CoefficientDerivatives;
use super::exponential_integrals::{length, moment};
use super::kinetic::Kinetic;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::array::from_fn;
use crate::sensitivity::parametric_system::{Quantities, Quantity};
use crate::splitting::drag::QUADRATURE_NODES;
use crate::system::products::times;
use crate::{Components, Point, State, System, Vector};
use contact_geom::nalgebra::DMatrix;

/// The rate `gamma(t) = L_z` of a linear drag.
pub(super) enum Drag {
    /// A constant rate.
    Constant(f64),
    /// A rate that depends on time, evaluated at a point at rest at which L is defined.
    Timed(Point),
}

/// The drift over a time s from the time t, `q += l M^-1 p`, `p = e^g p`, `z = e^g (z + l p.M^-1 p / 2)`, where g is the
/// integral of the rate gamma, and l that of `e^g`.
pub(super) struct Drift<'f> {
    pub system: &'f dyn System,
    pub kinetic: &'f Kinetic,
    /// The rate; `None` for a drift without drag.
    pub drag: Option<&'f Drag>,
    pub t: f64,
    pub s: f64,
}

/// The integrals g and l, with their derivatives in each parameter, in the time of the start, and in the duration.
struct Integrals {
    g: f64,
    l: f64,
    derivatives: Vec<[f64; 2]>,
}

impl Drift<'_> {
    /// Applies the drift to a state, with its derivatives.
    pub fn linearise(
        &self,
        of: Option<(&mut (dyn Quantities + '_), &[CoefficientDerivatives])>,
        state: &mut State,
    ) -> SubFlow {
        let coefficients = of.as_ref().map_or(&[][..], |(_, coefficients)| *coefficients);
        let with_sources = of.is_some();
        let Integrals { g, l, derivatives } = self.integrals(of);
        let State { q, p, z } = std::mem::take(state);
        let (n, v) = (q.len(), self.kinetic.velocity(&p));
        let inverse = self.kinetic.inverse();
        let growth = g.exp();
        let half = 0.5 * p.dot(&v);
        let state_map = TangentMatrix {
            qp: &inverse * l,
            pp: DMatrix::from_diagonal_element(n, n, growth),
            zp: &v * (growth * l),
            zz: growth,
            ..TangentMatrix::identity(n)
        };
        *state = State { q: q + &v * l, p: &p * growth, z: growth * (z + l * half) };
        let mut sources = Vec::new();
        if with_sources {
            sources.reserve(derivatives.len());
            for (k, [dg, dl]) in derivatives.into_iter().enumerate() {
                // dv = -M^-1 dM v at a fixed p.
                let dv = coefficients.get(k);
                let dv = dv.map_or_else(|| Vector::zeros(n), |of| -times(&inverse, &times(&of.mass, &v)));
                sources.push(Components {
                    x: &v * dl + &dv * l,
                    y: &state.p * dg,
                    z: state.z * dg + growth * (dl * half + 0.5 * l * p.dot(&dv)),
                });
            }
        }
        SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
    }

    fn integrals(&self, of: Option<(&mut (dyn Quantities + '_), &[CoefficientDerivatives])>) -> Integrals {
        let s = self.s;
        let rest = match self.drag {
            Some(Drag::Timed(rest)) => rest,
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
        let table = Coefficients::of(QUADRATURE_NODES);
        let time = |j: usize| self.t + table.c[j].0 * s;
        let rates: [f64; QUADRATURE_NODES] = from_fn(|j| self.system.gradient(time(j), rest).z);
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
                let slopes = from_fn(|j| of.at(quantity, time(j), rest).gradient.z);
                derivatives.push(moved(&slopes));
            }
            let slopes: [f64; QUADRATURE_NODES] = from_fn(|j| of.at(Quantity::Time, time(j), rest).gradient.z);
            derivatives.push(moved(&slopes));
            // The rates at the nodes move with the duration, and the integrals are multiples of it.
            let [by_rates, by_factors] = moved(&from_fn(|j| table.c[j].0 * slopes[j]));
            let stretched: [f64; QUADRATURE_NODES] = from_fn(|i| factors[i] * part(&rates, i));
            derivatives.push([by_rates + whole(&rates), by_factors + whole(&factors) + s * whole(&stretched)]);
        }
        Integrals { g, l, derivatives }
    }
}
