//! Statement 29 (section 4.1, theorem): where `exp_h` fails to be a local diffeomorphism, at conjugate points, and its
//! branches beyond them.

use contact_examples::systems::{ChargedParticle, HarmonicOscillator, OneCoordinate, Pendulum, TwoCoordinates};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, VelocityPoint, numbers::MaxAbsOrNan};
use exact_lagrangian::{ContactExponential, ExactError};

/// The conjugate points of the oscillator are the multiples of `pi/w`, with and without drag; the map has a fold there.
#[test]
fn conjugate_points_of_the_oscillator() {
    for gamma in [0.0f64, -0.1, -1.0] {
        let w = (1.0 - gamma * gamma / 4.0).sqrt();
        let exp = ContactExponential::new(OneCoordinate::from(HarmonicOscillator { gamma }), 10.0).unwrap();
        let x = VelocityPoint::new([0.4], [1.2], 0.0);
        let found = exp.conjugate_points(0.0, &x).unwrap_or_default();
        assert_eq!(found.len(), (10.0 * w / std::f64::consts::PI) as usize);
        for (k, point) in found.iter().enumerate() {
            let truth = (k + 1) as f64 * std::f64::consts::PI / w;
            // The zero of the sine is known up to the rounding of its argument and of the flow.
            assert!((point.after - truth).abs() < 1e-13 * truth, "{point:?} for {truth}");
            assert!(point.smallest < 1e-13);
        }
    }
}

/// Points a conjugate time apart determine no motion: the error has the last motion tried and a vanishing singular
/// value. Shortly before and after the conjugate time there is one.
#[test]
fn no_retraction_at_a_conjugate_point() {
    let system = OneCoordinate::from(HarmonicOscillator { gamma: 0.0 });
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

/// Beyond a conjugate point several motions join two points; different guesses find them, and each joins the points.
#[test]
fn branches() {
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.05 });
    let exp = ContactExponential::new(pendulum, 8.0).unwrap();
    let y = exp.at(0.0, &VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
    let guesses: Vec<_> = (-8..=8).map(|k| [0.24 * f64::from(k)].into()).collect();
    let found = exp.branches(0.0, &y, &guesses).unwrap_or_default();
    assert!(found.len() >= 3, "{} motions", found.len());
    for motion in &found {
        let end = exp.at(0.0, &motion.start).map_or(f64::NAN, |e| e.q1[0]);
        assert!((end - y.q1[0]).abs() < 1e-12);
    }
    assert!(found.iter().any(|m| (m.start.v[0] - 1.0).abs() < 1e-12));
    // Each motion reports whether it has passed a conjugate point, and when.
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

/// The derivatives of a motion at rest, whose values converge before its derivatives do.
#[test]
fn the_slope_of_a_motion_at_rest() {
    for gamma in [0.0f64, -0.4] {
        for h in [0.1, 1.0, 2.5] {
            let w = (1.0 - gamma * gamma / 4.0).sqrt();
            let slope = ContactExponential::new(OneCoordinate::from(HarmonicOscillator { gamma }), h)
                .ok()
                .and_then(|exp| exp.differential(0.0, &VelocityPoint::new([0.0], [0.0], 0.0)).ok())
                .map_or(f64::NAN, |d| d.v[(0, 0)]);
            let truth = (gamma * h / 2.0).exp() * (w * h).sin() / w;
            assert!((slope - truth).abs() < 1e-14, "gamma = {gamma}, h = {h}: {slope} for {truth}");
        }
    }
}

/// No two branches are the same motion.
#[test]
fn branches_are_different() {
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.05 });
    let exp = ContactExponential::new(pendulum, 8.0).unwrap();
    let y = exp.at(0.0, &VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
    let guesses: Vec<_> = (-8..=8).map(|k| [0.24 * f64::from(k)].into()).collect();
    let found = exp.branches(0.0, &y, &guesses).unwrap_or_default();
    for (i, one) in found.iter().enumerate() {
        for other in &found[..i] {
            assert!((one.start.v - other.start.v).max_abs_or_nan() > 1e-6, "{one:?} and {other:?}");
        }
    }
}

/// Conjugate points of multiplicity two, where the determinant does not change its sign: the half periods of a charged
/// particle in a magnetic field and a harmonic well.
#[test]
fn double_conjugate_points() {
    let particle = ChargedParticle::default();
    let exp = ContactExponential::new(TwoCoordinates::from(particle), 8.0).unwrap();
    let found = exp.conjugate_points(0.0, &VelocityPoint::new([0.4, 0.1], [1.2, 0.3], 0.0)).unwrap_or_default();
    // dq1/dv0 is a complex number times sin(w h).
    let ChargedParticle { b, k, gamma } = particle;
    let w = 0.5 * (b * b + 4.0 * k - gamma * gamma).sqrt();
    assert_eq!(found.len(), (8.0 * w / std::f64::consts::PI) as usize);
    for (i, point) in found.iter().enumerate() {
        let truth = (i + 1) as f64 * std::f64::consts::PI / w;
        assert!((point.after - truth).abs() < 1e-13 * truth && point.smallest < 1e-13, "{point:?} for {truth}");
    }
}

/// A spring whose force vanishes at a time and is repulsive afterwards.
struct FadingSpring(f64);
impl Lagrangian<1> for FadingSpring {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        (v[0] * v[0] + (t - self.0) * q[0] * q[0]) * 0.5
    }
}

/// A minimum of the slope that is not zero is no conjugate point.
#[test]
fn a_minimum_that_is_not_zero_is_no_conjugate_point() {
    let x = VelocityPoint::new([0.4], [1.2], 0.0);
    // Its slope has a minimum of 0.55 near h = 3.
    let exp = ContactExponential::new(FadingSpring(2.2), 5.0).unwrap();
    assert_eq!(exp.conjugate_points(0.0, &x), Ok(vec![]));
}

/// A spring of a given frequency.
struct Soft(f64);
impl Lagrangian<1> for Soft {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        (v[0] * v[0] - q[0] * q[0] * (self.0 * self.0)) * 0.5
    }
}

/// Conjugate points do not depend on the unit of time.
#[test]
fn conjugate_points_in_any_unit_of_time() {
    for w in [1e-6, 1e6] {
        let exp = ContactExponential::new(Soft(w), 7.0 / w).unwrap();
        let found = exp.conjugate_points(0.0, &VelocityPoint::new([0.4], [1.2 * w], 0.0)).unwrap_or_default();
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|c| c.smallest < 1e-13), "{found:?}");
    }
}
