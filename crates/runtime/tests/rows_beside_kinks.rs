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
