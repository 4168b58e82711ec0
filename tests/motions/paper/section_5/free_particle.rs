//! Statement 37 (section 5, corrected): the free particle's discrete equations, its explicit q2, and its exact discrete
//! Lagrangian.

use crate::common::{on_random, within};
use contact_examples::systems::FreeParticle;
use contact_geom::{DiscretePoint, Scalar, VelocityPoint, numbers::MaxOrNan};
use discrete_herglotz::{
    DiscreteLagrangian, StepError,
    rules::Rule,
    theory::{discrete_flow, legendre_minus},
};
use exact_lagrangian::QuadraticExact;

/// The formula that the paper prints for the exact discrete Lagrangian, with the term `- z0 (e^(gamma h) - 1)` of the
/// wrong sign.
pub struct Printed {
    pub gamma: f64,
    pub h: f64,
}

impl DiscreteLagrangian<1> for Printed {
    fn step_size(&self) -> f64 {
        self.h
    }
    fn value<T: Scalar>(&self, _t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
        let (d, growth) = (x.q1[0] - x.q0[0], (self.gamma * self.h).exp_m1());
        Ok(d * d * (self.gamma * (growth + 1.0) / (2.0 * growth)) - x.z0 * growth)
    }
}

fn random(name: &str, check: impl Fn(f64, f64, &DiscretePoint<1>) -> f64) {
    on_random(name, 5, |u| {
        let x = DiscretePoint::new([4.0 * u[0] - 2.0], [4.0 * u[1] - 2.0], u[2] - 0.5);
        let (gamma, h) = (-1.0 + 1.5 * u[3], 0.05 + 0.5 * u[4]);
        let residual = check(if gamma == 0.0 { -0.1 } else { gamma }, h, &x);
        within(residual)
    });
}

/// `q2 = (h gamma + 2) q1 - (h gamma + 1) q0`, `z1 = (q1 - q0)^2/(2h) + (h gamma + 1) z0`; the rectangle and the
/// midpoint rule are the same for this L.
#[test]
fn explicit_step() {
    random("free particle", |gamma, h, x| {
        let system = FreeParticle { gamma };
        let (q0, q1) = (x.q0[0], x.q1[0]);
        let q2 = (h * gamma + 2.0) * q1 - (h * gamma + 1.0) * q0;
        let z1 = (q1 - q0).powi(2) / (2.0 * h) + (h * gamma + 1.0) * x.z0;
        let of = |next: Result<DiscretePoint<1>, StepError>| {
            next.map_or(f64::NAN, |n| (n.q1[0] - q2).abs().max_or_nan((n.z0 - z1).abs()) / (1.0 + q2.abs() + z1.abs()))
        };
        let rectangle = Rule::RECTANGLE.of(system, h).map_or(f64::NAN, |ld| of(discrete_flow(&ld, 0.0, x)));
        let midpoint = Rule::LEFT_MIDPOINT.of(system, h).map_or(f64::NAN, |ld| of(discrete_flow(&ld, 0.0, x)));
        if rectangle.is_nan() || midpoint.is_nan() { f64::NAN } else { rectangle.max_or_nan(midpoint) }
    });
}

/// The corrected exact discrete Lagrangian has the paper's closed form, its steps are on the true motion, and `D_z L^e
/// = e^(gamma h) - 1`.
#[test]
fn exact_discrete_lagrangian() {
    random("exact free particle", |gamma, h, x| {
        let system = FreeParticle { gamma };
        let (Ok(ld), Some(v0)) = (QuadraticExact::new(&system, h), system.velocity_through(x.q0[0], x.q1[0], h)) else {
            return f64::NAN;
        };
        let at = |t| system.solution(t, &VelocityPoint::new(x.q0, [v0], x.z0));
        let (Ok(next), Ok(jet)) = (discrete_flow(&ld, 0.0, x), ld.jet(0.0, x)) else { return f64::NAN };
        let growth = (gamma * h).exp_m1();
        let closed = gamma * (x.q1[0] - x.q0[0]).powi(2) * (growth + 1.0) / (2.0 * growth) + x.z0 * growth;
        let size = 1.0 + at(2.0 * h).q[0].abs() + at(h).z.abs() + closed.abs();
        let flow = (next.q1[0] - at(2.0 * h).q[0]).abs().max_or_nan((next.z0 - at(h).z).abs()) / size;
        flow.max_or_nan((jet.dz - growth).abs()).max_or_nan((jet.value - closed).abs() / size)
    });
}

/// The printed formula, with the wrong sign of z0, violates the theorem F-L^e = FL o R^- by the factor by which its
/// sigma_d is wrong.
#[test]
fn the_printed_one_is_wrong() {
    let (gamma, h) = (-0.05f64, 0.5);
    let ld = Printed { gamma, h };
    let system = FreeParticle { gamma };
    let p0 = legendre_minus(&ld, 0.0, &DiscretePoint::new([0.0], [1.0], 0.0)).map(|s| s.p[0]);
    let v0 = system.velocity_through(0.0, 1.0, h);
    let factor = (gamma * h).exp() / (2.0 - (gamma * h).exp());
    let ok = matches!((p0, v0), (Ok(p0), Some(v0)) if (p0 - factor * v0).abs() < 1e-14);
    assert!(ok, "{p0:?} {v0:?} {factor}");
}
