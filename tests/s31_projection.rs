//! Statement 31 (section 4.1, lemma): `pr~_1` restricted to `M_d` is a local diffeomorphism.

use crate::common::over_motions;
use contact_geom::VelocityPoint;
use contact_geom::systems::HarmonicOscillator;
use exact_lagrangian::NonHolonomic;

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(31);
}

/// It fails where the exponential map does: at a conjugate point the tangent space of `M_d` meets the kernel. There `z1` still
/// tells the motions apart, so that `M_d` is a submanifold and only its projection folds.
#[test]
fn not_at_a_conjugate_point() {
    let system = NonHolonomic::new(HarmonicOscillator { gamma: 0.0 });
    let x = VelocityPoint::new([0.3], [1.1], 0.2);
    let at = |h: f64| {
        let full = system.exponential_differential(0.0, &x, h).map(|d| d.singular_values().min());
        (system.projection_regularity(0.0, &x, h).map_or(f64::NAN, |r| r.smallest), full.unwrap_or(f64::NAN))
    };
    let (before, pi, after) = (at(3.0), at(std::f64::consts::PI), at(3.3));
    assert!(before.0 > 0.01 && after.0 > 0.01, "{before:?}, {after:?}");
    // z1 = z0 + (q1 v1 - q0 v0)/2 moves by q0 dv0 at pi.
    assert!(pi.0 < 1e-14 && pi.1 > 0.1, "{pi:?}");
}
