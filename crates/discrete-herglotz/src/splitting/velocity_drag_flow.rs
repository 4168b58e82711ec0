//! The flow of the kinetic part with a drag of the velocity.

use super::drag::QUADRATURE_NODES;
use super::separable::SeparableForm;
use crate::InputError;
use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::array::from_fn;
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, ForceStructure, Lagrangian, VelocityPoint};

/// The kinetic part of a Lagrangian with its drag: `p_i' = (gamma - c_i/m_i) p_i - k/m^2 |p| p_i`, `q_i' = p_i/m_i`,
/// `z' = gamma z + sum_i p_i^2/(2 m_i)`. Where k is not 0, the masses are equal and so are the `c_i`.
pub(crate) struct DragLaw<const N: usize> {
    pub gamma: f64,
    pub mass: SVector<f64, N>,
    pub linear: SVector<f64, N>,
    pub quadratic: f64,
}

/// The flow of a [`DragLaw`] over a time s.
#[derive(Clone, Debug)]
pub(crate) enum DragFlow<const N: usize> {
    /// Without a quadratic drag.
    Linear {
        /// `e^(gamma s) - 1`.
        growth: f64,
        /// The integral of `e^((gamma - c/m) s)`, divided by m.
        shift: SVector<f64, N>,
        /// `e^((gamma - c/m) s) - 1`.
        damping: SVector<f64, N>,
        /// The coefficients of `p_i^2` in the action.
        lift: SVector<f64, N>,
    },
    /// With a quadratic drag.
    Quadratic {
        /// `e^(gamma s) - 1`.
        growth: f64,
        /// The mass m and `b = k/m^2`.
        of: [f64; 2],
        /// `e^(-a s) - 1` and `d(s) = (1 - e^(-a s))/a` with `a = c/m - gamma`.
        end: [f64; 2],
        /// The weight of `|p|^2` in the action at the nodes of the quadrature, with `e^(-a s)` and `d(s)` there.
        nodes: [[f64; 3]; QUADRATURE_NODES],
    },
}

/// The integral of `e^(rate s)` from 0 to s.
fn length(rate: f64, s: f64) -> f64 {
    if rate == 0.0 { s } else { (rate * s).exp_m1() / rate }
}

impl<const N: usize> DragLaw<N> {
    /// The law of a separable Lagrangian with a drag of the velocity, at a time and a point at rest.
    ///
    /// # Errors
    /// [`InputError::Forced`] for a mass matrix of another form.
    pub fn of<L: Lagrangian<N>>(
        form: &SeparableForm<&L, N>,
        t: f64,
        rest: &VelocityPoint<N>,
    ) -> Result<Self, InputError> {
        let (linear, quadratic) = match form.lagrangian.force_structure() {
            ForceStructure::Drag { linear, quadratic } => (linear, quadratic),
            _ => (SVector::zeros(), 0.0),
        };
        let gamma = form.lagrangian.rate(t, rest);
        let refused = InputError::Forced { method: "a splitting with a mass matrix that has other entries" };
        let mass = form.diagonal_mass().ok_or(refused)?;
        if quadratic != 0.0 && mass.iter().any(|m| *m != mass[0]) {
            return Err(InputError::Forced { method: "a splitting with different masses beside a quadratic drag" });
        }
        Ok(DragLaw { gamma, mass, linear, quadratic })
    }

    /// The flow over a time s of either sign.
    pub fn over(&self, s: f64) -> DragFlow<N> {
        let DragLaw { gamma, mass, linear, quadratic } = self;
        let growth = (gamma * s).exp_m1();
        let rate = |i: usize| gamma - linear[i] / mass[i];
        if *quadratic == 0.0 {
            return DragFlow::Linear {
                growth,
                shift: SVector::from_fn(|i, _| length(rate(i), s) / mass[i]),
                damping: SVector::from_fn(|i, _| (rate(i) * s).exp_m1()),
                // e^(gamma s) times the integral of e^((2 rate - gamma) s) / (2 m).
                lift: SVector::from_fn(|i, _| (0.5 * (1.0 + growth) / mass[i]) * length(2.0 * rate(i) - gamma, s)),
            };
        }
        let (m, rate, g) = (mass[0], rate(0), Coefficients::of(QUADRATURE_NODES));
        let at = |s: f64| [(rate * s).exp_m1(), length(rate, s)];
        let nodes = from_fn(|j| {
            let [decay, d] = at(g.c[j].0 * s);
            [0.5 * s * g.b[j].0 * (gamma * (1.0 - g.c[j].0) * s).exp() / m, 1.0 + decay, d]
        });
        DragFlow::Quadratic { growth, of: [m, quadratic / (m * m)], end: at(s), nodes }
    }
}

impl<const N: usize> DragFlow<N> {
    /// `e^(gamma s) - 1`.
    #[inline(always)]
    pub fn growth(&self) -> f64 {
        let (DragFlow::Linear { growth, .. } | DragFlow::Quadratic { growth, .. }) = self;
        *growth
    }

    /// The integral that the momentum adds to the action.
    #[inline(always)]
    pub fn lift(&self, p: &SVector<f64, N>) -> f64 {
        match self {
            DragFlow::Linear { lift, .. } => (0..N).map(|i| lift[i] * p[i] * p[i]).sum(),
            DragFlow::Quadratic { of: [_, b], nodes, .. } => {
                let size = p.norm();
                let square = |[weight, decay, d]: &[f64; 3]| {
                    let momentum = size * decay / (1.0 + b * size * d);
                    weight * momentum * momentum
                };
                nodes.iter().map(square).sum()
            }
        }
    }

    /// The changes of position and momentum; NaN where the flow, backward in time, does not exist up to this time.
    #[inline(always)]
    pub fn changes(&self, p: &SVector<f64, N>) -> [SVector<f64, N>; 2] {
        match self {
            DragFlow::Linear { shift, damping, .. } => [shift.component_mul(p), damping.component_mul(p)],
            DragFlow::Quadratic { of: [m, b], end: [decay, d], .. } => {
                let x = b * p.norm() * d;
                let below = if 1.0 + x > 0.0 { 1.0 + x } else { f64::NAN };
                // ln(1 + x)/x, which is 1 at 0.
                let mean = if x == 0.0 { 1.0 } else { x.ln_1p() / x };
                [p * (mean * d / m), p * ((decay - x) / below)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::numbers::max_or_nan;

    /// The flow over a time is that over its parts, forward and backward, to a few units of round-off; the action with a
    /// quadratic drag to the error of its quadrature.
    #[test]
    fn it_is_a_flow() {
        let p = SVector::from([0.8, -1.7]);
        for (gamma, linear, quadratic) in [(-0.3, [0.4, 1.1], 0.0), (0.0, [0.0; 2], 0.5), (-0.3, [0.7; 2], 0.9)] {
            let mass = SVector::from(if quadratic == 0.0 { [2.0, 0.5] } else { [1.5; 2] });
            let law = DragLaw { gamma, mass, linear: SVector::from(linear), quadratic };
            let step = |(q, p, z): (SVector<f64, 2>, SVector<f64, 2>, f64), s: f64| {
                let flow = law.over(s);
                let [dq, dp] = flow.changes(&p);
                (q + dq, p + dp, z + flow.growth() * z + flow.lift(&p))
            };
            let start = (SVector::zeros(), p, 0.4);
            let whole = step(start, 0.5);
            let kinetic: f64 = (0..2).map(|i| 0.5 * p[i] * p[i] / mass[i]).sum();
            // The error of six nodes over a time s is s^13 (6!)^4 / (13 (12!)^3) times a derivative of order 12 of the
            // kinetic energy, which is at most 13!/pole^12 times its value, since it is infinite at the time -pole.
            let (a, b) = (linear[0] / mass[0] - gamma, quadratic * p.norm() / (mass[0] * mass[0]));
            let pole = if a == 0.0 { 1.0 / b } else { (1.0 + a / b).ln() / a };
            let of_quadrature = if quadratic == 0.0 { 0.0 } else { 1.2e-6 * kinetic * 0.7 * (0.7 / pole).powi(12) };
            for parts in [step(step(start, 0.2), 0.3), step(step(start, 0.7), -0.2)] {
                let off = max_or_nan((whole.0 - parts.0).norm(), (whole.1 - parts.1).norm());
                assert!(off <= 8.0 * f64::EPSILON, "{gamma} {quadratic}: {off:e}");
                let bound = of_quadrature + 32.0 * f64::EPSILON;
                assert!((whole.2 - parts.2).abs() <= bound, "{gamma} {quadratic}: {:e}", whole.2 - parts.2);
            }
            let s = 1e-4;
            let (ahead, back) = (step(start, s), step(start, -s));
            let rate =
                |i: usize| gamma * p[i] - (linear[i] / mass[i] + quadratic * p.norm() / (mass[i] * mass[i])) * p[i];
            for i in 0..2 {
                assert!(((ahead.0 - back.0)[i] / (2.0 * s) - p[i] / mass[i]).abs() <= 1e-7);
                assert!(((ahead.1 - back.1)[i] / (2.0 * s) - rate(i)).abs() <= 1e-7);
            }
            // The central difference is off by s^2/6 of the third derivative, which is about the kinetic energy times the
            // square of its largest rate of decay.
            let decay = (0..2).fold(0.0, |m, i| max_or_nan(m, -2.0 * rate(i) / p[i]));
            let bound = s * s * decay * decay * kinetic;
            assert!(((ahead.2 - back.2) / (2.0 * s) - (gamma * 0.4 + kinetic)).abs() <= bound);
        }
    }
}
