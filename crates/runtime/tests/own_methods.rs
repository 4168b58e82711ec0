//! Discrete Lagrangians that are given by formulas.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar};
use formula_lagrangian::{Graph, Inputs, Operation};
use herglotz_runtime::{
    AnyIntegrator, Formula, FormulaMethod, Motion, RuntimeError, Start, StepControl, Steps, System,
};

/// The midpoint rule `h L(t + h/2, (q0 + q1)/2, (q1 - q0)/h, z0)` of a formula.
fn midpoint(of: &Formula, coordinates: &[&str], parameters: &[(&str, f64)]) -> FormulaMethod {
    let mut graph = Graph::new();
    let (n, count) = (of.dimension() as u32, parameters.len() as u32);
    let (t, z, h, half) = (graph.time(), graph.action(), graph.parameter(count), graph.number(0.5));
    let later = graph.binary(Operation::Mul, half, h);
    let t = graph.binary(Operation::Add, t, later);
    let (mut q, mut v) = (Vec::new(), Vec::new());
    for i in 0..n {
        let (q0, q1) = (graph.position(i), graph.velocity(i));
        let sum = graph.binary(Operation::Add, q0, q1);
        q.push(graph.binary(Operation::Mul, half, sum));
        let moved = graph.binary(Operation::Sub, q1, q0);
        v.push(graph.binary(Operation::Div, moved, h));
    }
    let known: Vec<_> = (0..count).map(|k| graph.parameter(k)).collect();
    let l = graph.composed(of, Inputs { t, q: &q, v: &v, z, parameters: &known }).unwrap();
    let root = graph.binary(Operation::Mul, h, l);
    let parameters: Vec<(&str, f64)> = parameters.iter().copied().chain([("h", 1.0)]).collect();
    let formula = Formula::from_graph(graph, root, coordinates, &parameters).unwrap();
    FormulaMethod::new("own", 2, &formula, "h").unwrap()
}

/// Where L does not depend on z, it is the midpoint rule of the library: in one coordinate, and in five, of six that are
/// compiled.
#[test]
fn it_is_the_rule_of_the_library() {
    let five = ["a", "b", "c", "d", "e"];
    let chain = "sum(i, 0, n-1, v[i]^2)/2 - k*sum(i, 0, n-2, (q[i+1] - q[i])^2)/2 - sum(i, 0, n-1, cos(q[i] + t/5))";
    for (text, coordinates) in [("x'^2*(1 + x^2)/2 + k*cos(x - t/3)", &["x"][..]), (chain, &five[..])] {
        let parameters = [("k", 1.3)];
        let formula = Formula::parse(text, coordinates, &parameters).unwrap();
        let (system, method) = (System::new(&formula).unwrap(), midpoint(&formula, coordinates, &parameters));
        let n = coordinates.len();
        let q: Vec<f64> = (0..n).map(|i| 0.3 + 0.2 * i as f64).collect();
        let v: Vec<f64> = (0..n).map(|i| 0.1 - 0.05 * i as f64).collect();
        let by = "midpoint".parse::<AnyIntegrator>().unwrap();
        let motion = Motion::new(Start::new(0.0, q, v, 0.2), 2.0, StepControl::Steps { by, steps: Steps::Count(40) });
        let expected = system.run(&motion, &mut ()).unwrap();
        let found = system.run(&Motion { method: Some(method.clone()), ..motion.clone() }, &mut ()).unwrap();
        let pairs = found.q.iter().chain(&found.p).zip(expected.q.iter().chain(&expected.p));
        // Forty steps, each with the round-off of Newton's method.
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}, {expected:?}");
        assert!((found.z.unwrap() - expected.z.unwrap()).abs() < 1e-12);
        let check = system.check(&Motion { method: Some(method), ..motion }, 4).unwrap();
        assert!(check.is_contact() && check.integrator == "own");
        let of_theorems = check.statements.iter().map(|of| of.residual).fold(0.0, f64::max);
        assert!(of_theorems < 1e-9 && check.statements.is_empty() == (n > 4), "{:?}", check.statements);
    }
}

/// The graph of a formula at other nodes has its values, with all operations.
#[test]
fn a_composed_formula_has_its_values() {
    let text = "w = sin(x*y') + hypot(x, y)^3; L = if(x < y, w, w^k) + abs(x')/2 - max(y, t) + exp(-z)*tanh(k*y') + atan2(x, y)^2";
    let (coordinates, parameters) = (["x", "y"], [("k", 1.7)]);
    let formula = Formula::parse(text, &coordinates, &parameters).unwrap();
    let mut graph = Graph::new();
    let [q, v] = [[graph.position(0), graph.position(1)], [graph.velocity(0), graph.velocity(1)]];
    let (t, z, k) = (graph.time(), graph.action(), graph.parameter(0));
    // The coordinates and the velocities change places.
    let root = graph.composed(&formula, Inputs { t, q: &v, v: &q, z, parameters: &[k] }).unwrap();
    let swapped = Formula::from_graph(graph, root, &coordinates, &parameters).unwrap().lagrangian::<2>().unwrap();
    let plain = formula.lagrangian::<2>().unwrap();
    for i in 0..100 {
        let at = |s: f64| SVector::<f64, 2>::new(0.3 + (s * 1.3).sin(), 0.9 + 0.5 * (s * 0.7).cos());
        let (q, v, t, z) = (at(f64::from(i)), at(f64::from(i) + 0.5), 0.01 * f64::from(i), 0.2);
        let (a, b) = (swapped.value(t, &q, &v, z), plain.value(t, &v, &q, z));
        assert!(a == b || a.re().is_nan() && b.is_nan(), "{i}: {a}, {b}");
    }
}

/// What is no discrete Lagrangian of a system is refused.
#[test]
fn refusals() {
    let of = |text: &str, coordinates: &[&str]| Formula::parse(text, coordinates, &[("h", 1.0)]).unwrap();
    let method = |formula: &Formula| FormulaMethod::new("own", 1, formula, "h");
    assert!(matches!(FormulaMethod::new("own", 1, &of("h*(x' - x)^2", &["x"]), "k"), Err(RuntimeError::Formula(_))));
    let forced = of("(x' - x)^2/h", &["x"]).with_force("x", "1").unwrap();
    assert!(method(&forced).is_err_and(|error| error.to_string().contains("leave out forces")));
    let own = method(&of("(x' - x)^2/(2*h)", &["x"])).unwrap();
    let by = AnyIntegrator::Gauss { stages: 1 };
    let motion = |n: usize| Motion {
        method: Some(own.clone()),
        ..Motion::new(
            Start::new(0.0, vec![0.5; n], vec![0.1; n], 0.0),
            1.0,
            StepControl::Steps { by, steps: Steps::Count(4) },
        )
    };
    for (system, n, said) in [
        (of("(x'^2 + y'^2)/2", &["x", "y"]), 2, "has 1 coordinates, but the system has 2"),
        (of("x'^2/2", &["x"]).with_force("x", "-x'").unwrap(), 1, "without forces, constraints and resets"),
        (of("sum(i, 0, n-1, v[i]^2)/2", &["u[20]"]), 20, "methods of one's own"),
    ] {
        let error = System::new(&system).unwrap().run(&motion(n), &mut ()).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}
