//! Proved properties of formulas.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, OneParameterGroup, Symmetry, VelocityPoint};
use discrete_herglotz::{Problem, Steps, Until};
use formula_lagrangian::{Formula, FormulaLagrangian};

fn lagrangian(text: &str) -> FormulaLagrangian<2> {
    Formula::parse(text, &["x", "y"], &[("a", 0.5)]).unwrap().lagrangian().unwrap()
}

/// The claims in the order autonomous, z_free, z_affine, constant_rate, separable, quadratic, constant_mass, by their
/// first letters.
fn claims(text: &str) -> String {
    let s = lagrangian(text).structure();
    let all = [
        (s.autonomous, 'a'),
        (s.z_free, 'f'),
        (s.z_affine, 'z'),
        (s.constant_rate, 'r'),
        (s.separable, 's'),
        (s.quadratic, 'q'),
        (s.constant_mass, 'm'),
    ];
    all.iter().filter(|(made, _)| *made).map(|(_, letter)| *letter).collect()
}

#[test]
fn claims_are_those_that_hold() {
    let table = [
        ("(x'^2 + y'^2)/2 + cos(x) - a*z", "azrsm"),
        ("(x'^2 + y'^2)/2 - x^2 - x*y - a*z", "azrsqm"),
        ("(x'^2 + y'^2)/2 - x^2", "afzrsqm"),
        ("(x'^2 + x'*y' + a*y'^2)/2 - x^4", "afzrsm"),
        ("(x'^2 + y'^2)/2 - x^2 - a*z^2", "asm"),
        ("(x'^2 + y'^2)/2 - x^2 - x*z", "am"),
        ("(x'^2 + y'^2)/2 - t*x^2 - a*z", "zrsqm"),
        ("(x'^2 + y'^2)/2 - x^2 - t*z", "zsqm"),
        // A term linear in a velocity: a magnetic field, or a total derivative.
        ("(x'^2 + y'^2)/2 + x*y'", "afzrqm"),
        ("(x'^2 + y'^2)/2 + x' + x^3", "afzrm"),
        ("t*(x'^2 + y'^2)/2", "fzrq"),
        ("(2 + cos(x))*x'^2 + y'^2", "afzr"),
        // Kinks, which derivatives hide.
        ("(x'^2 + y'^2)/2 - abs(x)", "afzrsm"),
        ("(x'^2 + y'^2)/2 - abs(x')", "afzr"),
        ("(x'^2 + y'^2)/2 - abs(z)", "am"),
        ("(x'^2 + y'^2)/2 - sign(z)*x", "am"),
        ("(x'^2 + y'^2)/2 - if(y' < 1, x, 2*x)", "afzr"),
        ("(x'^2 + y'^2)/2 - sign(t)*z", "zsqm"),
        // Terms that vanish identically.
        ("(x'^2 + y'^2)/2 - x + 0*z^2 + (z - z)*x", "afzrsqm"),
    ];
    for (text, expected) in table {
        assert_eq!(claims(text), expected, "{text}");
    }
}

#[test]
fn a_rate_of_zero_is_seen_in_the_value_of_its_parameter() {
    let mut l = lagrangian("(x'^2 + y'^2)/2 + a*z");
    assert!(!l.structure().z_free);
    l.set("a", 0.0).unwrap();
    assert!(l.structure().z_free);
    l.set("a", -1.0).unwrap();
    assert!(!l.structure().z_free);
}

#[test]
fn coordinates_that_are_not_there_are_symmetries() {
    let along_y = lagrangian("(x'^2 + x^2*y'^2)/2 + 1/x").symmetries();
    assert!(matches!(along_y.as_slice(), [Symmetry::Translation(d)] if d[0] == 0.0 && d[1] == 1.0));
    assert!(lagrangian("x'^2 + y'^2 + x*y").symmetries().is_empty());
    assert!(lagrangian("x'^2").is_smooth() && !lagrangian("max(x, y)").is_smooth());
}

/// Whether the rotation of x and y is detected, and whether it is a symmetry. The latter is tested by the derivative of
/// L along it at a point without symmetry, which is round-off, a few units for each of some ten terms, or not.
fn rotation(text: &str) -> [bool; 2] {
    let l = lagrangian(text);
    let seen = l.symmetries().iter().any(|s| matches!(s, Symmetry::Rotation(0, 1)));
    let x = VelocityPoint::new([0.3, 0.71], [-0.4, 0.93], 0.2);
    let defect = Symmetry::<2>::Rotation(0, 1).symmetry_defect(&l, 0.6, &x);
    [seen, defect < 1e-14]
}

#[test]
fn rotations_are_seen_where_they_are_symmetries() {
    let symmetric = [
        "(x'^2 + y'^2)/2 + a/sqrt(x^2 + y^2) + t*z",
        "a*x'^2/2 + x^2 + cos(t) + y^2 + a*y'^2/2",
        "(x'^2 + y'^2)/2 + a*(x*y' - y*x')/2",
        "(x'^2 + y'^2)/2 - (x*x' + y*y')^2/(1 + hypot(x, y))",
        "r = sqrt(x^2 + y^2)\n (x'^2 + y'^2)*(1 + r^3) - sin(r) - z*(x^2 + y^2)/a",
    ];
    for text in symmetric {
        assert_eq!(rotation(text), [true, true], "{text}");
    }
    let others = [
        "(x'^2 + 2*y'^2)/2 + x^2 + y^2",
        "(x'^2 - y'^2)/2",
        "(x'^2 + y'^2)/2 + x*y' + y*x'",
        "(x'^2 + y'^2)/2 + x*y",
        "(x'^2 + y'^2)/2 + x",
        "(x'^2 + y'^2)/2 + a*x^2 + t*y^2",
        "(x'^2 + y'^2)/2 + x^2/a + y^2*a",
        "(x'^2 + y'^2)/2 + sqrt(x^2 + y'^2)",
        "(x'^2 + y'^2)/2 + x*x' - y*y'",
        "(x'^2 + y'^2)/2 + hypot(x, y')",
        "(x'^2 + y'^2)/2 + x^2*y^2",
    ];
    for text in others {
        assert_eq!(rotation(text), [false, false], "{text}");
    }
    // A symmetry that is not detected.
    assert_eq!(rotation("x'^2 + y'^2 + (x + y)^2 + (x - y)^2"), [false, true]);
    // All three rotations in space.
    let text = "(x'^2 + y'^2 + w'^2)/2 + 1/sqrt(x^2 + y^2 + w^2)";
    let space = Formula::parse(text, &["x", "y", "w"], &[]).unwrap().lagrangian::<3>().unwrap();
    assert_eq!(space.symmetries().len(), 3);
}

/// The symmetries of a formula of bodies in the plane or in space. All of them must leave L invariant, to some hundred
/// roundings of its terms.
fn of_bodies<const N: usize>(text: &str, names: &[&str]) -> Vec<Symmetry<N>> {
    let l = Formula::parse(text, names, &[("g", 2.0)]).unwrap().lagrangian::<N>().unwrap();
    let of = |i: usize, seed: f64| ((i as f64 + 1.0) * seed).sin();
    let (q, v) = (SVector::from_fn(|i, _| of(i, 2.7)), SVector::from_fn(|i, _| of(i, 4.1)));
    let seen = l.symmetries();
    for symmetry in &seen {
        let defect = symmetry.symmetry_defect(&l, 0.6, &VelocityPoint { q, v, z: 0.2 });
        assert!(defect < 1e-13, "{text}: {symmetry:?} off by {defect:e}");
    }
    seen
}

#[test]
fn symmetries_of_bodies_are_seen() {
    let kinetic = "(3*(a'^2 + b'^2) + g*(c'^2 + d'^2))/2";
    let names = ["a", "b", "c", "d"];
    let together = |moved: [f64; 4]| Symmetry::Translation(SVector::from(moved));
    let turned = Symmetry::rotations(&[(0, 1), (2, 3)]).unwrap();
    let both = |potential: &str| of_bodies::<4>(&format!("{kinetic} + {potential}"), &names);
    let all = vec![together([1.0, 0.0, 1.0, 0.0]), together([0.0, 1.0, 0.0, 1.0]), turned];
    assert_eq!(both("g/sqrt((a - c)^2 + (b - d)^2) + 0.3*z"), all);
    // The differences with other signs and factors; by a length; and with a magnetic force between the bodies.
    assert_eq!(both("g/sqrt((2*a - 2*c)^2/4 + (d - b)^2) + (a - c)^2 + (b - d)^2"), all);
    assert_eq!(both("exp(-hypot(a - c, d - b))"), all);
    assert_eq!(both("(a - c)*(b' - d') - (b - d)*(a' - c') + cos(t)*(a'*c' + b'*d')"), all);
    // With a fixed centre there is a rotation but no translation.
    assert_eq!(both("1/sqrt(a^2 + b^2) + 1/sqrt(c^2 + d^2) + 1/hypot(a - c, b - d)"), [turned]);
    // In a uniform field the translation perpendicular to it remains; in a trap no symmetry remains.
    assert_eq!(both("1/hypot(a - c, b - d) - 9.81*(3*b + g*d)"), [together([1.0, 0.0, 1.0, 0.0])]);
    assert_eq!(both("1/hypot(a - c, b - d) - a^2 - 2*b^2"), []);
    // No rotations: unequal factors, opposite signs, products of other pairs.
    let still = vec![all[0], all[1]];
    for potential in
        ["(a - c)^2 + 2*(b - d)^2", "(a - c)^2 - (b - d)^2", "(a - c)*(b - d)", "(a - c)^2 + (b - d)*(b' - d')"]
    {
        assert_eq!(both(potential), still, "{potential}");
    }
    // Three bodies in space: three translations and three rotations.
    let text = "sum(i, 0, 2, x'[i]^2 + y'[i]^2 + w'[i]^2)/2 + sum(i, 1, 2, 1/sqrt((x[0] - x[i])^2 + (y[0] - y[i])^2 + (w[0] - w[i])^2))";
    let seen = of_bodies::<9>(text, &["x[3]", "y[3]", "w[3]"]);
    let rotations = seen.iter().filter(|s| matches!(s, Symmetry::Rotations(_))).count();
    assert_eq!((seen.len(), rotations), (6, 3), "{seen:?}");
}

#[test]
fn a_plan_says_that_the_structure_is_proved() {
    let l = lagrangian("(x'^2 + y'^2)/2 + cos(x) - a*z");
    let problem = Problem::new(&l, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 1.0], 0.0)).unwrap();
    let plan = problem.steps(Steps::Size(0.1)).plan(Until::Time(1.0)).unwrap().to_string();
    assert!(plan.contains("checks of the structure: the structure is proved from the formula of L"), "{plan}");
    assert_eq!(*problem.structure(), l.structure());
}

/// A Lagrangian that is not regular, or not defined at the start, is a typed error.
#[test]
fn bad_starts_are_refused() {
    let start = VelocityPoint::new([1.0, 0.0], [0.0, 1.0], 0.0);
    for bad in ["x'^2/2 + y'", "x'^2 + y'^2 + ln(y)", "x'^2 + y'^2 + 1/y", "x'*y + y'*x"] {
        assert!(Problem::new(&lagrangian(bad), 0.0, start).is_err(), "{bad}");
    }
}
