//! Statement 29 (section 4.1, theorem): `exp_h` is a local diffeomorphism; and where it is not, at conjugate points.

use crate::common::over_motions;
use contact_geom::VelocityPoint;
use contact_geom::systems::{ChargedParticle, HarmonicOscillator, Pendulum};
use exact_lagrangian::{ContactExponential, ExactError};

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(29);
}

/// The conjugate points of the oscillator are the multiples of `pi/w`, those of no drag and of drag, and there the map folds.
#[test]
fn conjugate_points_of_the_oscillator() {
    for gamma in [0.0f64, -0.1, -1.0] {
        let w = (1.0 - gamma * gamma / 4.0).sqrt();
        let Ok(exp) = ContactExponential::new(HarmonicOscillator { gamma }, 10.0) else { return };
        let x = VelocityPoint::new([0.4], [1.2], 0.0);
        let found = exp.conjugate_points(0.0, &x).unwrap_or_default();
        assert_eq!(found.len(), (10.0 * w / std::f64::consts::PI) as usize);
        for (k, point) in found.iter().enumerate() {
            let truth = (k + 1) as f64 * std::f64::consts::PI / w;
            // The sine's zero is known to the rounding of its argument and of the flow.
            assert!((point.after - truth).abs() < 1e-13 * truth, "{point:?} for {truth}");
            assert!(point.smallest < 1e-13);
        }
    }
}

/// A conjugate point of multiplicity two, where the determinant does not change its sign: the cyclotron period.
#[test]
fn conjugate_points_without_a_change_of_sign() {
    let particle = ChargedParticle::default();
    let Ok(exp) = ContactExponential::new(particle, 8.0) else { return };
    let x = VelocityPoint::new([0.4, 0.1], [1.2, 0.3], 0.0);
    let determinant = |h: f64| {
        let d = ContactExponential::new(particle, h).ok().and_then(|e| e.differential(0.0, &x).ok());
        d.map_or(f64::NAN, |d| d.v[(0, 0)] * d.v[(1, 1)] - d.v[(0, 1)] * d.v[(1, 0)])
    };
    for point in exp.conjugate_points(0.0, &x).unwrap_or_default() {
        let (before, after) = (determinant(point.after - 1e-3), determinant(point.after + 1e-3));
        assert!(determinant(point.after).abs() < 1e-12 && before.abs() > 1e-8 && after.abs() > 1e-8, "{point:?}");
    }
}

/// Points a conjugate time apart determine no motion: the status says so, with the last motion tried and a singular value that
/// vanishes. Just before and beyond, with a guess, there is one.
#[test]
fn no_retraction_at_a_conjugate_point() {
    let system = HarmonicOscillator { gamma: 0.0 };
    let x = VelocityPoint::new([0.4], [1.2], 0.0);
    let refused = |h: f64, off: f64| {
        let exp = ContactExponential::new(system, h).map_err(ExactError::from)?;
        let mut y = exp.at(0.0, &x)?;
        y.q1[0] += off;
        exp.retract(0.0, &y)
    };
    for off in [0.0, 0.1] {
        match refused(std::f64::consts::PI, off) {
            Err(ExactError::ConjugatePoint { last, smallest, .. }) => {
                assert!(smallest < 1e-7 && last.check().is_ok(), "{smallest:e}");
            }
            other => assert!(other.is_err() && matches!(other, Err(ExactError::NotConverged { .. })), "{other:?}"),
        }
    }
    for h in [3.0, 3.3] {
        let found = refused(h, 0.0).map_or(f64::NAN, |r| r.start.v[0]);
        assert!((found - 1.2).abs() < 1e-12, "h = {h}: {found}");
    }
}

/// Beyond a conjugate point several motions join two points; guesses find them, and each is one.
#[test]
fn branches() {
    let pendulum = Pendulum { gamma: -0.05 };
    let Ok(exp) = ContactExponential::new(pendulum, 8.0) else { return };
    let Ok(y) = exp.at(0.0, &VelocityPoint::new([0.0], [1.0], 0.0)) else { return };
    let guesses: Vec<_> = (-8..=8).map(|k| [0.24 * f64::from(k)].into()).collect();
    let found = exp.branches(0.0, &y, &guesses).unwrap_or_default();
    assert!(found.len() >= 3, "{} motions", found.len());
    for motion in &found {
        let end = exp.at(0.0, &motion.start).map_or(f64::NAN, |e| e.q1[0]);
        assert!((end - y.q1[0]).abs() < 1e-12);
    }
    assert!(found.iter().any(|m| (m.start.v[0] - 1.0).abs() < 1e-12));
    // Each says whether it has passed a conjugate point, and when.
    for motion in &found {
        let first = exp.conjugate_points(0.0, &motion.start).ok().and_then(|c| c.first().map(|p| p.after));
        match (motion.conjugate, first) {
            (None, None) => {}
            (Some(by), Some(after)) => assert!(after <= by && by - after <= 8.0 / 32.0 + 1e-9, "{after}, {by}"),
            other => unreachable!("{other:?}"),
        }
    }
    assert!(found.iter().any(|m| m.conjugate.is_some()));
}
