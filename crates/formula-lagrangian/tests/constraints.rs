//! Holonomic constraints of formulas, in texts and as nodes.

use contact_geom::constraints::{Constraint, ConstraintDerivatives};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Parametric, Scalar};
use formula_lagrangian::{Direction, Formula, FormulaError, Function, Graph, Operation, Reset};

/// The same constraints as [`TEXTS`], in Rust.
struct Written {
    length: f64,
}

impl Constraint<3, 2> for Written {
    fn value<T: Scalar>(&self, q: &SVector<T, 3>) -> SVector<T, 2> {
        let [x, y, angle] = [q[0], q[1], q[2]];
        let r = (x * x + y * y).sqrt();
        SVector::from([r * r * r - self.length, x * angle.sin() - y * angle.cos() * 2.0 + angle.exp()])
    }
}

const TEXTS: [&str; 2] = ["r = sqrt(x^2 + y^2); r^3 = l", "x*sin(q[2]) - 2*y*cos(angle) + exp(angle)"];

fn free() -> Formula {
    let text = "(x'^2 + y'^2 + angle'^2)/2 - 9.81*y + gamma*z";
    Formula::parse(text, &["x", "y", "angle"], &[("l", 2.0), ("gamma", -0.1)]).unwrap()
}

/// Values, Jacobians and second derivatives of texts are those of the same functions in Rust, also with other values of
/// the parameters and with coordinates in addition. Values beyond the number of constraints are 0.
#[test]
fn constraints_are_those_in_rust() {
    let formula = free().with_constraints(&TEXTS).unwrap();
    assert_eq!((formula.constraints(), free().constraints()), (2, 0));
    assert!(formula.used_parameters().eq(["l", "gamma"]));
    let three = formula.lagrangian::<3>().unwrap();
    assert_eq!(three.count(), 2);
    let (q, v) = (SVector::from([0.7, -1.2, 0.4]), SVector::from([0.3, 2.0, -0.8]));
    // A few roundings of numbers up to 40.
    let tolerance = 64.0 * f64::EPSILON;
    for length in [2.0, 3.5] {
        let expected = Written { length };
        let l = three.with_parameters(&[length, -0.1]).unwrap();
        let (c, g) = l.with_jacobian(&q);
        let (c_expected, g_expected) = expected.with_jacobian(&q);
        assert!((c.fixed_rows::<2>(0) - c_expected).amax() < tolerance && c[2] == 0.0, "{c}");
        assert!((g.fixed_rows::<2>(0) - g_expected).amax() < tolerance && g.row(2).amax() == 0.0, "{g}");
        let [first, second] = l.along(&q, &v);
        let [first_expected, second_expected] = expected.along(&q, &v);
        assert!((first.fixed_rows::<2>(0) - first_expected).amax() < tolerance, "{first}");
        assert!((second.fixed_rows::<2>(0) - second_expected).amax() < 8.0 * tolerance, "{second}");
        let slope = l.force_slope(&q, &SVector::from([1.5, -0.5, 0.0]));
        let slope_expected = expected.force_slope(&q, &SVector::from([1.5, -0.5]));
        assert!((slope - slope_expected).amax() < 8.0 * tolerance, "{slope}");
    }
    let four = formula.lagrangian_within::<4>().unwrap();
    let (c, g) = four.with_jacobian(&SVector::from([0.7, -1.2, 0.4, 5.0]));
    assert!((c.fixed_rows::<2>(0) - Written { length: 2.0 }.value(&q)).amax() < tolerance);
    assert!(g.column(3).amax() == 0.0 && g.rows(2, 2).amax() == 0.0 && four.count() == 2);
}

/// The Jacobian in closed form, without a function in Rust between.
#[test]
fn the_jacobian_of_a_circle() {
    let circle = free().with_constraints(&["x^2 + y^2 - l^2"]).unwrap().lagrangian::<3>().unwrap();
    let (c, g) = circle.with_jacobian(&SVector::from([1.5, -2.0, 9.0]));
    assert_eq!(c, SVector::from([2.25, 0.0, 0.0]));
    assert_eq!(g, SMatrix::<f64, 3, 3>::from_row_slice(&[3.0, -4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

/// Nodes of a graph are the same constraints as a text, and are added to those that the formula has.
#[test]
fn constraints_as_nodes() {
    let mut graph = Graph::new();
    let (v, x, y) = (graph.velocity(0), graph.position(0), graph.position(1));
    let l = graph.binary(Operation::Mul, v, v);
    let (a, b) = (graph.binary(Operation::Mul, x, x), graph.unary(Function::Sin, y));
    let c = graph.binary(Operation::Sub, a, b);
    let t = graph.time();
    let moving = graph.binary(Operation::Sub, x, t);
    let kink = graph.unary(Function::Abs, y);
    let number = graph.number(3.0);
    let formula = Formula::from_graph(graph, l, &["x", "y", "w"], &[]).unwrap();
    let l = formula.clone().with_constraint_nodes(&[c]).unwrap().with_constraints(&["w = x"]).unwrap();
    let l = l.lagrangian::<3>().unwrap();
    assert_eq!(l.value(&SVector::from([3.0, 0.0, 1.0])), SVector::from([9.0, -2.0, 0.0]));
    for (node, part) in
        [(v, "velocities"), (moving, "does not depend on time"), (kink, "kink"), (number, "a coordinate")]
    {
        let error = formula.clone().with_constraint_nodes(&[node]).unwrap_err();
        assert!(matches!(error, FormulaError::Constraint { .. }) && error.to_string().contains(part), "{error}");
    }
}

/// What is no constraint is refused at its position in the text.
#[test]
fn texts_that_are_no_constraints() {
    for (text, column, part) in [
        ("x^2 + y'^2", 7, "not on velocities"),
        ("x + v[1]", 5, "not on velocities"),
        ("x = l*t", 7, "does not depend on time"),
        ("x - z", 5, "not on the action"),
        ("x - energy", 5, "unknown name `energy`"),
        ("x - teta", 5, "unknown name `teta`"),
        ("w = x", 1, "unknown name `w`"),
        ("abs(x) - 1", 1, "`abs` has a kink or a jump"),
        ("y + max(x, l)", 5, "`max` has a kink or a jump"),
        ("x + if(x < y, 1, 2)", 5, "`if` has a kink or a jump"),
        ("l = 2", 1, "does not depend on a coordinate"),
        ("x = x", 1, "does not depend on a coordinate"),
        ("x = y = l", 7, "expected an operator, found `=`"),
        ("x = 1; y = 2", 8, "a single equation"),
        ("x + ", 5, "expected a value"),
        ("", 1, "expected a value"),
        ("l = l; x", 8, "a single equation"),
    ] {
        match free().with_constraints(&["y - angle", text]) {
            Err(FormulaError::Parse(error)) => {
                assert_eq!((error.line, error.column), (1, column), "{text}: {error}");
                assert!(error.message.contains(part), "{text}: {error}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
}

/// There are fewer constraints than coordinates; a Hamiltonian has none, and neither has a formula with resets.
#[test]
fn formulas_without_constraints() {
    let error = free().with_constraints(&["x - l", "y", "angle"]).unwrap_err();
    assert_eq!(error, FormulaError::Constraints { found: 3, coordinates: 3 });
    let two = free().with_constraints(&["x - l", "y"]).unwrap();
    assert_eq!(two.with_constraints(&["angle"]).unwrap_err(), error);
    assert_eq!(free().with_constraints(&[]).unwrap().constraints(), 0);
    let names = formula_lagrangian::FormulaNames::new(&["x", "y"], &[]);
    let h = Formula::parse_hamiltonian("p_x^2 + p_y^2", &names).unwrap();
    assert!(matches!(h.with_constraints(&["x"]), Err(FormulaError::IsHamiltonian { .. })));
    let bounce = Reset { when: "x", direction: Direction::Falling, then: &[("x'", "-x'")], rest: None };
    let refused = |found: Result<Formula, FormulaError>| {
        assert!(found.unwrap_err().to_string().contains("cannot be combined with resets"));
    };
    refused(free().with_reset(bounce).unwrap().with_constraints(&["x - y"]));
    refused(two.with_reset(bounce));
    refused(two.with_impact("x", contact_geom::switching::Impact::Elastic, None));
}

/// A symmetry of L counts if the constraints are invariant under it as well.
#[test]
fn symmetries_of_constrained_formulas() {
    let count = |constraints: &[&str]| {
        let free = Formula::parse("(x'^2 + y'^2 + w'^2)/2", &["x", "y", "w"], &[]).unwrap();
        free.with_constraints(constraints).unwrap().lagrangian::<3>().unwrap().symmetries().len()
    };
    // Three translations and three rotations; the rotation about the axis of a cylinder and the translation along it.
    assert_eq!((count(&[]), count(&["x^2 + y^2 - 1"]), count(&["x*y^2 + w^3"])), (6, 2, 0));
}
