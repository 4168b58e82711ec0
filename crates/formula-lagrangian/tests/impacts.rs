//! Impacts of formulas, and the state where resets accumulate.

use contact_geom::nalgebra::SVector;
use contact_geom::switching::{Control, Impact, Impacts, Surface};
use contact_geom::{Lagrangian, Scalar, VelocityPoint};
use discrete_herglotz::{GaussCollocation, Problem, Resets, Status, Steps, Until};
use formula_lagrangian::{Direction, Formula, FormulaError, Reset, ResetNodes, Variable};

/// A moving curved wall.
struct Wall;
impl Surface<2> for Wall {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>) -> T {
        q[1] - q[0] * q[0] * 0.5 + (t * 2.0).sin() * 0.25
    }
}

const WALL: &str = "y - x^2/2 + sin(2*t)/4";

fn formula() -> Formula {
    let text = "(x'^2 + (1 + x^2)*y'^2 + x'*y')/2 + a*y'^4/4 - g*y + gamma*z";
    Formula::parse(text, &["x", "y"], &[("a", 0.3), ("g", 9.81), ("gamma", -0.2)]).unwrap()
}

/// The state after an impact is that of the same law on the same surface in Rust, for all laws.
#[test]
fn impacts_are_those_of_surfaces() {
    let (t, x) = (0.7, VelocityPoint::new([0.4, -0.3], [1.5, -2.0], 0.8));
    for law in [Impact::Elastic, Impact::Restitution(0.7), Impact::Restitution(1.0), Impact::Conformal(0.64)] {
        let impact = formula().with_impact(WALL, law, None).unwrap();
        let l = impact.lagrangian::<2>().unwrap();
        let expected = Impacts::new(formula().lagrangian::<2>().unwrap(), Wall, law).at_switch(0, t, &x, false);
        let (a, b) = match (l.at_switch(0, t, &x, false), expected) {
            (Control::Replace(a), Control::Replace(b)) => (a, b),
            (Control::Conformal { to: a, factor }, Control::Conformal { to: b, factor: f }) if factor == f => (a, b),
            other => panic!("{other:?}"),
        };
        assert!((a.v - b.v).amax() < 1e-14 && a.q == b.q && (a.z - b.z).abs() < 1e-15, "{law:?}: {a:?} {b:?}");
        assert_eq!(l.at_switch(0, t, &x, true), Control::Continue);
        assert_eq!(impact.has_conformal_impacts(), law == Impact::Conformal(0.64));
        assert_eq!(impact.has_noncontact_resets(), law == Impact::Restitution(0.7));
        // With one more coordinate at rest.
        let wider = impact.lagrangian_within::<3>().unwrap();
        let at = VelocityPoint::new([0.4, -0.3, 0.0], [1.5, -2.0, 0.0], 0.8);
        match wider.at_switch(0, t, &at, false) {
            Control::Replace(to) | Control::Conformal { to, .. } => {
                assert!((to.v.fixed_rows::<2>(0) - a.v).amax() < 1e-14 && to.v[2] == 0.0, "{to:?}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn what_is_no_impact_is_refused() {
    let refused = |when: &str, law| formula().with_impact(when, law, None).unwrap_err().to_string();
    for when in ["x'", "y - z", "x + 0*t + energy"] {
        assert!(refused(when, Impact::Elastic).contains("velocities or z"), "{when}");
    }
    assert!(refused("g", Impact::Elastic).contains("a constant"));
    for e in [-0.1, 1.1, f64::NAN] {
        assert!(refused("x", Impact::Restitution(e)).contains("outside of 0 to 1"), "{e}");
    }
    for factor in [0.0, -0.5, 1.5, f64::NAN] {
        assert!(refused("x", Impact::Conformal(factor)).contains("at most 1"), "{factor}");
    }
    assert!(matches!(formula().with_impact("xx", Impact::Elastic, None), Err(FormulaError::Parse(_))));
}

/// A ball that bounces with restitution comes to rest at a time in closed form. A coordinate that is at rest but for
/// resets then says that it lies.
#[test]
fn a_motion_continues_from_its_rest() {
    let text = "force[x] = if(m < 0.5, -g, 0); L = (x'^2 + m'^2)/2";
    let ball = Formula::parse(text, &["x", "m"], &[("g", 2.0), ("e", 0.5)]).unwrap();
    let bounce = Reset { when: "x", direction: Direction::Falling, then: &[("x'", "-e*x'")], rest: None };
    let still: &[(&str, &str)] = &[("x", "0"), ("x'", "0"), ("m", "1")];
    // Falls for 1, and flies for 2 e^k v/g.
    let end = 1.0 + 2.0 * 0.5 / (1.0 - 0.5);
    for (formula, rests) in [
        (ball.with_reset(bounce).unwrap(), false),
        (ball.with_reset(Reset { rest: Some(still), ..bounce }).unwrap(), true),
        (ball.with_impact("x", Impact::Restitution(0.5), Some(still)).unwrap(), true),
    ] {
        let l = formula.lagrangian::<2>().unwrap();
        let problem = Problem::new(&l, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0)).unwrap();
        let mut resets = Resets::new();
        let run = problem.by(GaussCollocation { stages: 3 }).steps(Steps::Size(0.1)).observe(&mut resets);
        let outcome = run.run(Until::Time(5.0)).unwrap();
        if rests {
            assert_eq!((outcome.status, outcome.t), (Status::Completed, 5.0));
            assert_eq!((outcome.q.as_slice(), outcome.p.as_slice()), ([0.0, 1.0].as_slice(), [0.0; 2].as_slice()));
            assert!((resets.resets.last().unwrap().t - end).abs() < 1e-9, "{:?}", resets.resets.last());
        } else {
            assert!(outcome.status.to_string().contains("accumulate at t = "), "{}", outcome.status);
            assert!(outcome.t <= end && outcome.t > end - 0.2, "{}", outcome.t);
        }
    }
}

/// Expressions where resets accumulate are those of the state after the last reset, and the parameters in them count
/// as used.
#[test]
fn rest_is_a_list_of_new_values() {
    let base = Formula::parse("x'^2/2 - x", &["x"], &[("w", 3.0)]).unwrap();
    let rest: &[(&str, &str)] = &[("z", "x' + w"), ("x'", "0")];
    let reset = Reset { when: "x", direction: Direction::Falling, then: &[("x'", "-x'/2")], rest: Some(rest) };
    let formula = base.with_reset(reset).unwrap();
    assert_eq!(formula.used_parameters().collect::<Vec<_>>(), ["w"]);
    let mut l = formula.lagrangian::<1>().unwrap();
    let at = VelocityPoint::new([0.0], [1.0], 0.0);
    assert_eq!(l.at_accumulation(0, 0.0, &at), Control::Replace(VelocityPoint::new([0.0], [0.0], 4.0)));
    l.set("w", 5.0).unwrap();
    assert_eq!(l.at_accumulation(0, 0.0, &at), Control::Replace(VelocityPoint::new([0.0], [0.0], 6.0)));
    assert_eq!(l.at_accumulation(1, 0.0, &at), Control::Continue);
    let twice: &[(&str, &str)] = &[("x", "0"), ("q[0]", "1")];
    assert!(matches!(base.with_reset(Reset { rest: Some(twice), ..reset }), Err(FormulaError::Target(_))));
    let mut graph = formula_lagrangian::Graph::new();
    let (x, v) = (graph.position(0), graph.velocity(0));
    let of = Formula::from_graph(graph, v, &["x"], &[]).unwrap();
    let nodes = ResetNodes { when: x, direction: Direction::Both, then: vec![(Variable::Action, v)], rest: None };
    let unknown = ResetNodes { rest: Some(vec![(Variable::Position(1), x)]), ..nodes.clone() };
    assert!(of.clone().with_reset_nodes(nodes).is_ok());
    assert!(matches!(of.with_reset_nodes(unknown), Err(FormulaError::Unknown { what: "coordinate", .. })));
}
