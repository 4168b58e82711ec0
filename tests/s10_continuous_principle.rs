//! Statement 10 (section 2.2.1): Herglotz' principle. The action with fixed ends is critical exactly on solutions, and
//! `dZ/dz0 = e^(int L_z)`.

use crate::common::over_motions;
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{CoupledInZ, Pendulum, System};
use exact_lagrangian::{Curve, MotionCurve, SplineCurve, VariedCurve, action, action_derivative};

/// Along random motions of every system, and along bent curves with the same ends.
#[test]
fn on_every_system() {
    over_motions(10);
}

/// The derivative of the action along a curve that is no solution is the slope of the action itself: central differences of step
/// d, extrapolated once, err by d^4 and eps/d.
#[test]
fn the_derivative_is_that_of_the_action() {
    let (system, span, d) = (CoupledInZ::default(), (0.3, 1.2), 1e-3);
    let curve = |s: f64| (SVector::from([(1.3 * s).sin()]), SVector::from([1.3 * (1.3 * s).cos()]));
    let variation = |s: f64| (SVector::from([s * s + 0.2]), SVector::from([2.0 * s]));
    let at = |by: f64| action(&system, &VariedCurve { curve: &curve, variation: &variation, by }, span, 0.4);
    let slope = |d: f64| match (at(d), at(-d)) {
        (Ok(a), Ok(b)) => (a.z - b.z) / (2.0 * d),
        _ => f64::NAN,
    };
    let differences = (4.0 * slope(d / 2.0) - slope(d)) / 3.0;
    let formula = action_derivative(&system, &curve, &variation, span, (0.4, 0.0)).unwrap_or(f64::NAN);
    assert!((formula - differences).abs() < 1e-11, "{formula} and {differences}");
    assert!(formula.abs() > 0.1);
}

/// The action of a spline through nodes of a motion tends to that of the motion with the eighth power of their distance: it is
/// critical there, so that an error of the fourth order in the curve counts twice.
#[test]
fn splines_through_nodes() {
    let (system, duration) = (Pendulum { gamma: -0.3 }, 2.0);
    let start = system.initial();
    let motion = MotionCurve { lagrangian: &system, t0: 0.0, start };
    let truth = action(&system, &motion, (0.0, duration), start.z).map_or(f64::NAN, |a| a.z);
    let error = |count: usize| {
        let times: Vec<f64> = (0..=count).map(|k| duration * k as f64 / count as f64).collect();
        let nodes: Vec<_> = times.iter().filter_map(|s| motion.at(*s).ok()).collect();
        let points: Vec<_> = nodes.iter().map(|n| n.0).collect();
        let ends = [nodes[0].1, nodes[count].1];
        let spline = SplineCurve::new(&times, &points, Some(ends));
        assert!(spline.is_ok());
        let z = spline.map(|s| action(&system, &s, (0.0, duration), start.z).map_or(f64::NAN, |a| a.z));
        (z.unwrap_or(f64::NAN) - truth).abs()
    };
    // The velocity's error is of the third order, and its square of the sixth.
    let order = (error(8) / error(32)).log2() / 2.0;
    assert!((order - 6.0).abs() < 0.5, "order {order}, errors {:e}, {:e}", error(8), error(32));
}
