//! Resets of the state of formulas.

use contact_geom::table::{Interpolation, Table};
use contact_geom::{Lagrangian, Symmetry, VelocityPoint, switching::Control};
use formula_lagrangian::{
    Direction, Formula, FormulaError, FormulaLagrangian, Graph, Operation, Reset, ResetNodes, Symbols, Variable,
};

const PARAMETERS: [(&str, f64); 2] = [("e", 0.75), ("w", 2.0)];

fn formula(text: &str) -> Formula {
    Formula::parse(text, &["x", "y"], &PARAMETERS).unwrap()
}

fn lagrangian(formula: &Formula) -> FormulaLagrangian<2> {
    formula.lagrangian().unwrap()
}

fn reset<'a>(when: &'a str, direction: Direction, then: &'a [(&'a str, &'a str)]) -> Reset<'a> {
    Reset { when, direction, then, rest: None }
}

fn point() -> VelocityPoint<2> {
    VelocityPoint::new([0.5, -1.0], [2.0, 4.0], 0.25)
}

fn replaced(l: &FormulaLagrangian<2>, index: usize) -> VelocityPoint<2> {
    match l.at_switch(index, 3.0, &point(), false) {
        Control::Replace(x) => x,
        other => panic!("{other:?}"),
    }
}

fn switches(l: &FormulaLagrangian<2>) -> Vec<f64> {
    let mut values = Vec::new();
    l.switching_functions(3.0, &point(), &mut values);
    values
}

#[test]
fn resets_follow_the_functions_of_kinks() {
    let with_kinks = formula("force[y] = -sign(y'); L = (x'^2 + y'^2)/2 - abs(x) + if(t > 5, x, 0)");
    assert_eq!((with_kinks.resets(), lagrangian(&with_kinks).resets()), (0, 0));
    let once = with_kinks.with_reset(reset("x - y", Direction::Falling, &[("x'", "-e*x'")])).unwrap();
    let twice = once.with_reset(reset("t - w", Direction::Rising, &[("z", "z + 1"), ("y'", "0")])).unwrap();
    let l = lagrangian(&twice);
    assert_eq!((twice.resets(), l.resets(), l.breaks()), (2, 2, [5.0].as_slice()));
    let found = switches(&l);
    assert_eq!((found.len(), &found[2..]), (4, [1.5, 1.0].as_slice()));
    assert_eq!([0, 1, 2, 3, 4, usize::MAX].map(|i| l.reset_of(i)), [None, None, Some(0), Some(1), None, None]);
    // Each with its direction, and the kinks with none.
    let at = |index, rising| l.at_switch(index, 3.0, &point(), rising);
    for (index, rising) in [(0, true), (1, false), (2, true), (3, false), (4, true), (9, false)] {
        assert_eq!(at(index, rising), Control::Continue, "{index}");
    }
    assert_eq!(at(2, false), Control::Replace(VelocityPoint::new([0.5, -1.0], [-1.5, 4.0], 0.25)));
    assert_eq!(at(3, true), Control::Replace(VelocityPoint::new([0.5, -1.0], [2.0, 0.0], 1.25)));
    let both = lagrangian(&formula("x'^2").with_reset(reset("x", Direction::Both, &[("x", "1")])).unwrap());
    for rising in [false, true] {
        assert!(matches!(both.at_switch(0, 0.0, &point(), rising), Control::Replace(x) if x.q[0] == 1.0));
    }
}

#[test]
fn all_values_are_assigned_at_once() {
    let of = |then: &[(&str, &str)]| {
        let base = formula("x'^2 + y'^2/2 - x - 3*z");
        replaced(&lagrangian(&base.with_reset(reset("x", Direction::Falling, then)).unwrap()), 0)
    };
    let VelocityPoint { q, v, z } = of(&[("x", "y"), ("y", "x"), ("x'", "y'"), ("y'", "x' + t"), ("z", "z*w")]);
    assert_eq!((q.as_slice(), v.as_slice(), z), ([-1.0, 0.5].as_slice(), [4.0, 5.0].as_slice(), 0.5));
    // By indices, by index in an array, and with definitions.
    let VelocityPoint { q, v, .. } = of(&[("0", "7"), ("q[1]", "8"), ("v[i]", "u = -v[i]; u + i")]);
    assert_eq!((q.as_slice(), v.as_slice()), ([7.0, 8.0].as_slice(), [-2.0, -3.0].as_slice()));
    // Energy v L_v - L and momenta.
    let VelocityPoint { q, z, .. } = of(&[("x", "p_x"), ("y", "p_y"), ("z", "energy")]);
    assert_eq!((q.as_slice(), z), ([4.0, 4.0].as_slice(), 4.0 + 8.0 + 0.5 + 0.75));
    let array = Formula::parse("sum(i, 0, n-1, u'[i]^2)", &["u[2]"], &[]).unwrap();
    let array = array.with_reset(reset("u[0]", Direction::Falling, &[("u'[i]", "-u'[i]"), ("u[1]", "3")])).unwrap();
    let VelocityPoint { q, v, .. } = replaced(&lagrangian(&array), 0);
    assert_eq!((q.as_slice(), v.as_slice()), ([0.5, 3.0].as_slice(), [-2.0, -4.0].as_slice()));
    // NaN is returned, and a coordinate in addition to those of the formula keeps its values.
    assert!(of(&[("x'", "sqrt(y)")]).v[0].is_nan());
    let wide = formula("x'^2").with_reset(reset("x", Direction::Falling, &[("x'", "-x'")])).unwrap();
    let x = VelocityPoint::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 7.0);
    let expected = VelocityPoint::new([1.0, 2.0, 3.0], [-4.0, 5.0, 6.0], 7.0);
    let l = wide.lagrangian_within::<3>().unwrap();
    assert_eq!(l.at_switch(0, 0.0, &x, false), Control::Replace(expected));
}

#[test]
fn resets_have_parameters_and_tables() {
    let table = Table::new(&[0.0, 4.0], &[0.0, 8.0], Interpolation::Linear).unwrap();
    let driven = formula("x'^2 + y'^2").with_table("drive", &table).unwrap();
    let kicked = driven.with_reset(reset("x - e", Direction::Falling, &[("x'", "w*drive(t)")])).unwrap();
    assert_eq!(kicked.used_parameters().collect::<Vec<_>>(), ["e", "w"]);
    let mut l = lagrangian(&kicked);
    assert_eq!((switches(&l), replaced(&l, 0).v[0]), (vec![-0.25], 12.0));
    l.set("e", 0.25).unwrap();
    l.set("w", 1.0).unwrap();
    assert_eq!((switches(&l), replaced(&l, 0).v[0]), (vec![0.25], 6.0));
    // A reset changes momenta.
    assert!(l.symmetries().is_empty());
    assert!(lagrangian(&driven).symmetries().iter().any(|s| matches!(s, Symmetry::Translation(_))));
    assert_eq!(l.structure(), lagrangian(&driven).structure());
}

#[test]
fn resets_of_graphs() {
    let mut graph = Graph::new();
    let (x, v, z) = (graph.position(0), graph.velocity(0), graph.action());
    let (l, minus) = (graph.binary(Operation::Mul, v, v), graph.unary(formula_lagrangian::Function::Neg, v));
    let constant = graph.number(2.0);
    let foreign = graph.clone().binary(Operation::Add, x, z);
    let base = Formula::from_graph(graph, l, &["x", "y"], &[]).unwrap();
    let nodes = |when, then: &[(Variable, formula_lagrangian::Id)]| {
        let then = then.to_vec();
        base.clone().with_reset_nodes(ResetNodes { when, direction: Direction::Falling, then, rest: None })
    };
    let found = replaced(&lagrangian(&nodes(x, &[(Variable::Velocity(0), minus), (Variable::Action, x)]).unwrap()), 0);
    assert_eq!(found, VelocityPoint::new([0.5, -1.0], [-2.0, 4.0], 0.5));
    let error = |found: Result<Formula, FormulaError>| found.unwrap_err();
    assert_eq!(error(nodes(foreign, &[(Variable::Action, x)])), FormulaError::ForeignNode);
    assert_eq!(error(nodes(x, &[(Variable::Action, foreign)])), FormulaError::ForeignNode);
    let unknown = FormulaError::Unknown { what: "velocity", index: 2, count: 2 };
    assert_eq!(error(nodes(x, &[(Variable::Velocity(2), x)])), unknown);
    for (reset, message) in [
        (nodes(x, &[]), "a reset assigns nothing; name a variable and its new value"),
        (
            nodes(constant, &[(Variable::Action, x)]),
            "a reset has a constant in place of a function that changes its sign",
        ),
        (nodes(x, &[(Variable::Action, x), (Variable::Action, v)]), "a reset assigns a variable twice"),
    ] {
        assert_eq!(error(reset).to_string(), message);
    }
    let symbols = Symbols::new(&["x", "y"], &[]).unwrap();
    let (x, v) = (symbols.position(0), symbols.velocity(0));
    let (l, minus) = (&v * &v, -&v);
    let then = vec![(Variable::Velocity(0), minus.id())];
    let reset = ResetNodes { when: x.id(), direction: Direction::Falling, then, rest: None };
    let bounce = symbols.formula(&l).unwrap().with_reset_nodes(reset).unwrap();
    assert_eq!(replaced(&lagrangian(&bounce), 0).v[0], -2.0);
}

#[test]
fn errors_in_resets() {
    let base = formula("x'^2 + y'^2");
    let error = |when, then: &[(&str, &str)]| base.with_reset(reset(when, Direction::Both, then)).unwrap_err();
    for (when, then, message) in [
        ("x - d", &[("x", "1")][..], "line 1, column 5: unknown name `d`"),
        ("x", &[("x'", "-e*\nxdot")], "line 2, column 1: unknown name `xdot`; did you mean `x'`?"),
        ("force[x] = 1; x", &[("x", "1")], "a force is a line of the text of a Lagrangian"),
    ] {
        let found = error(when, then);
        assert!(matches!(&found, FormulaError::Parse(_)) && found.to_string().contains(message), "{found}");
    }
    for (then, message) in [
        (&[("vx", "1")][..], "there is no coordinate `vx`; did you mean `x`?"),
        (&[("energy", "1")], "there is no coordinate `energy`; the coordinates are x, y"),
        (&[("x", "1"), ("q[0]", "2")], "this variable is assigned twice in one reset"),
        (&[("v[i]", "1"), ("y'", "2")], "this variable is assigned twice in one reset"),
        (&[("x''", "1")], "second derivative of `x`"),
        (&[("x + 1", "1")], "expected the end, found `+`"),
    ] {
        let found = error("x", then);
        assert!(matches!(&found, FormulaError::Target(_)) && found.to_string().contains(message), "{found}");
    }
    for (when, then, message) in [
        ("x", &[][..], "a reset assigns nothing; name a variable and its new value"),
        ("e - 1", &[("x", "1")], "a reset has a constant in place of a function that changes its sign"),
        ("sigma - 1", &[("x", "1")], "a reset contains the conformal factor, which is no function of the state"),
        ("x", &[("x", "log_factor")], "a reset contains the conformal factor, which is no function of the state"),
    ] {
        assert_eq!(error(when, then).to_string(), message);
    }
}
