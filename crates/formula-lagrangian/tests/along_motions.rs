//! Expressions along a motion: the energy, the momenta and the conformal factor by their names.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use contact_geom::{Derivatives, Lagrangian, VelocityPoint};
use formula_lagrangian::{Formula, FormulaError};

const TEXT: &str = "(1 + x^2)*x'^2/2 + x'*y + y'^2*exp(-x) - cos(x)*y^2 + gamma*z*x + b*t*y'";

fn formula() -> Formula {
    Formula::parse(TEXT, &["x", "y"], &[("gamma", -0.3), ("b", 0.7)]).unwrap()
}

/// The energy is `v.L_v - L` and the momenta are `L_v`, alone and within expressions, as the derivatives of the Lagrangian say.
#[test]
fn energy_and_momenta_are_those_of_the_lagrangian() {
    let formula = formula();
    let l = formula.lagrangian::<2>().unwrap();
    for k in 0..20 {
        let of = |i: i32| f64::sin(f64::from(3 * k + i));
        let (t, x) = (of(5), VelocityPoint::new([of(0), of(1)], [of(2), of(3)], of(4)));
        let p = l.gradient(t, &x).y;
        let energy = p.dot(&x.v) - l.value(t, &x.q, &x.v, x.z);
        let at = |text: &str| formula.expression(text).unwrap().at(t, x.q.as_slice(), x.v.as_slice(), x.z);
        // Sums of some ten terms of size one.
        let same = |a: f64, b: f64| (a - b).abs() < 32.0 * f64::EPSILON;
        assert!(same(at("energy"), energy), "{} {energy}", at("energy"));
        assert!(same(at("p_x"), p[0]) && same(at("p_y"), p[1]));
        assert!(same(at("E = energy^2; E - p_x*gamma"), energy * energy + 0.3 * p[0]));
        // It holds the action: what a drag takes of it is in -gamma z.
        let without = at("energy + gamma*z*x");
        assert!(same(without, energy - 0.3 * x.z * x.q[0]));
    }
}

#[test]
fn momenta_of_arrays_have_entries() {
    let formula = Formula::parse("sum(i, 0, 2, (i + 1)*q'[i]^2/2)", &["q[3]"], &[]).unwrap();
    let at = |text: &str| formula.expression(text).unwrap().at(0.0, &[0.0; 3], &[1.0, 2.0, 3.0], 0.0);
    assert_eq!(at("p_q[2]"), 9.0);
    assert_eq!(at("sum(i, 0, n-1, p_q[i]*v[i])/2 - energy"), 0.0);
}

/// Columns have the conformal factor as well, which a state alone does not tell.
#[test]
fn columns_have_the_conformal_factor() {
    let formula = formula();
    for (text, expected) in [("log_factor", -2.0), ("sigma", (-2.0f64).exp()), ("energy*0 + ln(sigma) + b", -1.3)] {
        let column = formula.named_expression(text).unwrap();
        assert!(column.has_conformal_factor(), "{text}");
        let value = column.with_log_factor(-2.0).at(0.0, &[0.1, 0.2], &[0.3, 0.4], 0.5);
        assert!((value - expected).abs() < 4.0 * f64::EPSILON, "{text}: {value}");
        // Unknown, it is no number.
        assert!(column.at(0.0, &[0.1, 0.2], &[0.3, 0.4], 0.5).is_nan());
        // An event is a function of the state.
        let refused = formula.expression(text).unwrap_err().to_string();
        assert!(refused.contains("a sum along the motion, which is known in columns alone"), "{refused}");
    }
    assert!(!formula.named_expression("energy").unwrap().has_conformal_factor());
}

/// Names of the user's come first; in a Lagrangian there is neither.
#[test]
fn own_names_come_first() {
    let own = Formula::parse("x'^2/2 + energy*x + sigma*z", &["x"], &[("energy", 2.0), ("sigma", -1.0)]).unwrap();
    let at = |text: &str| own.named_expression(text).unwrap().at(0.0, &[1.0], &[3.0], 0.0);
    assert_eq!((at("energy"), at("sigma"), at("p_x")), (2.0, -1.0, 3.0));
    assert_eq!(at("energy = 5*x"), 5.0);
    for text in ["x'^2/2 + energy", "x'^2/2 + p_x", "x'^2/2 + sigma*z"] {
        assert!(matches!(Formula::parse(text, &["x"], &[]), Err(FormulaError::Parse(_))), "{text}");
    }
}

/// Expressions tell which parameters they have.
#[test]
fn used_parameters_are_told() {
    let formula = formula();
    let used = |text: &str| {
        let expression = formula.expression(text).unwrap();
        expression.used_parameters().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(used("b*x"), ["b"]);
    assert_eq!(used("x + y"), [""; 0]);
    assert_eq!(used("energy"), ["gamma"]);
    assert_eq!(used("p_y"), ["b"]);
}
