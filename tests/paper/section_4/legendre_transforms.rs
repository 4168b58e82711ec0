//! Statement 35 (section 4.2, theorem): `F(+-)L_h^e = FL o R_h^(e+-)`, the left-hand sides by duals through flow and shooting.

use crate::common::over_motions;
use contact_geom::systems::FreeParticle;
use contact_geom::{DiscretePoint, Scalar, Statement};
use discrete_herglotz::{DiscreteLagrangian, StepError, legendre_minus, legendre_plus};
use exact_lagrangian::ExactLagrangian;

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(Statement::ExactLegendreTransforms);
}

/// The formula that the paper prints for the free particle, with `- z0 (e^(gamma h) - 1)`.
struct Printed {
    gamma: f64,
    h: f64,
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

/// It violates the theorem by the amount that it does: F- by the factor `sigma/(2 - sigma)`, F+ in z by `-2 z0 (sigma - 1)`; the
/// exact one computed from the motion does not.
#[test]
fn the_printed_formula_violates_it() {
    let (gamma, h) = (-0.3f64, 0.5);
    let (system, x) = (FreeParticle { gamma }, DiscretePoint::new([0.2], [1.0], 0.7));
    let exact = ExactLagrangian::<_, 1>::new(system, h).unwrap();
    let motion = exact.retract(0.0, &x).unwrap();
    let at = |ld: &dyn Fn() -> [Result<f64, StepError>; 3]| ld().map(|r| r.unwrap_or(f64::NAN));
    let printed = Printed { gamma, h };
    let [p0, p1, z1] = at(&|| {
        let plus = legendre_plus(&printed, 0.0, &x);
        [legendre_minus(&printed, 0.0, &x).map(|s| s.p[0]), plus.map(|s| s.p[0]), plus.map(|s| s.z)]
    });
    let sigma = (gamma * h).exp();
    let tolerance = 32.0 * f64::EPSILON;
    assert!((p0 - motion.start.v[0] * sigma / (2.0 - sigma)).abs() < tolerance);
    assert!((p1 - motion.end.v[0]).abs() < tolerance);
    assert!((z1 - motion.end.z + 2.0 * x.z0 * (sigma - 1.0)).abs() < tolerance);
    assert!((p0 - motion.start.v[0]).abs() > 0.3 && (z1 - motion.end.z).abs() > 0.1);
    let [p0, p1, z1] = at(&|| {
        let plus = legendre_plus(&exact, 0.0, &x);
        [legendre_minus(&exact, 0.0, &x).map(|s| s.p[0]), plus.map(|s| s.p[0]), plus.map(|s| s.z)]
    });
    assert!((p0 - motion.start.v[0]).abs() < tolerance && (p1 - motion.end.v[0]).abs() < tolerance);
    assert!((z1 - motion.end.z).abs() < tolerance);
}
