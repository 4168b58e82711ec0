//! Statement 10 (section 2.2.1), Herglotz' principle: the derivative of the action along curves that are no motions,
//! `dZ/dz0`, and curves by splines.

use crate::common::lagrangians::LogarithmicWall;
use contact_examples::systems::{CoupledInZ, HarmonicOscillator, OneCoordinate, Pendulum, System};
use contact_geom::nalgebra::SVector;
use exact_lagrangian::{
    ExactError,
    principle::{Curve, MotionCurve, SplineCurve, VariedCurve, action, action_derivative},
};
use std::cell::Cell;

/// The derivative of the action along a curve that is no solution against central differences of the action, whose
/// error with step d, extrapolated once, is d^4 and eps/d.
#[test]
fn the_derivative_is_that_of_the_action() {
    let (system, span, d) = (OneCoordinate::from(CoupledInZ::default()), (0.3, 1.2), 1e-3);
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

/// The action of a spline through nodes of a motion converges to that of the motion with order 6 in the distance of the
/// nodes: the velocity of the spline has order 3, and the action is critical, so that its error is quadratic in that of
/// the curve.
#[test]
fn splines_through_nodes() {
    let (system, duration) = (OneCoordinate::from(Pendulum { gamma: -0.3 }), 2.0);
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
    let order = (error(8) / error(32)).log2() / 2.0;
    assert!((order - 6.0).abs() < 0.5, "order {order}, errors {:e}, {:e}", error(8), error(32));
}

/// `dZ/dz0` along a curve at rest, where the action itself does not change.
#[test]
fn the_growth_of_dz_along_a_curve_at_rest() {
    let rest = |_: f64| (SVector::<f64, 1>::zeros(), SVector::<f64, 1>::zeros());
    for gamma in [-5.0f64, -1.0, 2.0] {
        let system = OneCoordinate::from(HarmonicOscillator { gamma });
        let growth = action_derivative(&system, &rest, &rest, (0.0, 1.0), (0.0, 1.0)).unwrap_or(f64::NAN);
        assert!((growth / gamma.exp() - 1.0).abs() < 1e-14, "gamma = {gamma}: {growth}");
    }
}

/// A curve that leaves the domain of L: the error has the time and the state on the curve.
#[test]
fn a_curve_that_leaves_the_domain() {
    let curve = |s: f64| (SVector::from([1.0 - s]), SVector::from([-1.0]));
    match action(&LogarithmicWall, &curve, (5.0, 3.0), 0.2) {
        Err(ExactError::OutsideDomain { t, reached, .. }) => {
            assert!(
                t > 5.5 && t <= 6.0 && (reached.q[0] - (6.0 - t)).abs() < 1e-12 && reached.v[0] == -1.0,
                "{t}, {reached:?}"
            );
        }
        other => unreachable!("{other:?}"),
    }
}

struct Counted<'a, C> {
    curve: &'a C,
    count: Cell<u32>,
}
impl<C: Curve<1>> Curve<1> for Counted<'_, C> {
    fn at(&self, s: f64) -> Result<(SVector<f64, 1>, SVector<f64, 1>), contact_geom::GeometryError> {
        self.count.set(self.count.get() + 1);
        self.curve.at(s)
    }
    fn breaks(&self) -> &[f64] {
        self.curve.breaks()
    }
}

/// The action along a spline is integrated from node to node, in both directions: otherwise its kinks would cost
/// thousands of evaluations.
#[test]
fn a_spline_breaks_at_its_nodes() {
    let times: Vec<f64> = (0..=8).map(|k| -1.0 + 0.25 * f64::from(k)).collect();
    let points: Vec<_> = times.iter().map(|t| SVector::from([(3.0 * t).sin()])).collect();
    let spline = SplineCurve::new(&times, &points, None).unwrap();
    let still = |_: f64| (SVector::<f64, 1>::zeros(), SVector::<f64, 1>::zeros());
    assert_eq!(spline.breaks(), times);
    assert_eq!(VariedCurve { curve: &spline, variation: &still, by: 1.0 }.breaks(), times);
    // In both directions by few evaluations: no panel contains a break.
    let system = OneCoordinate::from(Pendulum { gamma: -0.3 });
    for duration in [-1.0, 1.0] {
        let counted = Counted { curve: &spline, count: Cell::new(0) };
        let whole = action(&system, &counted, (0.0, duration), 0.4).map_or(f64::NAN, |a| a.z);
        let mut pieces = 0.4;
        for k in 0..4 {
            let from = 0.25 * duration * f64::from(k);
            let piece = |s: f64| spline.at(from + s).unwrap_or((SVector::from([f64::NAN]), SVector::from([f64::NAN])));
            pieces = action(&system, &piece, (from, 0.25 * duration), pieces).map_or(f64::NAN, |a| a.z);
        }
        assert!((whole - pieces).abs() < 1e-15);
        // Each of the eight panels is checked between its nodes as well.
        assert!(counted.count.get() < 1000, "{} evaluations", counted.count.get());
    }
}
