//! Derivatives where a slope is infinite, or is NaN in a branch that is not taken.

use crate::random::Random;
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Dual, Lagrangian, VelocityPoint};
use formula_lagrangian::Formula;

/// The potential, its first and its second derivative at x, from the formula. Dual numbers over the first derivative
/// must give the same second derivative, or NaN, since they see the powers of a root at 0 one by one.
fn jet(text: &str, p: f64, x: f64) -> [f64; 3] {
    let formula = Formula::parse(&format!("x'^2/2 + ({text})"), &["x"], &[("p", p)]).unwrap();
    let l = formula.lagrangian::<1>().unwrap();
    let at = VelocityPoint::new([x], [0.0], 0.0);
    let second = l.hessian(0.0, &at).qq[(0, 0)];
    let moving = Dual { re: x, d: SVector::<f64, 1>::new(1.0) };
    let q = SVector::<_, 1>::new(moving);
    let point = VelocityPoint { q, v: SVector::<_, 1>::new(Dual::from(0.0)), z: Dual::from(0.0) };
    let force = l.closed_force(Dual::from(0.0), &point).unwrap()[0];
    let same = |a: f64, b: f64| a == b || a.is_nan() || (a - b).abs() <= 1e-12 * b.abs();
    assert!(same(force.d[0], second), "{text} at {x}: {} by duals, {second}", force.d[0]);
    [l.value(0.0, &at.q, &at.v, 0.0), l.force(0.0, &at)[0], second]
}

/// Equality to within the rounding of some powers and products.
fn close(found: f64, exact: f64) -> bool {
    found == exact || (found - exact).abs() <= 1e-13 * exact.abs()
}

#[test]
fn powers_and_branches_have_their_derivatives() {
    let inf = f64::INFINITY;
    let table: &[(&str, f64, [f64; 3])] = &[
        ("abs(x)^2.5", 0.0, [0.0; 3]),
        ("abs(x)^2.3", 0.0, [0.0; 3]),
        ("abs(x)^2", 0.0, [0.0, 0.0, 2.0]),
        ("abs(x)*abs(x)", 0.0, [0.0, 0.0, 2.0]),
        ("abs(x)^3", 0.0, [0.0; 3]),
        ("abs(x)^p", 0.0, [0.0; 3]),
        ("(x*x)^1.5", 0.0, [0.0; 3]),
        ("(x^2)^1.3", 0.0, [0.0; 3]),
        ("(x^2/p)^1.5", 0.0, [0.0; 3]),
        ("(x^2 + x^4)^1.5", 0.0, [0.0; 3]),
        ("(x^2 + x^4)^1.2", 0.0, [0.0; 3]),
        ("(x^2 + x^4)^(p - 1)", 0.0, [0.0; 3]),
        ("(x^2 + x^4)^p", 0.0, [0.0; 3]),
        ("sqrt(x^2 + x^4)^3", 0.0, [0.0; 3]),
        ("sqrt(x^2 + x^4)^2", 0.0, [0.0, 0.0, 2.0]),
        ("hypot(x, 2*x)^2", 0.0, [0.0, 0.0, 10.0]),
        ("hypot(x, x^2)^3", 0.0, [0.0; 3]),
        ("sqrt(x^4)", 0.0, [0.0, 0.0, 2.0]),
        ("sqrt((x^2 + x^4)^2)", 0.0, [0.0, 0.0, 2.0]),
        ("sqrt(x^2)", -3.0, [3.0, -1.0, 0.0]),
        ("sqrt(x^6)", -2.0, [8.0, -12.0, 12.0]),
        ("x^2.5", 0.0, [0.0; 3]),
        ("x^1.5", 0.0, [0.0, 0.0, inf]),
        ("sqrt(x)", 0.0, [0.0, inf, -inf]),
        ("(x + 1)^(p - 1.5)", -1.0, [0.0, 1.0, 0.0]),
        ("(x^2 + x^4)^0.75", 0.0, [0.0, 0.0, f64::NAN]), // The second derivative is infinite.
        ("if(x > 0, x^2.5, 0)", -1.0, [0.0; 3]),
        ("if(x > 0, x^2.5, 0)", 0.0, [0.0; 3]),
        ("if(x > 0, x^p, x^2)", -1.0, [1.0, -2.0, 2.0]),
        ("if(x > 0, sqrt(x)*x + sqrt(x), 0)", -1.0, [0.0; 3]),
        ("if(x > 0, sqrt(x), 0) + if(x > 1, x*sqrt(x), 0) + x^2", -1.0, [1.0, -2.0, 2.0]),
        ("if(x > 0, if(x > 1, ln(x - 1), sqrt(x)), x)", -1.0, [-1.0, 1.0, 0.0]),
        ("if(x > 0, if(x > 1, ln(x - 1), x^2), x)", 0.5, [0.25, 1.0, 2.0]),
        ("exp(if(x > 0, 1/x, x))*x", -1.0, [-(-1f64).exp(), 0.0, (-1f64).exp()]),
        ("max(x, sqrt(x + 3))", 6.0, [6.0, 1.0, 0.0]),
        ("min(x, sqrt(x + 1))", -1.0, [-1.0, 1.0, 0.0]),
        ("if(x < 700, x, exp(x^3))", 500.0, [500.0, 1.0, 0.0]),
    ];
    for (text, x, exact) in table {
        let found = jet(text, 2.5, *x);
        let all = found.iter().zip(exact).all(|(a, b)| close(*a, *b) || a.is_nan() && b.is_nan());
        assert!(all, "{text} at {x}: {found:?}, not {exact:?}");
    }
    // Cases without a derivative: a cone, the branch that is taken, and a condition on NaN.
    for (text, x) in [
        ("sqrt(x^2 + x^4)", 0.0),
        ("if(x > 0, sqrt(x - 2), 0)", 1.0),
        ("if(sqrt(x) > 0, x, 2*x)", -1.0),
        ("if(x > 0, x, 0) + sqrt(x)*x", -1.0),
        ("1/(x^2 + x^4)^0.5", 0.0),
    ] {
        assert!(jet(text, 2.5, x)[1].is_nan(), "{text} at {x}: {:?}", jet(text, 2.5, x));
    }
}

#[test]
fn powers_of_lengths_have_their_derivatives_at_0() {
    for power in ["1.5", "1.2", "2.5", "a", "a + 1"] {
        for base in ["(q[0]^2 + q[1]^2)", "(2*q[0]^2 + q[1]^2/3)", "(versine(q[0]) + sin(q[1])^2)"] {
            let text = format!("v[0]^2/2 + v[1]^2/2 - {base}^({power})");
            let l = Formula::parse(&text, &["q[2]"], &[("a", 1.5)]).unwrap().lagrangian::<2>().unwrap();
            let at = VelocityPoint::new([0.0, 0.0], [0.3, 0.0], 0.0);
            assert_eq!(l.force(0.0, &at).as_slice(), [0.0; 2], "{text}");
            assert_eq!(l.hessian(0.0, &at).qq.as_slice(), [0.0; 4], "{text}");
        }
    }
    // A base that is not known to be a sum of squares has no such derivatives.
    let l =
        Formula::parse("v[0]^2/2 + v[1]^2/2 - (q[0] + q[1])^1.5", &["q[2]"], &[]).unwrap().lagrangian::<2>().unwrap();
    assert_eq!(l.hessian(0.0, &VelocityPoint::new([0.0; 2], [0.0; 2], 0.0)).qq[(0, 1)], f64::NEG_INFINITY);
}

/// A function with its exact value and first and second derivatives where it is defined, one-sided at the end of its
/// domain.
type Piece = (&'static str, fn(f64) -> [f64; 3]);

/// Functions that are NaN on one side, selected where they are defined, and nested and summed at random.
#[test]
fn branches_that_are_not_taken_leave_no_trace() {
    let right: [Piece; 4] = [
        ("x^2.5", |x| [x.powf(2.5), 2.5 * x.powf(1.5), 3.75 * x.sqrt()]),
        ("x*sqrt(x + 1)", |x| {
            let r = (x + 1.0).sqrt();
            [x * r, r + 0.5 * x / r, 1.0 / r - 0.25 * x / r.powi(3)]
        }),
        ("ln(1 + 2*x)", |x| [(2.0 * x).ln_1p(), 2.0 / (1.0 + 2.0 * x), -4.0 / (1.0 + 2.0 * x).powi(2)]),
        ("abs(x)^3.5", |x| [x.powf(3.5), 3.5 * x.powf(2.5), 8.75 * x.powf(1.5)]),
    ];
    let left: [Piece; 3] = [
        ("(-x)^3.5", |x| [(-x).powf(3.5), -3.5 * (-x).powf(2.5), 8.75 * (-x).powf(1.5)]),
        ("x*ln(-x + 1)", |x| {
            let u = 1.0 - x;
            [x * u.ln(), u.ln() - x / u, -2.0 / u - x / (u * u)]
        }),
        ("x^2", |x| [x * x, 2.0 * x, 2.0]),
    ];
    let mut random = Random(0x5EED_1234);
    for _ in 0..300 {
        let x = [-0.9, -1e-9, 0.0, 1e-9, 0.4, 0.9][random.below(6)];
        let (mut terms, mut exact) = (Vec::new(), [0.0; 3]);
        for _ in 0..1 + random.below(3) {
            let ((r, of_right), (l, of_left)) = (right[random.below(4)], left[random.below(3)]);
            let factor = [1.0, -2.0, 0.3][random.below(3)];
            let inner = if random.below(2) == 0 {
                format!("if(x < 0, {l}, {r})")
            } else {
                format!("if(x > -2, if(x < 0, {l}, {r}), sqrt(x))")
            };
            terms.push(format!("({factor})*({inner})"));
            let jet = if x < 0.0 { of_left(x) } else { of_right(x) };
            exact = std::array::from_fn(|k| exact[k] + factor * jet[k]);
        }
        let text = terms.join(" + ");
        let found = jet(&text, 0.0, x);
        // The terms are of the order of ten, and may cancel each other.
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-13 * (10.0 + b.abs());
        assert!(found.iter().zip(exact).all(|(a, b)| near(*a, b)), "{text} at {x}: {found:?}, not {exact:?}");
    }
}

/// The separately evaluated rate is bitwise equal to that of the gradient, for any parameters.
#[test]
fn the_rate_alone_is_that_of_the_gradient() {
    let texts =
        ["x'^2/2 + gamma*cos(w*t)*z", "x'^2/2 - x^2 - z*exp(-t)*gamma - w*z^2", "x'^2/2 + x*z*x' + gamma*z", "x'^2/2"];
    for text in texts {
        let formula = Formula::parse(text, &["x"], &[("gamma", -0.1), ("w", 1.3)]).unwrap();
        let mut l = formula.lagrangian::<1>().unwrap();
        for gamma in [-0.1, 0.4] {
            l.set("gamma", gamma).unwrap();
            for t in [0.0, 0.7, -3.0] {
                let at = VelocityPoint::new([0.3], [1.1], -0.6);
                assert_eq!(l.rate(t, &at).to_bits(), l.gradient(t, &at).z.to_bits(), "{text}, {gamma}, {t}");
            }
        }
    }
}
