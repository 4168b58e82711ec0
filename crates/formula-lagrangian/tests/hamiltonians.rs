//! Contact Hamiltonians as text: values and derivatives against hand-written ones, proved structure, names, refusals.

use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, ContactHamiltonian, HamiltonianDerivatives, HamiltonianStructure, OfHamiltonian,
    ParametricHamiltonian, PhasePoint, Scalar,
};
use formula_lagrangian::{Direction, Formula, FormulaError, FormulaNames, Reset, Symbols};

/// A Hamiltonian that depends on all variables in a nonlinear way; its derivatives are automatic.
struct ByHand;

impl ContactHamiltonian<2> for ByHand {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        let kinetic = (p[0] * p[0] + p[1] * p[1] * (q[0] * q[0] + 1.0) + 1.0).sqrt();
        kinetic + q[0] * q[1] * t.sin() - z * (q[1] * 0.5).exp() * p[0] + z * z * 0.25
    }
}

/// The same as a text.
const TEXT: &str = "sqrt(p_x^2 + p_y^2*(x^2 + 1) + 1) + x*y*sin(t) - z*exp(y/2)*p_x + c*z^2";

fn parse(text: &str, coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<Formula, FormulaError> {
    Formula::parse_hamiltonian(text, &FormulaNames::new(coordinates, parameters))
}

fn point() -> PhasePoint<2> {
    PhasePoint::new([0.7, -1.3], [0.4, 2.1], 0.6)
}

/// The bound on differences: the operations of the two expressions round differently, some ten times.
const ROUND_OFF: f64 = 32.0 * f64::EPSILON;

#[test]
fn derivatives_are_those_of_the_hamiltonian_that_is_written_by_hand() -> Result<(), FormulaError> {
    let h = parse(TEXT, &["x", "y"], &[("c", 0.25)])?.hamiltonian::<2>()?;
    let (t, x) = (0.9, point());
    let ((value, d), (by_hand, of_hand)) = (h.with_gradient(t, &x), ByHand.with_gradient(t, &x));
    assert!((value - by_hand).abs() < ROUND_OFF * by_hand.abs(), "{value} {by_hand}");
    assert_eq!(h.value(t, &x.q, &x.p, x.z), value);
    assert!(d.minus(of_hand).amax() < ROUND_OFF * of_hand.amax(), "{d:?} {of_hand:?}");
    let (second, of_hand) = (h.hessian(t, &x), ByHand.hessian(t, &x));
    let size = of_hand.qq.amax().max(of_hand.vv.amax());
    let differences = [second.qq - of_hand.qq, second.qv - of_hand.qv, second.vv - of_hand.vv];
    assert!(differences.iter().all(|m| m.amax() < ROUND_OFF * size), "{differences:?}");
    let vectors = [second.qz - of_hand.qz, second.vz - of_hand.vz];
    assert!(vectors.iter().all(|v| v.amax() < ROUND_OFF * size), "{vectors:?}");
    assert!((second.zz - of_hand.zz).abs() < ROUND_OFF);
    Ok(())
}

#[test]
fn unused_coordinates_stay_at_rest() -> Result<(), FormulaError> {
    let h = parse("p_x*z + x^2", &["x"], &[])?.hamiltonian_within::<2>()?;
    let field = h.contact_field(0.0, &PhasePoint::new([3.0, 0.0], [2.0, 0.0], 5.0));
    // x' = z, p' = -2 x - p p, z' = p z - H = -x^2.
    assert_eq!(field, ChartVector { x: [5.0, 0.0].into(), y: [-10.0, 0.0].into(), z: -9.0 });
    Ok(())
}

#[test]
fn structure_is_proved() -> Result<(), FormulaError> {
    let of = |text: &str| parse(text, &["x", "y"], &[("g", -0.1)])?.hamiltonian::<2>();
    let base = HamiltonianStructure { autonomous: true, ..HamiltonianStructure::default() };
    let affine = HamiltonianStructure { z_affine: true, constant_rate: true, ..base };
    let cases = [
        // (text, structure)
        ("p_x^2/2 + x^2/2 - g*z", HamiltonianStructure { separable: true, degree: Some(2), ..affine }),
        ("cosh(p_x) + x^2", HamiltonianStructure { separable: true, z_free: true, ..affine }),
        (
            "p_x^2/2 + sin(t)*x + z^2",
            HamiltonianStructure { autonomous: false, separable: true, degree: Some(2), ..base },
        ),
        ("p_x*z - x + x^2*z", HamiltonianStructure { degree: Some(1), ..base }),
        ("sqrt(p_x^2 + p_y^2)/(1 + x^2)", HamiltonianStructure { z_free: true, homogeneous: true, ..affine }),
        ("hypot(p_x, p_y)*exp(z)", HamiltonianStructure { homogeneous: true, ..base }),
        ("p_x*y - p_y*x", HamiltonianStructure { z_free: true, degree: Some(1), homogeneous: true, ..affine }),
        ("p_x^2/p_y + x*p_x", HamiltonianStructure { z_free: true, homogeneous: true, ..affine }),
        ("(p_x + 1)^3*x + p_y", HamiltonianStructure { z_free: true, degree: Some(3), ..affine }),
    ];
    for (text, expected) in cases {
        let h = of(text)?;
        assert_eq!(h.structure(), expected, "{text}");
        // The claims hold at a point, and a wrong one is found there.
        assert_eq!(expected.defect(&h, 0.3, &point()), None, "{text}");
        let wrong = HamiltonianStructure { homogeneous: true, degree: Some(0), ..expected };
        assert!(wrong.defect(&h, 0.3, &point()).is_some(), "{text}");
    }
    // A kink in p hides a product of p and x in the derivatives.
    assert!(!of("sign(p_x*x)")?.structure().separable);
    Ok(())
}

#[test]
fn a_parameter_changes_values_and_the_rate() -> Result<(), FormulaError> {
    let mut h = parse("p_x^2/2 - g*z", &["x"], &[("g", -0.1)])?.hamiltonian::<1>()?;
    assert_eq!(h.constant_rate(), Some(-0.1));
    h.set("g", 0.0)?;
    assert_eq!((h.constant_rate(), h.structure().z_free, h.cyclic()), (Some(0.0), true, vec![0]));
    assert!(h.set("k", 1.0).is_err());
    Ok(())
}

#[test]
fn the_action_and_the_momenta_have_names_of_the_user() -> Result<(), FormulaError> {
    let coordinates = ["x", "y", "z"];
    let names = FormulaNames { action: "s", ..FormulaNames::new(&coordinates, &[]) };
    let l = Formula::parse_lagrangian("(x'^2 + y'^2 + z'^2)/2 - z - 0.1*s", &names)?;
    assert_eq!((l.dimension(), l.action(), l.has_action()), (3, "s", true));
    assert_eq!(l.lagrangian::<3>()?.constant_rate(), Some(-0.1));
    assert_eq!(l.expression("z' + s + p_z")?.at(0.0, &[0.0; 3], &[0.0, 0.0, 2.0], 5.0), 9.0);
    let momenta = ["l", "p[2]"];
    let names = FormulaNames { momenta: &momenta, ..FormulaNames::new(&["theta", "q[2]"], &[]) };
    let h = Formula::parse_hamiltonian("l^2/2 + sum(i, 0, 1, p[i]^2)/2 + p[1]*q[1] + z*theta", &names)?;
    assert_eq!(h.momenta(), ["l", "p[0]", "p[1]"]);
    let (_, d) = h.hamiltonian::<3>()?.with_gradient(0.0, &PhasePoint::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 7.0));
    assert_eq!(d, ChartVector { x: [7.0, 0.0, 6.0].into(), y: [4.0, 5.0, 9.0].into(), z: 1.0 });
    // By index, whatever the names.
    let by_index = parse("p[0]*p[1] + q[0]", &["x", "y"], &[])?.hamiltonian::<2>()?;
    assert_eq!(by_index.value(0.0, &[1.0, 0.0].into(), &[2.0, 3.0].into(), 0.0), 7.0);
    Ok(())
}

#[test]
fn expressions_have_velocities_and_the_energy_of_the_hamiltonian() -> Result<(), FormulaError> {
    let formula = parse("H = p_x^2*y + x*z", &["x", "y"], &[])?;
    let at = |text: &str| Ok::<_, FormulaError>(formula.expression(text)?.at(0.0, &[2.0, 3.0], &[4.0, 5.0], 6.0));
    assert_eq!(at("x'")?, 24.0);
    assert_eq!(at("y' + v[0]")?, 24.0);
    assert_eq!(at("energy - p_x^2*y - x*z + p_y")?, 5.0);
    assert_eq!(formula.expression("p_x/sigma")?.at_factor(0.0, (&[2.0, 3.0], &[4.0, 5.0], 6.0), 0.0), 4.0);
    Ok(())
}

#[test]
fn symbols_build_hamiltonians() -> Result<(), FormulaError> {
    let names = FormulaNames::new(&["x"], &[("g", -0.5)]);
    let symbols = Symbols::of_hamiltonian(&names)?;
    let (x, p, z) = (symbols.position(0), symbols.momentum(0), symbols.action());
    let h = &p * &p * 0.5 + x.cos() - symbols.parameter("g")? * z;
    let h = symbols.formula(&h)?.hamiltonian::<1>()?;
    assert_eq!(h.value(0.0, &[0.0].into(), &[2.0].into(), 4.0), 5.0);
    Ok(())
}

#[test]
fn a_regular_hamiltonian_is_a_lagrangian() -> Result<(), FormulaError> {
    use contact_geom::Lagrangian;
    let l = OfHamiltonian(parse("p_x^2/4 + x^2 + 0.1*z", &["x"], &[])?.hamiltonian::<1>()?);
    // L = v^2 - x^2 - z/10.
    let value: f64 = l.value(0.0, &[2.0].into(), &[3.0].into(), 1.0);
    assert!((value - 4.9).abs() < 4.0 * f64::EPSILON * 5.0, "{value}");
    Ok(())
}

#[test]
fn invalid_input_is_refused_with_the_remedy() -> Result<(), FormulaError> {
    let refused = |text: &str, names: &FormulaNames<'_>| match Formula::parse_hamiltonian(text, names) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    };
    let xy = ["x", "y"];
    let names = FormulaNames::new(&xy, &[]);
    let cases = [
        ("x'^2/2", names, "a Hamiltonian depends on momenta, not on velocities; write `p_x`"),
        ("v[1]^2/2", names, "a Hamiltonian depends on momenta, not on velocities; write `p_y`"),
        ("p_x'", names, "`p_x` is a momentum: only coordinates have a velocity"),
        ("p_x^2 + p_w", names, "unknown name `p_w`; did you mean `p_x`?"),
        ("force[x] = 1; p_x", names, "not of a Hamiltonian"),
        ("rayleigh = p_x^2; p_x", names, "write the drag as a term in z"),
        ("p_x = 2; x", names, "the name `p_x` is in use"),
        ("L = p_x", names, "expected a value after the definition of `L`"),
        ("p_x + z'", names, "the rate of `z` is `p . H_p - H`"),
        ("p_x", FormulaNames { action: "x", ..names }, "\"x\" is that of the action"),
        ("p_x", FormulaNames { action: "sin", ..names }, "\"sin\" is reserved"),
        ("p_x + z", FormulaNames { action: "s", ..names }, "the action is `s` here"),
        ("p", FormulaNames { momenta: &["p"], ..names }, "there are names of 1 momenta for 2 coordinates"),
        ("p", FormulaNames { momenta: &["p", "p"], ..names }, "\"p\" is given twice"),
        ("p", FormulaNames { momenta: &["p", "y"], ..names }, "\"y\" is given twice"),
        ("p", FormulaNames { momenta: &["p", "z"], ..names }, "\"z\" is that of the action"),
        ("x", FormulaNames { parameters: &[("p_x", 1.0)], ..names }, "\"p_x\" is that of a momentum"),
        ("x", FormulaNames { coordinates: &["x", "p_x"], ..names }, "\"p_x\" is given twice"),
    ];
    for (text, names, message) in cases {
        let found = refused(text, &names);
        assert!(found.contains(message), "{text}: {found}");
    }
    let h = parse("p_x^2/2", &["x"], &[])?;
    let reset = Reset { when: "x", direction: Direction::Both, then: &[("x", "0")], rest: None };
    let refusals = [
        h.lagrangian::<1>().map(drop),
        h.with_force("x", "1").map(drop),
        h.with_rayleigh("x").map(drop),
        h.with_reset(reset).map(drop),
    ];
    for refusal in refusals {
        assert!(matches!(refusal, Err(FormulaError::IsHamiltonian { .. })), "{refusal:?}");
    }
    assert_eq!(h.with_breaks(&[2.0, 1.0])?.hamiltonian::<1>()?.breaks(), [1.0, 2.0]);
    let l = Formula::parse("x'^2/2", &["x"], &[])?;
    assert_eq!(l.hamiltonian::<1>().map(drop), Err(FormulaError::IsLagrangian));
    assert_eq!(h.hamiltonian::<2>().map(drop), Err(FormulaError::OtherDimension { found: 1, asked: 2 }));
    Ok(())
}

/// The value for other parameters is that of the formula with these parameters.
#[test]
fn the_value_at_parameters() {
    let formula = parse("k*p_x*sin(x) + c*z*x", &["x"], &[("k", 1.5), ("c", 0.2)]).unwrap();
    let of = formula.hamiltonian::<1>().unwrap();
    assert_eq!((of.parameter_names(), of.parameters()), (vec!["k".to_owned(), "c".to_owned()], vec![1.5, 0.2]));
    let (theta, t, q, p, z) = ([0.7, -0.4], 0.1, [0.3].into(), [0.9].into(), 0.6);
    let other = of.with_parameters(&theta).unwrap();
    let (found, expected) = (of.value_at(&theta, t, &q, &p, z), 0.7 * 0.9 * 0.3_f64.sin() - 0.4 * 0.6 * 0.3);
    assert!((found - expected).abs() <= 2.0 * f64::EPSILON, "{found} and {expected}");
    assert!((other.value(t, &q, &p, z) - expected).abs() <= 2.0 * f64::EPSILON);
    assert!(of.with_parameters(&[1.0]).is_none() && of.with_parameters(&[1.0, f64::NAN]).is_none());
}
