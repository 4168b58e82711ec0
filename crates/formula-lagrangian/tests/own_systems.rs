//! Systems of a user's own against formulas of the same systems.

use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_or_nan;
use contact_geom::{Hints, VelocityPoint};
use discrete_herglotz::sensitivity::Variable;
use discrete_herglotz::{
    AtSwitch, Components, ForceDerivatives, GaussCollocation, Point, Problem, SecondDerivatives, Status, Steps, System,
    SystemProblem, Until, Vector,
};
use formula_lagrangian::{Direction, Formula, Reset};
use std::rc::Rc;

/// A ball over a floor, `L = v^2/2 - g q - z/10`, with the force `-c v^3`; at the floor the velocity is multiplied by -4/5.
#[derive(Clone)]
struct Ball {
    g: f64,
    c: f64,
}

impl System for Ball {
    fn dimension(&self) -> usize {
        1
    }
    fn hints(&self) -> Hints {
        Hints { switching_functions: true, ..Hints::NONE }
    }
    fn has_force(&self) -> bool {
        true
    }
    fn value(&self, _t: f64, x: &Point) -> f64 {
        0.5 * x.v[0] * x.v[0] - self.g * x.q[0] - 0.1 * x.z
    }
    fn gradient(&self, _t: f64, x: &Point) -> Components {
        Components { x: [-self.g].into(), y: x.v.clone(), z: -0.1 }
    }
    fn hessian(&self, _t: f64, _x: &Point) -> SecondDerivatives {
        let (of, zero) = (|x: f64| DMatrix::from_element(1, 1, x), Vector::zeros(1));
        SecondDerivatives { qq: of(0.0), qv: of(0.0), vv: of(1.0), qz: zero.clone(), vz: zero, zz: 0.0 }
    }
    fn applied_force(&self, _t: f64, x: &Point) -> Vector {
        [-self.c * x.v[0].powi(3)].into()
    }
    fn force_derivatives(&self, t: f64, x: &Point) -> Option<ForceDerivatives> {
        let of = |x: f64| DMatrix::from_element(1, 1, x);
        let v = of(-3.0 * self.c * x.v[0].powi(2));
        Some(ForceDerivatives { value: self.applied_force(t, x), q: of(0.0), v, z: Vector::zeros(1) })
    }
    fn switching_functions(&self, _t: f64, x: &Point, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
    fn at_switch(&self, _index: usize, _t: f64, x: &Point, rising: bool) -> AtSwitch {
        match rising {
            true => AtSwitch::Continue,
            false => AtSwitch::Replace { to: Point { v: &x.v * -0.8, ..x.clone() }, factor: None },
        }
    }
    fn parameter_names(&self) -> Vec<String> {
        vec!["g".into(), "c".into()]
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.g, self.c]
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Rc<dyn System>> {
        let [g, c] = *theta else { return None };
        Some(Rc::new(Ball { g, c }))
    }
}

/// A system of a user's own with a force, a reset and parameters runs and is differentiated as the formula of the same
/// system: the motion to 1e-12, round-off of sixty steps; derivatives to 1e-7, that of differences of differences.
#[test]
fn a_system_with_a_force_a_reset_and_parameters() {
    let ball = Ball { g: 9.81, c: 0.02 };
    let names = [("g", ball.g), ("c", ball.c)];
    let formula = Formula::parse("x'^2/2 - g*x - z/10", &["x"], &names).unwrap();
    let bounce = Reset { when: "x", direction: Direction::Falling, then: &[("x'", "-0.8*x'")], rest: None };
    let formula = formula.with_forces(&[("x", "-c*x'^3")]).unwrap().with_reset(bounce).unwrap();
    let typed = formula.lagrangian::<1>().unwrap();
    let start = VelocityPoint::new([1.0], [0.3], 0.0);
    let (one, other) = (Problem::new(&typed, 0.0, start).unwrap(), Point::from(start));
    let other = SystemProblem::new(&ball, 0.0, other).unwrap();
    let (by, steps, until) = (GaussCollocation { stages: 6 }, Steps::Size(0.05), Until::Time(2.0));
    let variables: Vec<Variable> = Variable::all(&one);
    assert_eq!(variables, Variable::all(&other));
    let a = one.by(by).steps(steps).tangent(&variables, until).unwrap();
    let b = other.by(by).steps(steps).tangent(&variables, until).unwrap();
    assert_eq!((a.outcome.status, b.outcome.status, a.switches.len()), (Status::Completed, Status::Completed, 3));
    let (x, y) = (a.outcome.state(), b.outcome.state());
    let off = off_by(&[(x.q[0], y.q[0]), (x.p[0], y.p[0]), (x.z, y.z)]);
    assert!(off <= 1e-12, "off by {off:e}");
    for ((a, b), variable) in a.columns.iter().zip(&b.columns).zip(&variables) {
        let pairs = [(a.q[0], b.q[0]), (a.v[0], b.v[0]), (a.p[0], b.p[0]), (a.z, b.z)];
        let off = off_by(&pairs);
        assert!(off <= 1e-7, "in {variable}: off by {off:e}, {pairs:?}");
    }
}

/// The largest difference of the pairs, relative to `1 + |a|`.
fn off_by(pairs: &[(f64, f64)]) -> f64 {
    pairs.iter().fold(0.0, |off, (a, b)| max_or_nan(off, (a - b).abs() / (1.0 + a.abs())))
}
