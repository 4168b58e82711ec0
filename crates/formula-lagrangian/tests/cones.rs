//! Norms and other roots that may vanish along a motion, as formulas show them.

use contact_geom::Lagrangian;
use formula_lagrangian::Formula;

#[test]
fn norms_that_may_vanish() {
    for (term, cones) in [
        ("hypot(x, y)", true),
        ("sqrt(x^2 + y^2)", true),
        ("1/(hypot(x, y) + 1)", true),
        ("(hypot(x, y) - l)^2", true),
        ("x'*sqrt(x'^2 + y'^2)", true),
        ("(x^2 + y^2)^1.5", true),
        ("(x^2 + y^2)^0.7", true),
        ("atan2(y, x)", true),
        ("sqrt(x)", true),
        ("hypot(x, 1)", false),
        ("sqrt(x^2 + y^2 + 0.01)", false),
        ("sqrt(exp(x))", false),
        ("1/hypot(x, y)", false),
        ("1/sqrt(x^2 + y^2)^3", false),
        ("l/sqrt(x^2 + y^2)", false),
        ("l/(x*sqrt(x^2 + y^2))", false),
        ("1/(l/hypot(x, y) + 1)", true),
        ("exp(-l/hypot(x, y))", true),
        ("x/hypot(x, y)", true),
        ("x*(x^2 + y^2)^-0.5", true),
        ("1/(1/hypot(x, y))", true),
        ("1/hypot(x, y) + hypot(x, y)", true),
        ("(x^2 + y^2)^-0.7", false),
        ("(x^2 + y^2)^2", false),
        ("sqrt(l)*x", false),
    ] {
        let formula = Formula::parse(&format!("(x'^2 + y'^2)/2 + {term}"), &["x", "y"], &[("l", 1.0)]).unwrap();
        assert_eq!(formula.lagrangian::<2>().unwrap().has_cones(), cones, "{term}");
    }
    let dragged = Formula::parse("(x'^2 + y'^2)/2", &["x", "y"], &[]).unwrap();
    let dragged = dragged.with_force("x", "-x'/hypot(x', y')").unwrap().lagrangian::<2>().unwrap();
    assert!(dragged.has_cones());
}
