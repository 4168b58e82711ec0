//! The derivative of a drift with a drag of the velocity.

use super::coefficients::CoefficientDerivatives;
use super::exponential_integrals::{length, moment};
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::gauss::tables::coefficients::Coefficients;
use crate::splitting::drag::QUADRATURE_NODES;
use crate::splitting::velocity_drag_flow::DragLaw;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, Dual, PhasePoint, Scalar};

/// The size of x below which functions of `ln(1 + x)` are computed by series.
const SMALL: f64 = 0.1;

/// The number of terms of these series; `SMALL` to this power is below round-off.
const TERMS: i32 = 18;

/// A number with its derivatives in `(|p|, b, rate, gamma, m, s)`; see [`RadialFlow`].
type Radial = Dual<f64, SVector<f64, 6>>;

/// Applies the flow of a [`DragLaw`] over a time s to a state, with its derivatives.
pub(super) fn linearise<const N: usize>(
    law: &DragLaw<N>,
    s: f64,
    coefficients: Option<&[CoefficientDerivatives<N>]>,
    state: &mut PhasePoint<N>,
) -> SubFlow<N> {
    if law.quadratic == 0.0 { linear(law, s, coefficients, state) } else { quadratic(law, s, coefficients, state) }
}

/// Whether all masses are equal, and all linear drags.
pub(super) fn has_equal_coefficients<const N: usize>(law: &DragLaw<N>) -> bool {
    law.mass.iter().all(|m| *m == law.mass[0]) && law.linear.iter().all(|c| *c == law.linear[0])
}

/// `q_i += l(r_i) p_i / m_i`, `p_i = e^(r_i s) p_i` with `r_i = gamma - c_i / m_i`, and
/// `z = e^(gamma s) (z + sum_i p_i^2 l(2 r_i - gamma) / (2 m_i))`, where `l(r)` is the integral of `e^(r u)` over s.
fn linear<const N: usize>(
    law: &DragLaw<N>,
    s: f64,
    coefficients: Option<&[CoefficientDerivatives<N>]>,
    state: &mut PhasePoint<N>,
) -> SubFlow<N> {
    let DragLaw { gamma, mass, linear, .. } = law;
    let PhasePoint { q, p, z } = *state;
    let rate = SVector::<f64, N>::from_fn(|i, _| gamma - linear[i] / mass[i]);
    let of_action = rate.map(|r| 2.0 * r - gamma);
    let growth = (gamma * s).exp();
    let decay = rate.map(|r| (r * s).exp());
    let shift = SVector::<f64, N>::from_fn(|i, _| length(rate[i], s) / mass[i]);
    let lift = SVector::<f64, N>::from_fn(|i, _| length(of_action[i], s) / (2.0 * mass[i]));
    let square = p.component_mul(&p);
    *state =
        PhasePoint { q: q + shift.component_mul(&p), p: decay.component_mul(&p), z: growth * (z + lift.dot(&square)) };
    let state_map = TangentMatrix {
        qp: SMatrix::from_diagonal(&shift),
        pp: SMatrix::from_diagonal(&decay),
        zp: lift.component_mul(&p) * (2.0 * growth),
        zz: growth,
        ..TangentMatrix::identity()
    };
    let mut sources = Vec::new();
    if let Some(coefficients) = coefficients {
        let end = *state;
        let moved = |of: &CoefficientDerivatives<N>, ds: f64| {
            let mass_change = of.mass.diagonal();
            let mut source =
                ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: (s * of.gamma + gamma * ds) * end.z };
            for i in 0..N {
                let m = mass[i];
                let stretch = mass_change[i] / m;
                let change = of.gamma - of.linear[i] / m + linear[i] / m * stretch;
                source.x[i] = p[i] * ((moment(rate[i], s) * change + decay[i] * ds) / m - shift[i] * stretch);
                source.y[i] = end.p[i] * (s * change + rate[i] * ds);
                let of_length = moment(of_action[i], s) * (2.0 * change - of.gamma) + (of_action[i] * s).exp() * ds;
                source.z += growth * square[i] * (of_length / (2.0 * m) - lift[i] * stretch);
            }
            source
        };
        for of in coefficients {
            let mut source = moved(of, 0.0);
            if of.quadratic != 0.0 {
                // The flow with a quadratic drag at the coefficient 0.
                let radial = CoefficientDerivatives { quadratic: of.quadratic, ..CoefficientDerivatives::zero() };
                let start = PhasePoint { q, p, z };
                source = source.plus(RadialFlow::new(law, s, &p).source(law, &start, &radial, 0.0));
            }
            sources.push(source);
        }
        sources.push(ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 });
        sources.push(moved(&CoefficientDerivatives::zero(), 1.0));
    }
    SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
}

fn quadratic<const N: usize>(
    law: &DragLaw<N>,
    s: f64,
    coefficients: Option<&[CoefficientDerivatives<N>]>,
    state: &mut PhasePoint<N>,
) -> SubFlow<N> {
    let start = *state;
    let PhasePoint { q, p, z } = start;
    let flow = RadialFlow::new(law, s, &p);
    let direction = p.try_normalize(0.0).unwrap_or_else(SVector::zeros);
    let radial = p * direction.transpose();
    let RadialFlow { shift, decay, lift, growth } = &flow;
    *state = PhasePoint { q: q + p * shift.re, p: p * decay.re, z: growth.re * z + lift.re };
    let one = SMatrix::<f64, N, N>::identity();
    let state_map = TangentMatrix {
        qp: one * shift.re + radial * shift.d[0],
        pp: one * decay.re + radial * decay.d[0],
        zp: direction * lift.d[0],
        zz: growth.re,
        ..TangentMatrix::identity()
    };
    let mut sources = Vec::new();
    if let Some(coefficients) = coefficients {
        sources.extend(coefficients.iter().map(|of| flow.source(law, &start, of, 0.0)));
        sources.push(ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 });
        sources.push(flow.source(law, &start, &CoefficientDerivatives::zero(), 1.0));
    }
    SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
}

/// The flow with a quadratic drag, `q += shift p`, `p = decay p`, `z = e^(gamma s) z + lift`: with `b = k / m^2`,
/// `rate = gamma - c/m`, the integral d of `e^(rate u)` over s, and `x = b |p| d`,
/// `shift = d/m ln(1 + x)/x`, `decay = e^(rate s) / (1 + x)`, and lift a quadrature of the squares of the momentum.
struct RadialFlow {
    shift: Radial,
    decay: Radial,
    lift: Radial,
    /// `e^(gamma s)`.
    growth: Radial,
}

impl RadialFlow {
    fn new<const N: usize>(law: &DragLaw<N>, s: f64, p: &SVector<f64, N>) -> Self {
        let variable =
            |re: f64, index: usize| Radial { re, d: SVector::from_fn(|i, _| f64::from(u8::from(i == index))) };
        let m = law.mass[0];
        let size = variable(p.norm(), 0);
        let b = variable(law.quadratic / (m * m), 1);
        let rate = variable(law.gamma - law.linear[0] / m, 2);
        let (gamma, mass, s) = (variable(law.gamma, 3), variable(m, 4), variable(s, 5));
        let length_of = |s: Radial| Radial {
            re: length(rate.re, s.re),
            d: rate.d * moment(rate.re, s.re) + s.d * (rate.re * s.re).exp(),
        };
        let d = length_of(s);
        let x = b * size * d;
        let below = if 1.0 + x.re > 0.0 { x + 1.0 } else { Radial::from(f64::NAN) };
        let (mean, slope) = mean_logarithm(x.re);
        let mean = Radial { re: mean, d: x.d * slope };
        let table = Coefficients::of(QUADRATURE_NODES);
        let mut lift = Radial::from(0.0);
        for j in 0..QUADRATURE_NODES {
            let (place, weight) = (table.c[j].0, table.b[j].0);
            let at = s * place;
            let momentum = size * (rate * at).exp() / (b * size * length_of(at) + 1.0);
            lift += momentum * momentum * (gamma * s * (1.0 - place)).exp() * s / mass * (0.5 * weight);
        }
        RadialFlow { shift: d / mass * mean, decay: (rate * s).exp() / below, lift, growth: (gamma * s).exp() }
    }

    /// The derivative of the end of the flow along changes of the coefficients and of the duration.
    fn source<const N: usize>(
        &self,
        law: &DragLaw<N>,
        start: &PhasePoint<N>,
        of: &CoefficientDerivatives<N>,
        ds: f64,
    ) -> ChartVector<N> {
        let (m, mass_change) = (law.mass[0], of.mass.trace() / N as f64);
        let stretch = mass_change / m;
        let linear_change = of.linear.mean();
        let direction = SVector::<f64, 6>::from([
            0.0,
            of.quadratic / (m * m) - 2.0 * law.quadratic / (m * m) * stretch,
            of.gamma - linear_change / m + law.linear[0] / m * stretch,
            of.gamma,
            mass_change,
            ds,
        ]);
        ChartVector {
            x: start.p * self.shift.d.dot(&direction),
            y: start.p * self.decay.d.dot(&direction),
            z: start.z * self.growth.d.dot(&direction) + self.lift.d.dot(&direction),
        }
    }
}

/// `ln(1 + x)/x` and its derivative.
fn mean_logarithm(x: f64) -> (f64, f64) {
    if x.abs() < SMALL {
        let term = |k: i32| (-x).powi(k) / f64::from(k + 1);
        let slope = |k: i32| -f64::from(k) * (-x).powi(k - 1) / f64::from(k + 1);
        return ((0..TERMS).map(term).sum(), (1..TERMS).map(slope).sum());
    }
    let mean = x.ln_1p() / x;
    (mean, (1.0 / (1.0 + x) - mean) / x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The series and the closed form agree where they meet.
    #[test]
    fn the_mean_logarithm() {
        for x in [SMALL, -SMALL] {
            let [(below, below_slope), (above, above_slope)] =
                [1.0 - 1e-13, 1.0 + 1e-13].map(|f| mean_logarithm(x * f));
            assert!((below - above).abs() <= 1e-13, "{below} and {above}");
            assert!((below_slope - above_slope).abs() <= 1e-12, "{below_slope} and {above_slope}");
        }
    }
}
