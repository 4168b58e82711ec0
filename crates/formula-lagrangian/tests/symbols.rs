//! Formulas that are built by a program are equal to those of the same text.

use contact_geom::{Derivatives, VelocityPoint};
use formula_lagrangian::{Formula, FormulaError, Symbols};

const TEXT: &str = "(x'^2 + y'^2)/2 - a*(1 - cos(x - y))/(2 + sinh(x)^3) + exp(-t)*z + max(x, 0.1)^1.5*-y +
    if(x < y, hypot(x, y), atan2(y, 2))";

#[test]
fn operators_build_what_a_text_says() {
    let s = Symbols::new(&["x", "y"], &[("a", 0.7)]).unwrap();
    let [x, y, u, w] = [s.position(0), s.position(1), s.velocity(0), s.velocity(1)];
    let a = s.parameter("a").unwrap();
    let kinetic = (&u * &u + w.powi(2)) / 2.0;
    let potential = &a * (1.0 - (&x - &y).cos()) / (2.0 + x.sinh().powi(3));
    let rest = (-s.time()).exp() * s.action() + x.max(0.1).pow(1.5) * -&y;
    let kinks = x.if_less(&y, x.hypot(&y), y.atan2(2.0));
    let built = s.formula(&(kinetic - potential + rest + kinks)).unwrap().lagrangian::<2>().unwrap();
    let read = Formula::parse(TEXT, &["x", "y"], &[("a", 0.7)]).unwrap().lagrangian::<2>().unwrap();
    assert_eq!(built.proved(), read.proved());
    for k in 0..20 {
        let c = |i: usize| ((k * 7 + i) as f64 * 0.618_033_988_749_894_9).fract() - 0.45;
        let at = VelocityPoint::new([c(0), c(1)], [c(2), c(3)], c(4));
        let [one, other] = [&built, &read].map(|l| l.with_gradient(c(5), &at));
        // The sums are the same and in the same order except for commuting summands: round-off of some twenty terms of
        // order 1.
        assert!((one.0 - other.0).abs() < 1e-14, "{one:?} {other:?}");
        assert!((one.1.x - other.1.x).norm() < 1e-13, "{one:?} {other:?}");
    }
}

#[test]
fn what_does_not_belong_together_is_an_error() {
    let [one, other] = [0; 2].map(|_| Symbols::new(&["x"], &[("a", 1.0)]).unwrap());
    let v = one.velocity(0);
    assert!(one.formula(&(&v * &v)).is_ok());
    assert_eq!(other.formula(&v).unwrap_err(), FormulaError::Mixed);
    assert!(matches!(one.parameter("b"), Err(FormulaError::UnknownParameter { .. })));
    let mixed = &v * other.velocity(0);
    assert_eq!(one.formula(&mixed).unwrap_err(), FormulaError::Mixed);
    assert_eq!(other.formula(&other.velocity(0)).unwrap_err(), FormulaError::Mixed);
    let beyond = Symbols::new(&["x"], &[]).unwrap();
    assert!(matches!(beyond.formula(&beyond.position(3)), Err(FormulaError::Unknown { index: 3, .. })));
}
