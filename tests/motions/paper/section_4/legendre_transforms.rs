//! Statement 35 (section 4.2, theorem): `F(+-)L_h^e = FL o R_h^(e+-)` fails for the formula that the paper prints.

use crate::paper::section_5::free_particle::Printed;
use contact_examples::systems::{FreeParticle, OneCoordinate};
use contact_geom::DiscretePoint;
use discrete_herglotz::{
    StepError,
    theory::{legendre_minus, legendre_plus},
};
use exact_lagrangian::ExactLagrangian;

/// The printed formula violates the theorem: F- is wrong by the factor `sigma/(2 - sigma)`, F+ in z by `-2 z0 (sigma -
/// 1)`. The exact discrete Lagrangian that is computed from the motion satisfies it.
#[test]
fn the_printed_formula_violates_it() {
    let (gamma, h) = (-0.3f64, 0.5);
    let (system, x) = (OneCoordinate::from(FreeParticle { gamma }), DiscretePoint::new([0.2], [1.0], 0.7));
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
