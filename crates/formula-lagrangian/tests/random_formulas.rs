//! Random formulas: derivatives compared with dual numbers, and proved properties with numerical checks.

use crate::random::Random;
use contact_geom::nalgebra::SVector;
use contact_geom::{Arguments, Dual, Parametric, ScalarSystem, Slopes, VelocityPoint};
use formula_lagrangian::{Formula, FormulaDerivatives, FormulaLagrangian};

impl Random {
    fn number(&mut self) -> f64 {
        0.2 + self.below(1 << 20) as f64 / (1 << 20) as f64
    }
    fn pick(&mut self, words: &[&str]) -> String {
        words[self.below(words.len())].to_owned()
    }

    /// A random expression of the given depth over given leaves, with or without kinks.
    fn expression(&mut self, depth: usize, leaves: &[&str], kinks: bool) -> String {
        if depth == 0 || self.below(6) == 0 {
            return match self.below(5) {
                0 => format!("{:.3}", self.number()),
                _ => self.pick(leaves),
            };
        }
        let a = self.expression(depth - 1, leaves, kinks);
        match self.below(if kinks { 20 } else { 17 }) {
            0..4 => format!("({a} + {})", self.expression(depth - 1, leaves, kinks)),
            4..6 => format!("({a} - {})", self.expression(depth - 1, leaves, kinks)),
            6..10 => format!("({a} * {})", self.expression(depth - 1, leaves, kinks)),
            10 => format!("({a} / (2.5 + ({})^2))", self.expression(depth - 1, leaves, kinks)),
            11..13 => format!("({a})^{}", 2 + self.below(4)),
            13 => format!("sqrt(1 + ({a})^2)"),
            14 => format!("(1.5 + ({a})^2)^{}", self.pick(&["-1", "-0.5", "-1.5", "0.3", "a", "-2"])),
            15..17 => {
                let form = self.pick(&[
                    "sin(_)",
                    "cos(_)",
                    "tanh(_)",
                    "atan(_)",
                    "versine(_)",
                    "-_",
                    "exp(-1 - _^2)",
                    "log1p(2 + _^2)",
                    "asinh(_)",
                    "acosh(2 + _^2)",
                    "atanh(_/(2 + _^2))",
                ]);
                form.replace('_', &format!("({a})"))
            }
            17 => format!("{}({a})", self.pick(&["abs", "sign"])),
            18 => format!(
                "{}({a}, {})",
                self.pick(&["min", "max", "hypot", "atan2"]),
                self.expression(depth - 1, leaves, kinks)
            ),
            _ => {
                let [b, c, d] = [0; 3].map(|_| self.expression(depth - 1, leaves, kinks));
                format!("if({a} < {b}, {c}, {d})")
            }
        }
    }

    /// A random Lagrangian, which usually has some structure.
    fn lagrangian(&mut self, kinks: bool) -> String {
        let part = |random: &mut Random| {
            let leaves: &[&str] = match random.below(9) {
                0 => &["x", "y", "a"],
                1 => &["x'", "y'"],
                2 => &["z", "a"],
                3 => &["t"],
                4 => &["x", "y'", "t"],
                5 => &["x", "y", "x'", "y'", "z", "t", "a"],
                6 => return format!("{:.2}*z", random.number()),
                7 => {
                    return random.pick(&[
                        "x*y'",
                        "x*y",
                        "x'*y'/2",
                        "a*x^2",
                        "t*z",
                        "x'",
                        "z^2",
                        "0*z",
                        "t*x^2",
                        "sign(t)*z",
                    ]);
                }
                _ => &["x", "t"],
            };
            let depth = 1 + random.below(4);
            random.expression(depth, leaves, kinks)
        };
        let start = self.pick(&["(x'^2 + y'^2)/2", "x'^2 + 0.3*y'^2 + 0.1*x'*y'", "(2 + sin(x))*x'^2 + y'^2", "0"]);
        (0..1 + self.below(3)).fold(start, |sum, _| format!("{sum} + {}", part(self)))
    }
}

fn lagrangian(text: &str) -> FormulaLagrangian<2> {
    let formula = Formula::parse(text, &["x", "y"], &[("a", 1.25)]).unwrap_or_else(|e| panic!("{text}: {e}"));
    formula.lagrangian().unwrap()
}

/// Each proved property holds to round-off, compared with derivatives by automatic differentiation. The closed
/// derivatives agree with these to four units of round-off of their terms, to which each function adds one unit, and
/// each operation half a unit.
fn compare(seed: u64, count: usize, kinks: bool) -> [usize; 3] {
    let mut random = Random(seed);
    let (mut compared, mut claims) = (0, 0);
    let mut worst = [0.0_f64; 2];
    for _ in 0..count {
        let text = random.lagrangian(kinks);
        let l = lagrangian(&text);
        let mut coordinate = || 2.0 * random.number() - 1.3;
        let x = VelocityPoint::new([coordinate(), coordinate()], [coordinate(), coordinate()], coordinate());
        let t = coordinate();
        let Some(defects) = l.proved().defects(&l, t, &x) else { continue };
        compared += 1;
        for defect in defects {
            let derivative = defect.claim.starts_with("closed");
            claims += usize::from(!derivative);
            if derivative {
                let kind = usize::from(defect.claim == "closed_hessian");
                worst[kind] = f64::max(worst[kind], defect.size);
            }
            let bound = if derivative { 4.0 * f64::EPSILON } else { 1e-13 };
            assert!(defect.size <= bound, "{text}\n at t = {t}, {x:?}: {defect:?}\n {:?}", l.proved());
        }
    }
    println!("largest defects of gradients and Hessians: {worst:?}");
    [compared, claims, count]
}

#[test]
fn smooth_formulas() {
    let [compared, claims, count] = compare(0x2545_f491_4f6c_dd1d, 70_000, false);
    // Most formulas are defined at most points, and have some structure.
    assert!(compared > count * 9 / 10 && claims > count, "{compared} {claims} of {count}");
}

#[test]
fn formulas_with_kinks() {
    let [compared, claims, count] = compare(0x5851_f42d_4c95_7f2d, 30_000, true);
    assert!(compared > count * 8 / 10 && claims > count / 2, "{compared} {claims} of {count}");
}

/// The derivatives in a parameter, or in the time: of `L_q`, `L_v`, `L_z`, L and the force.
fn explicit(l: &FormulaDerivatives, of: Option<usize>, t: f64, x: &VelocityPoint<2>) -> Vec<f64> {
    let (mut q, mut v, mut z, mut force) = ([0.0; 2], [0.0; 2], 0.0, [0.0; 2]);
    let (at, to) =
        (Arguments { t, q: x.q.as_slice(), v: x.v.as_slice(), z: x.z }, Slopes { q: &mut q, v: &mut v, z: &mut z });
    let value = l.explicit(of, at, to, &mut force);
    [&q[..], &v, &[z, value], &force].concat()
}

/// The same by nested dual numbers.
fn explicit_by_duals(l: &FormulaLagrangian<2>, of: Option<usize>, t: f64, x: &VelocityPoint<2>) -> Vec<f64> {
    type Inner = Dual<f64, SVector<f64, 5>>;
    type Outer = Dual<Inner, SVector<Inner, 1>>;
    let number = |re: f64, k: Option<usize>, moves: bool| -> Outer {
        let inner = Inner { re, d: SVector::from_fn(|i, _| f64::from(u8::from(Some(i) == k))) };
        Outer { re: inner, d: SVector::from([Inner { re: f64::from(u8::from(moves)), d: SVector::zeros() }]) }
    };
    let theta: Vec<Outer> = l.parameters().iter().enumerate().map(|(k, x)| number(*x, None, of == Some(k))).collect();
    let q = SVector::from([number(x.q[0], Some(0), false), number(x.q[1], Some(1), false)]);
    let v = SVector::from([number(x.v[0], Some(2), false), number(x.v[1], Some(3), false)]);
    let at = VelocityPoint { q, v, z: number(x.z, Some(4), false) };
    let t = number(t, None, of.is_none());
    let (value, force) = (l.value_at(&theta, t, &at.q, &at.v, at.z).d[0], l.force_at(&theta, t, &at));
    value.d.iter().copied().chain([value.re, force[0].d[0].re, force[1].d[0].re]).collect()
}

/// Derivatives in parameters and time are those by nested dual numbers, also after the parameters are set. Both sum terms
/// that may cancel, whose size is not known here: that of the largest derivative stands for it, with a margin.
#[test]
fn derivatives_in_parameters_and_time() {
    let (mut random, mut compared, mut worst) = (Random(0x1234_5678_9abc_def1), 0, 0.0_f64);
    for _ in 0..10_000 {
        let kinks = random.below(3) == 0;
        let force = random.expression(2, &["x", "y'", "z", "t", "a", "b"], kinks);
        let text = format!("force[x] = {force}; {} + b*a^(x/4)*y", random.lagrangian(kinks));
        let formula = Formula::parse(&text, &["x", "y"], &[("a", 1.25), ("b", -0.5)]).unwrap();
        let (l, derivatives) = (formula.lagrangian::<2>().unwrap(), formula.derivatives().unwrap());
        let mut coordinate = || 2.0 * random.number() - 1.3;
        let x = VelocityPoint::new([coordinate(), coordinate()], [coordinate(), coordinate()], coordinate());
        let (t, theta) = (coordinate(), [0.5 + coordinate().abs(), coordinate()]);
        for of in [Some(0), Some(1), None] {
            // The tapes exist when the parameters are set.
            explicit(&derivatives, of, t, &x);
            let found = explicit(&derivatives.with_parameters(&theta).unwrap(), of, t, &x);
            let expected = explicit_by_duals(&l.with_parameters(&theta).unwrap(), of, t, &x);
            let size =
                expected.iter().fold(1.0, |size: f64, x| if x.is_nan() { f64::INFINITY } else { size.max(x.abs()) });
            if size > 1e6 {
                continue;
            }
            compared += 1;
            for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
                worst = worst.max((a - b).abs() / size);
                assert!(
                    (a - b).abs() <= 64.0 * f64::EPSILON * size,
                    "{text}\n in {of:?} at t = {t}, {x:?}, {theta:?}: {i}: {a}, not {b}"
                );
            }
        }
    }
    println!("largest difference: {worst:e}");
    assert!(compared > 25_000, "{compared}");
}
