//! Runs of formulas compared with those of the Rust types of the same Lagrangians.

use contact_examples::systems::{Pendulum, QuadraticInZ};
use contact_geom::{Dual, Lagrangian, VelocityPoint, nalgebra::SVector};
use discrete_herglotz::{GaussCollocation, Problem, Status, Steps, Until};
use formula_lagrangian::Formula;

#[test]
fn a_pendulum_by_gauss() {
    let formula = Formula::parse("theta'^2/2 - 1 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)]).unwrap();
    let lagrangian = formula.lagrangian::<1>().unwrap();
    let typed = Pendulum { gamma: -0.1 };
    let start = VelocityPoint::new([1.0], [0.3], 0.0);
    let gauss = GaussCollocation { stages: 8 };
    let run = |outcome: discrete_herglotz::Outcome| (outcome.q[0], outcome.p[0]);
    let problem = Problem::new(&lagrangian, 0.0, start).unwrap();
    let ours = run(problem.by(gauss).steps(Steps::Size(0.5)).run(Until::Time(50.0)).unwrap());
    let problem = Problem::new(&typed, 0.0, start).unwrap();
    let theirs = run(problem.by(gauss).steps(Steps::Size(0.5)).run(Until::Time(50.0)).unwrap());
    // The operations are the same except for the order of factors: some roundings per step.
    assert!((ours.0 - theirs.0).abs() < 1e-14 && (ours.1 - theirs.1).abs() < 1e-14, "{ours:?} {theirs:?}");
    let moving = Dual { re: 1.0, d: SVector::<f64, 1>::new(1.0) };
    let one = |x| SVector::from([Dual::constant(x)]);
    let l = lagrangian.value(Dual::constant(0.0), &SVector::from([moving]), &one(0.3), Dual::constant(0.0));
    assert_eq!(l.d[0], -1f64.sin());
}

/// For all numbers of stages, which occupy one, two or more vector registers. Formulas are evaluated for two or four
/// registers at once, types for one, with bitwise equal results. Both paths are tested: by accelerations (the
/// pendulum), and the general one (drag that is quadratic in z).
#[test]
fn gauss_steps_of_any_number_of_stages_are_those_of_the_type() {
    fn ends(lagrangian: &impl Lagrangian<1>, stages: usize) -> [f64; 3] {
        let start = VelocityPoint::new([1.0], [0.3], 0.5);
        let problem = Problem::new(lagrangian, 0.0, start).unwrap();
        let run = problem.by(GaussCollocation { stages }).steps(Steps::Size(0.25));
        let outcome = run.run(Until::Time(20.0)).unwrap();
        assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None));
        [outcome.q[0], outcome.p[0], outcome.z.unwrap()]
    }
    let pendulum = Formula::parse("theta'^2/2 - versine(theta) + gamma*z", &["theta"], &[("gamma", -0.1)]).unwrap();
    let curved = Formula::parse("(x'^2 - x^2 - c*z^2)/2", &["x"], &[("c", 0.1)]).unwrap();
    for stages in 3..=16 {
        let (formula, typed) =
            (ends(&pendulum.lagrangian::<1>().unwrap(), stages), ends(&Pendulum { gamma: -0.1 }, stages));
        assert_eq!(formula, typed, "{stages} stages");
        let (formula, typed) =
            (ends(&curved.lagrangian::<1>().unwrap(), stages), ends(&QuadraticInZ { c: 0.1 }, stages));
        assert_eq!(formula, typed, "{stages} stages");
    }
}
