//! The derivative of a drift with a drag of the velocity.

use super::coefficients::{CoefficientDerivatives, mean};
use super::exponential_integrals::{length, moment};
use super::kinetic::{Kinetic, rest_of};
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::gauss::tables::coefficients::Coefficients;
use crate::integration::SystemProblem;
use crate::splitting::drag::QUADRATURE_NODES;
use crate::{Components, ForceKind, InputError, State, Vector};
use contact_geom::nalgebra::{DMatrix, DVectorView, SVector};
use contact_geom::{Dual, Scalar};

/// The size of x below which functions of `ln(1 + x)` are computed by series.
const SMALL: f64 = 0.1;

/// The number of terms of these series; `SMALL` to this power is below round-off.
const TERMS: i32 = 18;

/// A number with its derivatives in `(|p|, b, rate, gamma, m, s)`; see [`RadialFlow`].
type Radial = Dual<f64, SVector<f64, 6>>;

/// The coefficients of a [`DragLaw`](crate::splitting::velocity_drag_flow::DragLaw), for a number of coordinates that is
/// known at run time.
pub(super) struct DragLaw {
    pub gamma: f64,
    pub mass: Vector,
    pub linear: Vector,
    pub quadratic: f64,
}

impl DragLaw {
    /// The law of a problem with a separable Lagrangian with a drag of the velocity.
    ///
    /// # Errors
    /// [`InputError::Forced`] for a mass matrix of another form.
    pub fn of(problem: &SystemProblem<'_>, kinetic: &Kinetic) -> Result<Self, InputError> {
        let (linear, quadratic) = match problem.system.force_kind() {
            ForceKind::Drag { linear, quadratic } => (linear, quadratic),
            _ => (Vector::zeros(problem.system.dimension()), 0.0),
        };
        let gamma = problem.system.gradient(problem.t0, &rest_of(problem)).z;
        let refused = InputError::Forced { method: "a splitting with a mass matrix that has other entries" };
        let mass = kinetic.diagonal_mass().ok_or(refused)?;
        if quadratic != 0.0 && mass.iter().any(|m| *m != mass[0]) {
            return Err(InputError::Forced { method: "a splitting with different masses beside a quadratic drag" });
        }
        Ok(DragLaw { gamma, mass, linear, quadratic })
    }

    /// Whether all masses are equal, and all linear drags.
    pub fn has_equal_coefficients(&self) -> bool {
        self.mass.iter().all(|m| *m == self.mass[0]) && self.linear.iter().all(|c| *c == self.linear[0])
    }
}

/// Applies the flow of a [`DragLaw`] over a time s to a state, with its derivatives.
pub(super) fn linearise(
    law: &DragLaw,
    s: f64,
    coefficients: Option<&[CoefficientDerivatives]>,
    state: &mut State,
) -> SubFlow {
    if law.quadratic == 0.0 { linear(law, s, coefficients, state) } else { quadratic(law, s, coefficients, state) }
}

/// `q_i += l(r_i) p_i / m_i`, `p_i = e^(r_i s) p_i` with `r_i = gamma - c_i / m_i`, and
/// `z = e^(gamma s) (z + sum_i p_i^2 l(2 r_i - gamma) / (2 m_i))`, where `l(r)` is the integral of `e^(r u)` over s.
fn linear(law: &DragLaw, s: f64, coefficients: Option<&[CoefficientDerivatives]>, state: &mut State) -> SubFlow {
    let DragLaw { gamma, mass, linear, .. } = law;
    let start = std::mem::take(state);
    let State { q, p, z } = &start;
    let n = q.len();
    let product = |a: &Vector, b: &Vector| Vector::from_fn(n, |i| a[i] * b[i]);
    let rate = Vector::from_fn(n, |i| gamma - linear[i] / mass[i]);
    let of_action = rate.map(|r| 2.0 * r - gamma);
    let growth = (gamma * s).exp();
    let decay = rate.map(|r| (r * s).exp());
    let shift = Vector::from_fn(n, |i| length(rate[i], s) / mass[i]);
    let lift = Vector::from_fn(n, |i| length(of_action[i], s) / (2.0 * mass[i]));
    let square = product(p, p);
    *state = State { q: q + product(&shift, p), p: product(&decay, p), z: growth * (z + lift.dot(&square)) };
    let state_map = TangentMatrix {
        qp: diagonal(&shift),
        pp: diagonal(&decay),
        zp: product(&lift, p) * (2.0 * growth),
        zz: growth,
        ..TangentMatrix::identity(n)
    };
    let mut sources = Vec::new();
    if let Some(coefficients) = coefficients {
        let end = &*state;
        let moved = |of: &CoefficientDerivatives, ds: f64| {
            let mass_change = of.mass.diagonal();
            let mut source = Components { z: (s * of.gamma + gamma * ds) * end.z, ..Components::zeros(n) };
            for i in 0..n {
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
                let radial = CoefficientDerivatives { quadratic: of.quadratic, ..CoefficientDerivatives::zero(n) };
                source = source.plus(&RadialFlow::new(law, s, p).source(law, &start, &radial, 0.0));
            }
            sources.push(source);
        }
        sources.push(Components::zeros(n));
        sources.push(moved(&CoefficientDerivatives::zero(n), 1.0));
    }
    SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
}

/// The matrix with this diagonal.
fn diagonal(of: &Vector) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVectorView::from_slice(of, of.len()))
}

fn quadratic(law: &DragLaw, s: f64, coefficients: Option<&[CoefficientDerivatives]>, state: &mut State) -> SubFlow {
    let start = std::mem::take(state);
    let State { q, p, z } = &start;
    let flow = RadialFlow::new(law, s, p);
    let (n, norm) = (q.len(), p.norm());
    let direction = if norm <= 0.0 { Vector::zeros(n) } else { p / norm };
    let radial = DMatrix::from_fn(n, n, |i, j| p[i] * direction[j]);
    let RadialFlow { shift, decay, lift, growth } = &flow;
    *state = State { q: q + p * shift.re, p: p * decay.re, z: growth.re * z + lift.re };
    let one = DMatrix::<f64>::identity(n, n);
    let state_map = TangentMatrix {
        qp: &one * shift.re + &radial * shift.d[0],
        pp: one * decay.re + radial * decay.d[0],
        zp: direction * lift.d[0],
        zz: growth.re,
        ..TangentMatrix::identity(n)
    };
    let mut sources = Vec::new();
    if let Some(coefficients) = coefficients {
        sources.extend(coefficients.iter().map(|of| flow.source(law, &start, of, 0.0)));
        sources.push(Components::zeros(n));
        sources.push(flow.source(law, &start, &CoefficientDerivatives::zero(n), 1.0));
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
    fn new(law: &DragLaw, s: f64, p: &Vector) -> Self {
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
    fn source(&self, law: &DragLaw, start: &State, of: &CoefficientDerivatives, ds: f64) -> Components {
        let (m, mass_change) = (law.mass[0], of.mass.trace() / start.q.len() as f64);
        let stretch = mass_change / m;
        let linear_change = mean(&of.linear);
        let direction = SVector::<f64, 6>::from([
            0.0,
            of.quadratic / (m * m) - 2.0 * law.quadratic / (m * m) * stretch,
            of.gamma - linear_change / m + law.linear[0] / m * stretch,
            of.gamma,
            mass_change,
            ds,
        ]);
        Components {
            x: &start.p * self.shift.d.dot(&direction),
            y: &start.p * self.decay.d.dot(&direction),
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
