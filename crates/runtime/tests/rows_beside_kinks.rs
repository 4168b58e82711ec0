//! Derivatives at rows of motions whose force has kinks.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use formula_lagrangian::Formula;
use herglotz_runtime::{AnyIntegrator, EndCovector, Motion, Start, StepControl, Steps, System};

const C: f64 = 0.2;

/// The rows of a motion with a force, with their derivatives in `c`, forward, and that of the sum of the last x of each
/// tenth row by the adjoint.
fn check(force: &str, is_rayleigh: bool, step_control: StepControl, (q, v): (f64, f64)) {
    let of = |c: f64| {
        let formula = Formula::parse("x'^2/2 - x^2/2", &["x"], &[("c", c)]).unwrap();
        let formula = match is_rayleigh {
            true => formula.with_rayleigh(force).unwrap(),
            false => formula.with_force("x", force).unwrap(),
        };
        System::new(&formula).unwrap()
    };
    let times: Vec<f64> = (0..=100).map(|i| f64::from(i) / 10.0).collect();
    let motion = Motion::new(Start::new(0.0, [q], [v], 0.0), 10.0, step_control);
    let states = |c: f64| of(c).sensitivity(&motion, &["x"], &times, &mut ()).unwrap().states;
    let found = of(C).sensitivity(&motion, &["c"], &times, &mut ()).unwrap();
    let h = 1e-3;
    let [a, b, c, d] = [-2.0 * h, -h, h, 2.0 * h].map(|by| states(C + by));
    for (i, row) in found.rows.iter().enumerate() {
        // The differences have errors of the runs, 1e-10, divided by their distance.
        let of_x = (a[i].q[0] - 8.0 * b[i].q[0] + 8.0 * c[i].q[0] - d[i].q[0]) / (12.0 * h);
        let of_v = (a[i].v[0] - 8.0 * b[i].v[0] + 8.0 * c[i].v[0] - d[i].v[0]) / (12.0 * h);
        let error = (row[0].q[0] - of_x).abs().max((row[0].v[0] - of_v).abs());
        assert!(error <= 1e-6, "{force}: row {i}, {:?} for {of_x}, {of_v}", row[0]);
    }
    let mut loss = |_: &[_]| {
        let one = EndCovector { q: [1.0].into(), ..EndCovector::zero(1) };
        (0.0, times.iter().map(|_| one.clone()).collect())
    };
    let gradient = of(C).gradient(&motion, &times, &mut loss, &mut ()).unwrap().loss.unwrap().1;
    let expected: f64 = found.rows.iter().map(|row| row[0].q[0]).sum();
    assert!((gradient.parameters[0] - expected).abs() <= 1e-10, "{force}: {} for {expected}", gradient.parameters[0]);
}

#[test]
fn rows_of_a_motion_with_quadratic_damping() {
    let by = |stages| StepControl::Steps { by: AnyIntegrator::Gauss { stages }, steps: Steps::Size(0.15) };
    let accuracies = [1e-9, 1e-10].map(|error| StepControl::Accuracy { error, by: None });
    for control in accuracies.into_iter().chain([by(8)]) {
        for start in [(1.0, 0.3), (1.0, 0.0), (0.0, 1.0), (-0.5, 1.3)] {
            check("-c*x'*abs(x')", false, control, start);
            check("-c*x'*sqrt(x'^2)", false, control, start);
            check("-c*x'^2*if(x' > 0, 1, -1)", false, control, start);
            check("c*abs(x')^3/3", true, control, start);
        }
    }
}

/// A reflection at a step of the potential changes the sign of the velocity, and so that of the drag at the same point: the
/// action has its derivatives there, on whichever side of the step rounding puts the point.
#[test]
fn a_reflection_beside_quadratic_damping() {
    let formula = Formula::parse("x'^2/2 - if(x > a, 0.5, 0) + 0.05*z", &["x"], &[("a", 0.3)]).unwrap();
    let system = System::new(&formula.with_force("x", "-0.4*x'*abs(x')").unwrap()).unwrap();
    let by = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 8 }, steps: Steps::Size(0.25) };
    let motion = |v: f64| Motion::new(Start::new(0.0, [-0.1], [v], 0.2), 2.0, by);
    let end = |v: f64| {
        let outcome = system.run(&motion(v), &mut ()).unwrap();
        [outcome.q[0], outcome.v.unwrap()[0], outcome.z.unwrap()]
    };
    for k in 0..60 {
        let v = 0.5 + 0.006 * f64::from(k);
        let found = system.sensitivity(&motion(v), &["x'"], &[2.0], &mut ()).unwrap();
        let found = &found.rows[0][0];
        let h = 1e-3;
        let [a, b, c, d] = [-2.0 * h, -h, h, 2.0 * h].map(|by| end(v + by));
        let mut loss = |_: &[_]| (0.0, vec![EndCovector { z: 1.0, ..EndCovector::zero(1) }]);
        let gradient = system.gradient(&motion(v), &[2.0], &mut loss, &mut ()).unwrap().loss.unwrap().1;
        assert!((gradient.rate[0] - found.z).abs() <= 1e-12, "{v}: {} for {}", gradient.rate[0], found.z);
        for (i, of) in [found.q[0], found.v[0], found.z].into_iter().enumerate() {
            let expected = (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h);
            // The differences have errors of order h^4, and of the runs, 1e-14, divided by h.
            assert!((of - expected).abs() <= 1e-9, "{v}, {i}: {of} for {expected}");
        }
    }
}
