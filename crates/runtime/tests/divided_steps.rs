//! Derivatives of motions whose steps are divided where they are fast.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use formula_lagrangian::Formula;
use herglotz_runtime::{AnyIntegrator, EndCovector, Motion, Start, StepControl, Steps, System};

/// The velocity at the start.
const V: f64 = 0.2;

/// The derivatives in a parameter, in the start, and in the times of a run with rows are those of differences, forward and by
/// the adjoint.
fn check(formula: &Formula, parameter: &str, value: f64, motion: &Motion, tolerance: f64) {
    let system = System::new(formula).unwrap();
    let times: Vec<f64> = [0.13, 0.5, 0.77, 1.0].iter().map(|part| part * motion.end).collect();
    let names = ["x", "x'", parameter, "t_end"];
    let found = system.sensitivity(motion, &names, &times, &mut ()).unwrap();
    let states = |k: usize, by: f64| {
        let (mut motion, mut times, mut value) = (motion.clone(), times.clone(), value);
        match k {
            0 => motion.start.q[0] += by,
            1 => motion.start = Start::new(0.0, motion.start.q.clone(), [V + by], 0.0),
            2 => value += by,
            _ => {
                motion.end += by;
                *times.last_mut().unwrap() += by;
            }
        }
        let system = system.with_parameters(&[(parameter, value)]).unwrap();
        system.sensitivity(&motion, &["x"], &times, &mut ()).unwrap().states
    };
    for (k, name) in names.iter().enumerate() {
        let h = if k == 2 { 1e-3 * value } else { 1e-4 };
        let [a, b, c, d] = [-2.0 * h, -h, h, 2.0 * h].map(|by| states(k, by));
        for i in 0..times.len() {
            let of_x = (a[i].q[0] - 8.0 * b[i].q[0] + 8.0 * c[i].q[0] - d[i].q[0]) / (12.0 * h);
            let of_v = (a[i].v[0] - 8.0 * b[i].v[0] + 8.0 * c[i].v[0] - d[i].v[0]) / (12.0 * h);
            let (column, size) = (&found.rows[i][k], of_x.abs().max(of_v.abs()).max(1.0));
            let error = (column.q[0] - of_x).abs().max((column.v[0] - of_v).abs());
            assert!(error <= tolerance * size, "d{i}/d{name}: {column:?} for {of_x}, {of_v}");
        }
    }
    let mut loss = |_: &[_]| {
        let one = EndCovector { q: [1.0].into(), v: [0.5].into(), ..EndCovector::zero(1) };
        (0.0, times.iter().map(|_| one.clone()).collect())
    };
    let gradient = system.gradient(motion, &times, &mut loss, &mut ()).unwrap().loss.unwrap().1;
    let sum = |k: usize| found.rows.iter().map(|row| row[k].q[0] + 0.5 * row[k].v[0]).sum::<f64>();
    for (k, backward) in
        [gradient.q[0], gradient.rate[0], gradient.parameters[0], gradient.t_end].into_iter().enumerate()
    {
        let forward = sum(k);
        assert!((backward - forward).abs() <= 1e-11 * forward.abs().max(1.0), "{}: {backward}, {forward}", names[k]);
    }
}

#[test]
fn divided_gauss_has_derivatives() {
    // A narrow well that is passed quickly.
    let formula = Formula::parse("x'^2/2 + 0.02*k/(x^2 + 0.01) - x^2/2 - 0.1*z", &["x"], &[("k", 1.0)]).unwrap();
    let by: AnyIntegrator = "divided_gauss_8_1e-6".parse().unwrap();
    let control = StepControl::Steps { by, steps: Steps::Count(4) };
    check(&formula, "k", 1.0, &Motion::new(Start::new(0.0, [1.0], [V], 0.0), 3.0, control), 1e-6);
    // Beside kinks and jumps in time.
    let formula = Formula::parse("x'^2/2 + 0.02/(x^2 + 0.01) - x^2/2", &["x"], &[("k", 0.95)]).unwrap();
    let formula = formula.with_force("x", "if(t < k, 1, 0) - 0.2*abs(x - 0.5)").unwrap();
    check(&formula, "k", 0.95, &Motion::new(Start::new(0.0, [1.0], [V], 0.0), 3.0, control), 1e-6);
}

#[test]
fn a_ball_on_springs_has_derivatives_whatever_is_selected() {
    for zeta in [0.0, 0.1, 0.3] {
        let formula = Formula::parse("x'^2/2 - x", &["x"], &[("k", 1e4), ("zeta", zeta)]).unwrap();
        let formula = formula.with_force("x", "if(x < 0, -k*x - 2*zeta*sqrt(k)*x', 0)").unwrap();
        let control = StepControl::Accuracy { error: 1e-10, by: None };
        check(&formula, "k", 1e4, &Motion::new(Start::new(0.0, [1.0], [V], 0.0), 4.0, control), 1e-5);
    }
}
