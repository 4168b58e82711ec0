//! Formulas run by integrators, against the Rust types of the same Lagrangians.

use contact_geom::systems::Pendulum;
use contact_geom::{Dual, Lagrangian, VelocityPoint, nalgebra::SVector};
use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
use formula_lagrangian::Formula;

#[test]
fn a_pendulum_by_gauss() {
    let formula = Formula::parse("theta'^2/2 - 1 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)]).unwrap();
    let lagrangian = formula.lagrangian::<1>().unwrap();
    let typed = Pendulum { gamma: -0.1 };
    let start = VelocityPoint::new([1.0], [0.3], 0.0);
    let gauss = GaussCollocation { stages: 8 };
    let run = |outcome: discrete_herglotz::Outcome<1>| (outcome.q[0], outcome.p[0]);
    let problem = Problem::new(&lagrangian, 0.0, start).unwrap();
    let ours = run(problem.by(gauss).steps(Steps::Size(0.5)).run(Until::Time(50.0)).unwrap());
    let problem = Problem::new(&typed, 0.0, start).unwrap();
    let theirs = run(problem.by(gauss).steps(Steps::Size(0.5)).run(Until::Time(50.0)).unwrap());
    // The same operations in another order of factors: some roundings a step.
    assert!((ours.0 - theirs.0).abs() < 1e-14 && (ours.1 - theirs.1).abs() < 1e-14, "{ours:?} {theirs:?}");
    let moving = Dual { re: 1.0, d: SVector::<f64, 1>::new(1.0) };
    let one = |x| SVector::from([Dual::constant(x)]);
    let l = lagrangian.value(Dual::constant(0.0), &SVector::from([moving]), &one(0.3), Dual::constant(0.0));
    assert_eq!(l.d[0], -1f64.sin());
}
