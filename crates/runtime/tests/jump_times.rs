//! Derivatives of motions with kinks and jumps at times that depend on parameters, compared with differences of runs.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use contact_geom::table::{Interpolation, Table};
use formula_lagrangian::{Direction, Formula, Reset};
use herglotz_runtime::{AnyIntegrator, EndCovector, Motion, Start, StepControl, Steps, System};

/// A motion in one coordinate: its formula, its span, and the number of its steps.
#[derive(Clone)]
struct Case {
    text: String,
    formula: Formula,
    span: [f64; 2],
    steps: usize,
    rows: Vec<f64>,
}

const START: [f64; 3] = [0.7, 0.3, 0.1];

impl Case {
    fn new(text: &str, parameters: &[(&str, f64)]) -> Self {
        let formula = Formula::parse(text, &["x"], parameters).unwrap();
        Case { text: text.to_owned(), formula, span: [0.0, 2.0], steps: 20, rows: Vec::new() }
    }

    fn with_force(self, text: &str) -> Self {
        Case { formula: self.formula.with_force("x", text).unwrap(), ..self }
    }

    fn with_reset(self, when: &str, then: &[(&str, &str)]) -> Self {
        let reset = Reset { when, direction: Direction::Both, then, rest: None };
        Case { formula: self.formula.with_reset(reset).unwrap(), ..self }
    }

    /// Over another span, in this number of steps.
    fn over(self, span: [f64; 2], steps: usize) -> Self {
        Case { span, steps, ..self }
    }

    /// With rows at these times, beside the end.
    fn rows_at(self, rows: &[f64]) -> Self {
        Case { rows: rows.to_vec(), ..self }
    }

    fn motion(&self, [t0, t_end]: [f64; 2]) -> Motion {
        let by = AnyIntegrator::Gauss { stages: 8 };
        let step_control = StepControl::Steps { by, steps: Steps::Count(self.steps) };
        let [q, v, z] = START;
        Motion::new(Start::new(t0, [q], [v], z), t_end, step_control)
    }

    fn times(&self, t_end: f64) -> Vec<f64> {
        self.rows.iter().copied().chain([t_end]).collect()
    }

    /// The states at the times of a run, each as `(q, v, z)`.
    fn states(&self, values: &[(&str, f64)], span: [f64; 2]) -> Vec<[f64; 3]> {
        let system = System::new(&self.formula).unwrap().with_parameters(values).unwrap();
        let found = system.sensitivity(&self.motion(span), &["x"], &self.times(span[1]), &mut ()).unwrap();
        found.states.iter().map(|state| [state.q[0], state.v[0], state.z]).collect()
    }

    /// The derivatives in parameters and in the times of the run are those of differences of runs, forward and by the
    /// adjoint.
    fn check(&self) {
        let system = System::new(&self.formula).unwrap();
        let parameters: Vec<(String, f64)> = self.formula.parameters().map(|(name, x)| (name.to_owned(), x)).collect();
        let mut names: Vec<&str> = parameters.iter().map(|(name, _)| name.as_str()).collect();
        names.extend(["t0", "t_end"]);
        let (motion, times) = (self.motion(self.span), self.times(self.span[1]));
        let found = system.sensitivity(&motion, &names, &times, &mut ()).unwrap();
        assert_eq!(found.rows.len(), times.len());
        let size = found.rows.iter().flatten().fold(1.0_f64, |m, of| m.max(of.q[0].abs()).max(of.v[0].abs()));
        for (k, name) in names.iter().enumerate() {
            // The truncation of central differences, of fourth order, is of the size 1e-10 relative to the sixth
            // derivatives; the round-off is 1e-15 divided by the distance.
            let h = 1e-3;
            let at = |by: f64| {
                let (mut values, mut span) = (parameters.clone(), self.span);
                match k.checked_sub(parameters.len()) {
                    None => values[k].1 += by,
                    Some(end) => span[end] += by,
                }
                let values: Vec<(&str, f64)> = values.iter().map(|(name, x)| (name.as_str(), *x)).collect();
                self.states(&values, span)
            };
            let [a, b, c, d] = [-2.0 * h, -h, h, 2.0 * h].map(at);
            for row in 0..times.len() {
                let column = &found.rows[row][k];
                let forward = [column.q[0], column.v[0], column.z];
                for i in 0..3 {
                    let expected = (a[row][i] - 8.0 * b[row][i] + 8.0 * c[row][i] - d[row][i]) / (12.0 * h);
                    let place = format!("d{}/d{name} at t = {} of {}", ["x", "x'", "z"][i], times[row], self.text);
                    let error = (forward[i] - expected).abs();
                    assert!(error <= 1e-8 * size, "{place}: {} for {expected}", forward[i]);
                    let mut covectors = vec![EndCovector::zero(1); times.len()];
                    match i {
                        0 => covectors[row].q = [1.0].into(),
                        1 => covectors[row].v = [1.0].into(),
                        _ => covectors[row].z = 1.0,
                    }
                    let mut loss = |_: &[_]| (0.0, covectors.clone());
                    let gradient = system.gradient(&motion, &times, &mut loss, &mut ()).unwrap().loss.unwrap().1;
                    let mut all = gradient.parameters.iter().copied().chain([gradient.t0, gradient.t_end]);
                    let backward = all.nth(k).unwrap();
                    // Both are derivatives of the same steps.
                    let error = (forward[i] - backward).abs();
                    assert!(error <= 1e-12 * size, "{place}, backward: {backward} for {}", forward[i]);
                }
            }
        }
    }
}

#[test]
fn the_case_of_the_issue() {
    let system = System::parse("x'^2/2 + if(t < T, 1, 0)*x", &["x"], &[("T", 0.98)]).unwrap();
    let step_control = StepControl::Accuracy { error: 1e-9, by: None };
    let motion = Motion::new(Start::new(0.0, [0.0], [0.0], 0.0), 2.0, step_control);
    let found = system.sensitivity(&motion, &["T"], &[2.0], &mut ()).unwrap();
    assert!((found.rows[0][0].q[0] - 1.02).abs() <= 1e-12, "{found:?}");
}

#[test]
fn jumps_at_times_of_parameters_have_derivatives() {
    let of = |text: &str| Case::new(text, &[("T", 0.98), ("k", 1.3)]);
    of("x'^2/2 - k*x^2/2 + if(t < T, 1, 0)*x").check();
    of("x'^2/2 - k*x^2/2 + sign(t - T)*sin(x)").check();
    of("x'^2/2 - k*x^2/2 + if(t < 2*T - 0.5*k, 1, t)*x - 0.1*z").check();
    of("x'^2/2 - k*x^2/2 + abs(t/T - 0.7)*x").check();
    // The mass jumps, and so does the velocity.
    of("x'^2/2*(1 + if(t > T, k, 0)) - k*x^2/2 - 0.1*z").check();
    of("x'^2/2 - k*x^2/2 - 0.1*z").with_force("if(t > T, 1, 0)*x - 0.2*x'").check();
    of("x'^2/2 - k*x^2/2").with_force("if(t > T, 1, 0) - if(t > T + 0.3*k, 1, 0)").check();
    of("x'^2/2 - k*x^2/2").with_force("min(t, T)*x").check();
}

/// Steps end at the jump, exactly and but for round-off.
#[test]
fn jumps_at_ends_of_steps_have_derivatives() {
    let of = |text: &str, t: f64| Case::new(text, &[("T", t), ("k", 1.3)]);
    for jump in [1.0, 0.3, 0.7, 1.1] {
        of("x'^2/2 - k*x^2/2 + if(t > T, 1, 0)*x", jump).check();
        of("x'^2/2 - k*x^2/2 + if(t < T, 1, 0)*x", jump).rows_at(&[0.25]).check();
        of("x'^2/2 - k*x^2/2", jump).with_force("sign(t - T)").over([2.0, 0.0], 20).check();
        of("x'^2/2 - k*x^2/2 - 0.1*z", jump).with_force("sign(t - T)*x'").over([0.0, 2.1], 21).check();
    }
    // A time that is no parameter, with a row there.
    for steps in [20, 21, 40] {
        let fixed = of("x'^2/2 - k*x^2/2 + if(t > 1, T, 0)*x", 1.0).over([0.0, 2.0], steps);
        fixed.clone().check();
        fixed.clone().rows_at(&[0.5, 1.0]).check();
        fixed.over([2.0, 0.0], steps).rows_at(&[1.0, 0.5]).check();
    }
}

#[test]
fn jumps_in_time_beside_rows_resets_and_other_jumps() {
    let of = |text: &str, t: f64| Case::new(text, &[("T", t), ("k", 1.3)]);
    of("x'^2/2 - k*x^2/2 + if(t > T, 1, 0)*x", 0.98).rows_at(&[0.3, 0.94, 1.0, 1.05, 1.7]).check();
    // A ball is thrown back before and after the jump; a kick at the time of the jump, which is also the end of a step,
    // exactly or but for round-off; a jump at the zero of a function of time that is not affine.
    let ball = of("x'^2/2 - 3*x + if(t > T, k, 0)*x", 0.5).over([0.0, 2.0], 11).rows_at(&[0.4, 0.6, 1.9]);
    ball.with_reset("x", &[("x'", "-0.8*x'")]).check();
    for (jump, steps) in [(0.98, 20), (1.0, 20), (1.7, 40), (1.4, 20), (1.9, 40), (1.8, 40)] {
        let kicked = of("x'^2/2 - k*x^2/2 + if(t > T, 1, 0)*x", jump).over([0.0, 2.0], steps).rows_at(&[0.5, 1.62]);
        kicked.clone().check();
        kicked.with_reset("t - T", &[("x'", "x' + 0.4*x")]).check();
        let wave = of("x'^2/2 - k*x^2/2 + 0.3*sign(sin(9*(t - T)))*x", jump);
        wave.over([0.0, 2.0], steps).rows_at(&[0.5, 1.62]).check();
    }
}

/// Each of two jumps at one time moves alone; the terms are their sum, so that their order does not matter.
#[test]
fn jumps_at_one_time_move_apart() {
    let parameters = [("T", 0.98), ("S", 0.98), ("k", 1.3)];
    let of = |text: &str| Case::new(text, &parameters).rows_at(&[0.5, 1.1]);
    let text = "x'^2/2 - k*x^2/2 + if(t > T, 1, 0)*x + if(2*t < S + 0.98, 3, 1)*sin(x)";
    of(text).check();
    of(text).over([0.0, 1.96], 20).check();
    of(text).over([2.0, 0.0], 20).rows_at(&[1.1, 0.5]).check();
    let given = of("x'^2/2 - k*x^2/2 + if(t > T, 1, 0)*x + S*x");
    let formula = given.formula.with_breaks(&[0.98]).unwrap();
    Case { formula, ..given }.check();
}

/// The kernel of many coordinates.
#[test]
fn systems_of_many_coordinates_have_these_derivatives() {
    let text = "sum(i, 0, 16, x'[i]^2/2 - x[i]^2*(i + 1)/20) + if(t > T, 1, 0)*x[16]*x[3]";
    let of = |jump: f64| {
        let system = System::parse(text, &["x[17]"], &[("T", jump)]).unwrap();
        let step_control = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 8 }, steps: Steps::Count(10) };
        let motion = Motion::new(Start::new(0.0, [1.0; 17], [0.5; 17], 0.0), 2.0, step_control);
        let mut loss = |_: &[_]| (0.0, vec![EndCovector { q: [1.0; 17].into(), ..EndCovector::zero(17) }]);
        let gradient = system.gradient(&motion, &[2.0], &mut loss, &mut ()).unwrap().loss.unwrap().1;
        let found = system.sensitivity(&motion, &["T"], &[2.0], &mut ()).unwrap();
        (found.states[0].q.iter().sum::<f64>(), found.rows[0][0].q.iter().sum::<f64>(), gradient.parameters[0])
    };
    for jump in [0.98, 1.0] {
        let (_, forward, backward) = of(jump);
        // The truncation of the differences is 1e-8, of second order.
        let expected = (of(jump + 1e-4).0 - of(jump - 1e-4).0) / 2e-4;
        assert!((forward - expected).abs() <= 1e-7 && forward.abs() > 0.1, "{forward} for {expected}");
        assert!((forward - backward).abs() <= 1e-12, "{backward} for {forward}");
    }
}

/// The last step ends at the end of the run but for round-off, also where the end is near the time 0.
#[test]
fn derivatives_in_the_end_time_whatever_its_rounding() {
    let system = System::parse("x'^2/2 + cos(x) - 0.1*z", &["x"], &[]).unwrap();
    let (q, v) = (0.7, 0.3);
    for i in 0..500 {
        // A sequence that fills the square evenly.
        let [a, b] = [0.754_877_666_246_693, 0.569_840_290_998_053].map(|x| (0.5 + f64::from(i) * x).fract());
        let (t0, t_end) = (-2.0 * a, 2.0 * b - 1.0 + 1e-3);
        let step_control = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Size(0.1) };
        let motion = Motion::new(Start::new(t0, [q], [v], 0.0), t_end, step_control);
        let found = system.sensitivity(&motion, &["t_end"], &[t_end], &mut ()).unwrap();
        let (state, column) = (&found.states[0], &found.rows[0][0]);
        // x'' = -sin(x) - 0.1*x', to the error of the method.
        let expected = [state.v[0], -state.q[0].sin() - 0.1 * state.v[0]];
        let mut loss = |_: &[_]| (0.0, vec![EndCovector { v: [1.0].into(), ..EndCovector::zero(1) }]);
        let gradient = system.gradient(&motion, &[t_end], &mut loss, &mut ()).unwrap().loss.unwrap().1;
        for (found, expected) in [column.q[0], column.v[0], gradient.t_end].iter().zip([0, 1, 1].map(|i| expected[i])) {
            assert!((found - expected).abs() <= 1e-7, "{found} for {expected} from {t0} to {t_end}");
        }
    }
}

/// Held samples are jumps, linear interpolation has kinks, and both move with a shift of the time.
#[test]
fn tables_of_shifted_times_have_derivatives() {
    let (times, values) = ([-1.0, 0.2, 0.5, 0.9, 1.6], [1.0, -2.0, 0.5, 2.0, -1.0]);
    for degree in [0, 1, 3] {
        let table = match degree {
            0 => Table::new(&times, &values, Interpolation::Held),
            1 => Table::new(&times, &values, Interpolation::Linear),
            _ => Table::new(&times, &values, Interpolation::Cubic),
        };
        let table = table.unwrap();
        let parameters = [("T", 0.02), ("k", 1.3)];
        let formula = Formula::parse_with_tables(
            "x'^2/2 - k*x^2/2 + u(t - T)*x + u(k*t)*x",
            &["x"],
            &parameters,
            &[("u", table)],
        );
        Case {
            formula: formula.unwrap(),
            span: [0.0, 1.2],
            steps: 10,
            rows: vec![0.31],
            text: format!("table of degree {degree}"),
        }
        .check();
    }
}
