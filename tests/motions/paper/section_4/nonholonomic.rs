//! Statements 28 and 31 (section 4.1): the non-holonomic flow off the constraint, and the projection of its exponential
//! map at a conjugate point.

use contact_examples::systems::{CoupledInZ, HarmonicOscillator, OneCoordinate};
use contact_geom::VelocityPoint;
use exact_lagrangian::principle::{ExtendedPoint, NonHolonomic};

/// Off `M_L` the flow of Chetaev's equations keeps the constraint function `Phi` constant, and the defect measures it.
#[test]
fn off_the_constraint() {
    let system = OneCoordinate::from(CoupledInZ::default());
    let chetaev = NonHolonomic::new(&system);
    let x = VelocityPoint::new([0.3], [0.6], 0.2);
    let on = chetaev.lift(0.1, &x);
    let start = ExtendedPoint { w: on.w + 0.1, ..on };
    let motion = chetaev.flow(0.1, &start, 0.7).unwrap();
    let end = motion.end;
    let phi = end.w - chetaev.lift(0.8, &end.project()).w;
    assert!((phi - 0.1).abs() < 1e-14, "{phi}");
    assert!((0.02..=0.1).contains(&motion.defect), "{}", motion.defect);
    // z' = w holds off the constraint too; the trapezoidal rule has an error of h^2.
    let h = 1e-3;
    let short = chetaev.flow(0.1, &start, h).unwrap();
    assert!(((short.end.z - start.z) / h - 0.5 * (start.w + short.end.w)).abs() < 1e-6);
}

/// At a conjugate point the exponential map has a fold, and the projection has none: `dz1 = p1 dq1` along the fold, so
/// that the differential of `exp_h^Gamma` loses a rank there, while next to it the projection is as regular as
/// elsewhere.
#[test]
fn at_a_conjugate_point() {
    let system = NonHolonomic::new(OneCoordinate::from(HarmonicOscillator { gamma: 0.0 }));
    let x = VelocityPoint::new([0.3], [1.1], 0.2);
    let rank = |h: f64| system.exponential_differential(0.0, &x, h).map_or(f64::NAN, |d| d.singular_values().min());
    assert!(rank(std::f64::consts::PI) < 1e-15 && rank(3.0) > 0.1);
    for off in [-1e-3, 1e-3] {
        let smallest =
            system.projection_regularity(0.0, &x, std::f64::consts::PI + off).map_or(f64::NAN, |r| r.smallest);
        // v1 = -v0 and sigma = 1.
        let truth = (2.0 + 2.0 * 1.1f64 * 1.1).sqrt().recip();
        assert!((smallest - truth).abs() < 1e-3, "{smallest} for {truth}");
    }
}
