//! Statement 31 (section 4.1, lemma): `pr~_1` restricted to `M_d` is a local diffeomorphism.

use crate::common::over_motions;
use contact_geom::systems::HarmonicOscillator;
use contact_geom::{Statement, VelocityPoint};
use exact_lagrangian::NonHolonomic;

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(Statement::ImageProjection);
}

/// At a conjugate point it is the exponential map that folds, not the projection: `dz1 = p1 dq1` along the fold, so that the
/// differential of `exp_h^Gamma` loses a rank there, and right beside it the projection is as regular as ever.
#[test]
fn at_a_conjugate_point() {
    let system = NonHolonomic::new(HarmonicOscillator { gamma: 0.0 });
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
