//! Rust source of formulas, which is compiled here and compared bitwise with the formulas.

use contact_geom::{Derivatives, Dual, Lagrangian, Scalar, VelocityPoint, nalgebra::SVector};
use formula_lagrangian::{Formula, FormulaLagrangian};

#[rustfmt::skip]
#[path = "snapshots/all_functions.rs"]
mod all_functions;
#[rustfmt::skip]
#[path = "snapshots/kepler.rs"]
mod kepler;

const KEPLER: &str = "(x'^2 + y'^2)/2 + mu/sqrt(x^2 + y^2) + gamma*z";
/// All functions, and constants that depend on parameters.
const ALL: &str = "
    smooth = sin(x)*cos(y) + tan(x/2) + versine(y) + atan(y) + sinh(x) - cosh(y)/tanh(2 + x) + recip(3 - x)
    roots = sqrt(4 + x*y) + exp(-x)*expm1(y) + ln(3 + x) - log1p(x^2) + (2 + x)^0.3 + (3 + y)^type - x^3 + (2 + y)^-5 + x^7
    inverse = asinh(x)*atanh(y) + acosh(2 + x)
    kinks = abs(x - y) + sign(x)*y + min(x, y, 0.1)*max(x, 2*y) + atan2(x, y) + hypot(x, 1 - y) + if(x < y, x, 2 - y)
    constants = sin(type)*x + (type^2 + 1)/(2 + y) + (type - y) + t*type*hypot(type, 2)
    L = (2 + cos(x))*x'^2/2 + (y' - x*z)^2/2 + smooth + roots + inverse + kinks + constants";

fn all() -> FormulaLagrangian<2> {
    Formula::parse(ALL, &["x", "y"], &[("type", 0.7)]).unwrap().lagrangian().unwrap()
}

/// Compares a source with its snapshot. With `UPDATE` set in the environment the snapshot is written first.
fn check(text: &str, file: &str) {
    let path = format!("{}/tests/snapshots/{file}.rs", env!("CARGO_MANIFEST_DIR"));
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    assert_eq!(text, std::fs::read_to_string(path).unwrap(), "{file}: write it anew with UPDATE=1");
}

#[test]
fn the_source_is_what_was_looked_at() {
    let kepler = Formula::parse(KEPLER, &["x", "y"], &[("mu", 1.0), ("gamma", -0.01)]).unwrap();
    check(&kepler.lagrangian::<2>().unwrap().to_rust("DampedKepler").unwrap(), "kepler");
    check(&all().to_rust("AllFunctions").unwrap(), "all_functions");
    for bad in ["", "kepler", "Self", "A b", "1A", "A;"] {
        assert!(kepler.lagrangian::<2>().unwrap().to_rust(bad).is_err(), "{bad}");
    }
}

/// The value and the gradient at a point, with their derivatives along a direction.
fn numbers(l: &impl Lagrangian<2>, k: usize) -> Vec<u64> {
    let coordinate = |i: usize| ((k * 7 + i) as f64 * 0.618_033_988_749_894_9).fract() - 0.45;
    let moving = |i: usize| Dual { re: coordinate(i), d: SVector::<f64, 1>::new(coordinate(i + 3)) };
    let x = VelocityPoint::new([moving(0), moving(1)], [moving(2), moving(3)], moving(4));
    let (value, g) = (l.value(moving(5), &x.q, &x.v, x.z), l.gradient(moving(5), &x));
    let all = [value, g.x[0], g.x[1], g.y[0], g.y[1], g.z];
    all.iter().flat_map(|a| [a.re(), a.d[0]]).map(f64::to_bits).collect()
}

#[test]
fn the_compiled_source_is_the_formula_bit_by_bit() {
    let formula = Formula::parse(KEPLER, &["x", "y"], &[("mu", 1.5), ("gamma", -0.3)]).unwrap();
    let (formula, source) = (formula.lagrangian::<2>().unwrap(), kepler::DampedKepler { mu: 1.5, gamma: -0.3 });
    let every = all_functions::AllFunctions { type_: 0.7 };
    for k in 0..1000 {
        assert_eq!(numbers(&formula, k), numbers(&source, k));
        assert_eq!(numbers(&all(), k), numbers(&every, k), "{k}");
        let x = VelocityPoint::new([0.3, 0.2], [0.1, 0.4], 0.0);
        assert!(source.structure().defects(&source, 0.0, &x).unwrap().all(|d| d.size < 1e-13));
    }
    assert_eq!(source.structure(), formula.structure());
}
