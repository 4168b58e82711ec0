//! Derivatives of formulas with respect to their parameters.

use crate::random::Random;
use contact_examples::systems::Pendulum;
use contact_geom::nalgebra::SVector;
use contact_geom::table::{Interpolation, Table};
use contact_geom::{Dual, Forced, Lagrangian, Parametric, VelocityDrag, VelocityPoint};
use discrete_herglotz::sensitivity::{EndCovector, Gradient, LossGradient};
use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
use formula_lagrangian::{Formula, FormulaLagrangian};

type Along = Dual<f64, SVector<f64, 1>>;

const PARAMETERS: [(&str, f64); 4] = [("a", 1.5), ("b", -0.4), ("c", 0.3), ("unused", 7.0)];

fn line(text: &str) -> FormulaLagrangian<1> {
    let drive = Table::new(&[0.0, 1.0, 3.0], &[1.0, -2.0, 0.5], Interpolation::Cubic).unwrap();
    let formula = Formula::parse_with_tables(text, &["x"], &PARAMETERS, &[("drive", drive)]).unwrap();
    formula.lagrangian().unwrap()
}

/// The parameters as numbers with a derivative in one of them.
fn moving(l: &impl Parametric<1>, k: usize) -> Vec<Along> {
    let slope = |i: usize| SVector::<f64, 1>::from_element(if i == k { 1.0 } else { 0.0 });
    l.parameters().iter().enumerate().map(|(i, x)| Along { re: *x, d: slope(i) }).collect()
}

/// The derivatives of L in all parameters at a time and a point.
fn slopes(l: &FormulaLagrangian<1>, t: f64, x: &VelocityPoint<1>) -> Vec<f64> {
    let (q, v) = (x.q.map(Along::from), x.v.map(Along::from));
    (0..l.parameter_count()).map(|k| l.value_at(&moving(l, k), t.into(), &q, &v, x.z.into()).d[0]).collect()
}

fn force_slopes(l: &FormulaLagrangian<1>, t: f64, x: &VelocityPoint<1>) -> Vec<f64> {
    let at = VelocityPoint { q: x.q.map(Along::from), v: x.v.map(Along::from), z: x.z.into() };
    (0..l.parameter_count()).map(|k| l.force_at(&moving(l, k), t.into(), &at)[0].d[0]).collect()
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    // A few operations on numbers of size one.
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-14 * (1.0 + b.abs()))
}

#[test]
fn derivatives_are_those_by_hand() {
    let (t, x, v, z) = (0.7, 0.6_f64, -0.8_f64, 0.4);
    let [a, b, c] = [1.5, -0.4, 0.3_f64];
    let point = VelocityPoint::new([x], [v], z);
    type Case<'a> = (&'a str, [f64; 3]);
    let table: &[Case<'_>] = &[
        ("a*x'^2/2 + b*x*z + c*z", [v * v / 2.0, x * z, z]),
        ("sin(a*x)*exp(b*t)/c", {
            let (s, e) = ((a * x).sin(), (b * t).exp());
            [x * (a * x).cos() * e / c, s * t * e / c, -s * e / (c * c)]
        }),
        // Nodes of parameters only are folded into constants of the tapes.
        ("sqrt(a^2 + c)*x", [a / (a * a + c).sqrt() * x, 0.0, 0.5 / (a * a + c).sqrt() * x]),
        ("x^a + a^x", [x.powf(a) * x.ln() + x * a.powf(x - 1.0), 0.0, 0.0]),
        // Where the base is negative, a power depends on its base and not on its exponent.
        ("c*x'^(a + 0.5)", [0.0, 0.0, v * v]),
        ("if(x < a, b*x, c*x)", [0.0, x, 0.0]),
        ("max(a*x, b*x) + abs(b*x) + hypot(c, x)", [x, -x, c / c.hypot(x)]),
        ("atan2(c, x)", [0.0, 0.0, x / (x * x + c * c)]),
        ("drive(a*x)", {
            let drive = Table::new(&[0.0, 1.0, 3.0], &[1.0, -2.0, 0.5], Interpolation::Cubic).unwrap();
            [x * drive.derivative(1, a * x), 0.0, 0.0]
        }),
    ];
    for (text, expected) in table {
        let l = line(text);
        let found = slopes(&l, t, &point);
        assert!(close(&found, &[expected.as_slice(), &[0.0]].concat()), "{text}: {found:?}, not {expected:?}");
        let value = l.value_at(&l.parameters(), t, &point.q, &point.v, z);
        assert!(close(&[value], &[l.value(t, &point.q, &point.v, z)]), "{text}");
    }
}

#[test]
fn forces_and_rayleighs_function_have_parameters() {
    let (t, x, v, z) = (0.7, 0.6, -0.8, 0.4_f64);
    let l = line("force[x] = -a*x'^3 + b*cos(c*t); rayleigh = c*a/2*x'^2 + b*z*x'; L = x'^2/2 - a*x^2/2");
    let point = VelocityPoint::new([x], [v], z);
    // f = -a v^3 + b cos(c t) - c a v - b z
    let (a, b, c) = (1.5, -0.4, 0.3_f64);
    let expected = [-v * v * v - c * v, (c * t).cos() - z, -b * t * (c * t).sin() - a * v, 0.0];
    assert!(close(&force_slopes(&l, t, &point), &expected));
    assert!(close(&slopes(&l, t, &point), &[-x * x / 2.0, 0.0, 0.0, 0.0]));
    assert!(close(l.force_at(&l.parameters(), t, &point).as_slice(), l.applied_force(t, &point).as_slice()));
    assert_eq!(force_slopes(&line("a*x'^2/2"), t, &point), [0.0; 4]);
}

/// With parameters as inputs, a formula has the values of the same formula after they are set.
#[test]
fn values_are_those_of_set_parameters() {
    let text = "force[x] = -a*x'*abs(x') + drive(b*t); L = x'^2*(1 + a*cos(x)^2)/2 + x^3*c^a/(2 + b) + drive(x)*c*z^2";
    let (l, mut random) = (line(text), Random(3));
    for _ in 0..200 {
        let mut next = || 0.1 + 1.8 * random.below(1 << 20) as f64 / f64::from(1 << 20);
        let theta = [next(), next(), next(), next()];
        let (t, x) = (next(), VelocityPoint::new([next()], [next()], next()));
        let set = l.with_parameters(&theta).unwrap();
        assert_eq!(set.parameters(), theta);
        assert!(close(&[l.value_at(&theta, t, &x.q, &x.v, x.z)], &[set.value(t, &x.q, &x.v, x.z)]));
        assert!(close(l.force_at(&theta, t, &x).as_slice(), set.applied_force(t, &x).as_slice()));
    }
}

/// The gradient of the position at the end of a motion.
fn gradient(l: &impl Parametric<1>) -> Gradient {
    let problem = Problem::new(l, 0.0, VelocityPoint::new([1.0], [1.0], 0.0)).unwrap();
    let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.25));
    let position = EndCovector { q: [1.0].into(), ..EndCovector::zero(1) };
    let LossGradient { loss, .. } = run.gradient_of(|end| (end.q[0], position.clone()), Until::Time(20.0)).unwrap();
    loss.unwrap().1
}

/// Gradients of runs are those of the same Lagrangian as a type, to the rounding of some hundred stages.
#[test]
fn gradients_of_runs_are_those_of_a_type() {
    let pendulum = Pendulum { gamma: -0.01 };
    let drag = VelocityDrag { linear: [0.05].into(), quadratic: 0.0 };
    let of_type = gradient(&Forced { lagrangian: pendulum, force: drag });
    let text = "force[x] = -c*x'; L = x'^2/2 - versine(x) + gamma*z";
    let parameters = [("unused", 2.0), ("gamma", -0.01), ("c", 0.05)];
    let found = gradient(&Formula::parse(text, &["x"], &parameters).unwrap().lagrangian::<1>().unwrap());
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
    assert!(near(found.q[0], of_type.q[0]) && near(found.rate[0], of_type.rate[0]) && near(found.z, of_type.z));
    let [unused, gamma, c] = found.parameters[..] else { panic!("three parameters") };
    assert!(unused == 0.0 && near(gamma, of_type.parameters[0]) && near(c, of_type.parameters[1]));
}

#[test]
fn additional_coordinates_have_no_parameters() {
    let formula = Formula::parse("force[y] = -a*y'; L = a*(x'^2 + y'^2)/2", &["x", "y"], &[("a", 2.0)]).unwrap();
    let l = formula.lagrangian_within::<4>().unwrap();
    let x = VelocityPoint::new([0.0; 4], [1.0, 2.0, 3.0, 4.0], 0.0);
    assert_eq!(l.value_at(&[3.0], 0.0, &x.q, &x.v, 0.0), 7.5 + 12.5);
    assert_eq!(l.force_at(&[3.0], 0.0, &x).as_slice(), [0.0, -6.0, 0.0, 0.0]);
}

#[test]
fn names_and_numbers_are_checked() {
    let l = line("a*x'^2/2 + b*x");
    assert_eq!(l.parameter_names(), ["a", "b", "c", "unused"]);
    assert_eq!(l.parameter_index("c"), Ok(2));
    let error = l.parameter_index("unusd").unwrap_err();
    assert_eq!(error.to_string(), "there is no parameter `unusd`; did you mean `unused`?");
    assert!(l.with_parameters(&[1.0]).is_none() && l.with_parameters(&[1.0, 2.0, f64::NAN, 0.0]).is_none());
}

#[test]
fn expressions_have_gradients() {
    let formula = Formula::parse("a*x'^2/2 - b*x^2/2 + c*z", &["x"], &PARAMETERS).unwrap();
    let g = formula.expression("energy*t + p_x").unwrap().gradient_at(2.0, &[0.5], &[-1.0], 3.0);
    // E = a v^2/2 + b x^2/2 - c z, p = a v
    let energy = 0.75 - 0.05 - 0.9;
    assert!(close(&[g.value, g.t, g.z], &[2.0 * energy - 1.5, energy, -0.6]));
    assert!(close(&[g.q[0], g.v[0]], &[-0.4, -3.0 + 1.5]));
    assert!(close(&g.parameters, &[1.0 - 1.0, 0.25, -6.0, 0.0]));
    assert!(formula.expression("x*sigma").unwrap().gradient_at(2.0, &[0.5], &[-1.0], 3.0).value.is_nan());
    assert!(formula.expression("x").unwrap().gradient_at(2.0, &[], &[], 3.0).value.is_nan());
}
