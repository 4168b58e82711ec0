//! Formulas with holonomic constraints: the integrators that their names stand for, rows, ensembles, refusals.

use super::members;
use herglotz_runtime::{
    BoundaryProblem, Column, Ensemble, Event, Formula, InputError, Motion, OutputTimes, RuntimeError, Start, Status,
    StepControl, Steps, System, Varied,
};

/// The period of a pendulum of length 1 that starts at rest at the height of its pivot.
const PERIOD: f64 = 2.367841947576237;

const NEWTON: &str = "(x'^2 + y'^2)/2 - 9.81*y + gamma*z";

fn pendulum(lagrangian: &str) -> System {
    let formula = Formula::parse(lagrangian, &["x", "y"], &[("gamma", 0.0), ("l", 1.0)]).unwrap();
    System::new(&formula.with_constraints(&["x^2 + y^2 = l^2"]).unwrap()).unwrap()
}

fn at_rest() -> Start {
    Start::new(0.0, [1.0, 0.0], [0.0, 0.0], 0.0)
}

fn named(name: &str, steps: usize) -> StepControl {
    StepControl::Steps { by: name.parse().unwrap(), steps: Steps::Count(steps) }
}

/// The pendulum returns after a period by each of the integrators, also by those that are chosen: RATTLE where L is
/// separable, else a Lobatto method.
#[test]
fn a_pendulum_returns_after_its_period() {
    let general = "(x'^2 + y'^2)/2 - 9.81*y + gamma*z + (x^2 + y^2 - 1)*x'^4";
    for (lagrangian, step_control, method) in [
        (NEWTON, named("kahan_li_8", 200), "rattle_kahan_li_8"),
        (NEWTON, named("gauss_4", 100), "lobatto_5"),
        (NEWTON, StepControl::Accuracy { error: 1e-10, by: None }, "rattle_kahan_li_8"),
        (general, StepControl::Accuracy { error: 1e-10, by: None }, "lobatto_5"),
    ] {
        let system = pendulum(lagrangian);
        let motion = Motion {
            rows: Some(OutputTimes::Every(1)),
            columns: vec![
                Column::parse("x^2 + y^2 - 1", system.formula()).unwrap(),
                Column::parse("2*x*x' + 2*y*y'", system.formula()).unwrap(),
            ],
            ..Motion::new(at_rest(), PERIOD, step_control)
        };
        let plan = system.plan(&motion).unwrap();
        assert_eq!(plan.integrator.name, method);
        assert_eq!(
            plan.by(),
            if method.starts_with("rattle") { "kahan_li_8".parse().ok() } else { "gauss_4".parse().ok() }
        );
        let (outcome, rows) = system.record(&motion).unwrap();
        assert_eq!(outcome.status, Status::Completed);
        // The velocity vanishes there: the error of the position is of the second order of that of the time.
        assert!((outcome.q[0] - 1.0).abs() < 1e-9 && outcome.q[1].abs() < 1e-9, "{method}: {:?}", outcome.q);
        let largest = |k: usize| rows.iter().map(|row| row[k].abs()).max_by(f64::total_cmp).unwrap();
        // Of velocities up to 4.5, a few roundings.
        assert!(largest(0) < 1e-14 && largest(1) < 1e-13, "{method}: {} {}", largest(0), largest(1));
    }
}

/// The multiplier is that of the tension in closed form, `-T/2` with `T = v^2 - g y`, and a crossing is located where
/// the pendulum is lowest, with the speed in closed form.
#[test]
fn multipliers_and_events() {
    let system = pendulum(NEWTON);
    let formula = system.formula();
    let of = |text: &str| Column::parse(text, formula).unwrap();
    let motion = Motion {
        rows: Some(OutputTimes::At((0..=8).map(|k| f64::from(k) / 8.0).collect())),
        columns: vec![of("lambda"), of("lambda[0]"), of("-(x'^2 + y'^2 - 9.81*y)/2"), of("energy")],
        events: vec![Event::new(formula.expression("x").unwrap())],
        ..Motion::new(at_rest(), 1.0, named("kahan_li_8", 100))
    };
    let (outcome, rows) = system.record(&motion).unwrap();
    assert_eq!((outcome.status, rows.len()), (Status::Completed, 9));
    for row in &rows {
        assert!((row[0] - row[2]).abs() < 1e-12 && row[0] == row[1] && row[3].abs() < 1e-9, "{row:?}");
    }
    struct Speed(Vec<f64>);
    impl herglotz_runtime::RunMonitor for Speed {
        fn crossing(&mut self, crossing: &herglotz_runtime::Crossing) -> std::ops::ControlFlow<()> {
            self.0.push(crossing.v[0]);
            std::ops::ControlFlow::Continue(())
        }
    }
    let mut speed = Speed(Vec::new());
    system.run(&motion, &mut speed).unwrap();
    assert!(speed.0.len() == 1 && (speed.0[0] + (2.0 * 9.81f64).sqrt()).abs() < 1e-9, "{:?}", speed.0);
    // Without constraints there is no such column.
    let free = Formula::parse(NEWTON, &["x", "y"], &[("gamma", 0.0)]).unwrap();
    assert!(Column::parse("lambda", &free).is_err() && Column::parse("lambda[1]", formula).is_err());
}

/// Starts off the constraints are refused with their distance, and moved to them on request.
#[test]
fn starts_off_the_constraints() {
    let system = pendulum(NEWTON);
    let off = Start::new(0.0, [1.0, 0.1], [0.5, 1.0], 0.0);
    let motion = Motion::new(off, 0.1, named("gauss_3", 10));
    let error = system.run(&motion, &mut ()).unwrap_err();
    assert!(matches!(error, RuntimeError::Constraint { .. }), "{error:?}");
    let said = error.to_string();
    assert!(
        said.contains("off the constraints by the distance 4.97") && said.contains("constraint \"x^2 + y^2 = "),
        "{said}"
    );
    let (outcome, rows) = system
        .record(&Motion {
            project: true,
            rows: Some(OutputTimes::Every(1)),
            columns: vec![Column::parse("x^2 + y^2", system.formula()).unwrap()],
            ..motion.clone()
        })
        .unwrap();
    assert_eq!(outcome.status, Status::Completed);
    assert!(rows.iter().all(|row| (row[0] - 1.0).abs() < 1e-14), "{rows:?}");
    let free = System::parse(NEWTON, &["x", "y"], &[("gamma", 0.0)]).unwrap();
    let error = free.run(&Motion { project: true, ..motion }, &mut ()).unwrap_err();
    assert!(error.to_string().contains("no constraints"), "{error}");
}

/// Members of an ensemble have the constraints of their own parameters; one that starts off them fails by itself.
#[test]
fn ensembles_under_constraints() {
    let system = pendulum(NEWTON);
    let lengths = [1.0, 2.0, 0.5];
    let values = |i: usize| vec![lengths[i]];
    let start = |i: usize| Start::new(0.0, [if i == 2 { 1.0 } else { lengths[i] }, 0.0], [0.0, 0.0], 0.0);
    let step_control = named("kahan_li_8", 200);
    let ensemble = Ensemble {
        count: 3,
        start: &start,
        t0: 0.0,
        varied: Some(Varied { names: &["l"], values: &values }),
        end: 1.0,
        step_control,
        rows: None,
        columns: &[],
        events: &[],
        threads: Some(1),
    };
    let ends = members(&system, &ensemble);
    for (i, length) in lengths.iter().enumerate().take(2) {
        let own = system.with_parameters(&[("l", *length)]).unwrap();
        let alone = own.run(&Motion::new(start(i), 1.0, step_control), &mut ()).unwrap();
        let end = ends[i].ending.as_ref().unwrap();
        assert_eq!((&end.q, &end.p), (&alone.q, &alone.p));
        assert!((end.q[0].hypot(end.q[1]) - length).abs() < 1e-14 * length, "{end:?}");
    }
    assert!(matches!(ends[2].ending, Err(InputError::Constraint(_))), "{:?}", ends[2].ending);
}

/// Steps with constraints are contact transformations of T*N x R, by RATTLE, by Lobatto methods, and by the methods that
/// are chosen for an accuracy; for L of any form. The factor of RATTLE is that of the drag.
#[test]
fn steps_with_constraints_are_contact() {
    let general = "(1 + x^2)*(x'^2 + y'^2)/2 - 9.81*y + gamma*z - z^2/50";
    for (lagrangian, step_control) in [
        (NEWTON, named("suzuki_4", 50)),
        (NEWTON, named("gauss_2", 50)),
        (NEWTON, StepControl::Accuracy { error: 1e-8, by: None }),
        (general, named("gauss_3", 50)),
        (general, StepControl::Accuracy { error: 1e-8, by: None }),
    ] {
        let system = pendulum(lagrangian).with_parameters(&[("gamma", -0.3)]).unwrap();
        let check = system.check(&Motion::new(at_rest(), 1.5, step_control), 4).unwrap();
        assert!(check.is_contact() && check.samples.len() == 4, "{lagrangian} {step_control:?}: {check:?}");
        // Of the error of a step, which is below that of the order and of the accuracy.
        let departs = check.samples.iter().map(|sample| sample.herglotz_defect).max_by(f64::total_cmp).unwrap();
        assert!(departs < 1e-3 && check.statements.is_empty(), "{lagrangian} {step_control:?}: {departs:e}");
        if check.integrator.starts_with("rattle") {
            let sigma = check.samples[2].sigma;
            assert!((sigma - (-0.3 * check.step_size).exp()).abs() < 1e-14, "{sigma}");
        }
    }
}

/// Short steps and slow motions: the velocities of the stages have the round-off of the positions, divided by the step.
#[test]
fn short_steps_and_slow_motions_converge() {
    // The amplitude, the stages, the step, the span and the drag.
    for (amplitude, stages, h, end, gamma) in [
        (0.01_f64, 4, 0.001_f64, 1.0_f64, 0.0),
        (1.0, 4, 1e-4, 0.1, 0.0),
        (1.0, 7, 1e-3, 0.5, 0.0),
        (1.0, 2, 0.001, 1.0, 0.0),
        (0.5, 4, 0.1, 2000.0, -0.1),
        (0.5, 6, 0.05, 400.0, -0.2),
    ] {
        let system = pendulum(NEWTON).with_parameters(&[("gamma", gamma)]).unwrap();
        let start = Start::new(0.0, [amplitude.sin(), -amplitude.cos()], [0.0, 0.0], 0.0);
        let step_control = named(&format!("gauss_{stages}"), (end / h).round() as usize);
        let found = system.run(&Motion::new(start, end, step_control), &mut ()).unwrap();
        assert_eq!(found.status, Status::Completed, "gauss_{stages} with {h} from {amplitude}");
        let angle = Formula::parse("u'^2/2 + cos(u)*9.81 + gamma*z", &["u"], &[("gamma", gamma)]).unwrap();
        let accurate = StepControl::Accuracy { error: 1e-12, by: None };
        let motion = Motion::new(Start::new(0.0, [amplitude], [0.0], 0.0), end, accurate);
        let expected = System::new(&angle).unwrap().run(&motion, &mut ()).unwrap().q[0];
        // Round-off of the steps, which adds up to eps q for each, and the truncation of the longest ones.
        let apart = (found.q[0] - expected.sin()).abs();
        assert!(apart < 1e-8, "gauss_{stages} with {h} from {amplitude}: {apart:e}");
    }
}

/// A force under constraints, of time, positions, velocities and the action: the motion is that of the pendulum in its
/// angle, and the order of collocation remains.
#[test]
fn a_force_under_constraints() {
    // The force `c (1 + z) (x, y)'^2 cos(t) (-y, x)` is along the circle.
    let parameters = [("gamma", -0.2), ("c", 0.7)];
    let forced = Formula::parse(NEWTON, &["x", "y"], &parameters).unwrap();
    let along = ["-y", "x"].map(|e| format!("{e}*c*(1 + z)*(x'^2 + y'^2)*cos(t)"));
    let forced = forced.with_forces(&[("x", &along[0]), ("y", &along[1])]).unwrap();
    let forced = System::new(&forced.with_constraints(&["x^2 + y^2 = 1"]).unwrap()).unwrap();
    let angle = "u'^2/2 - sin(u)*9.81 + gamma*z";
    let angle = Formula::parse(angle, &["u"], &parameters).unwrap();
    let angle = System::new(&angle.with_force("u", "c*(1 + z)*u'^2*cos(t)").unwrap()).unwrap();
    let end = 1.5;
    let exact = StepControl::Accuracy { error: 1e-13, by: None };
    let expected = angle.run(&Motion::new(Start::new(0.0, [0.0], [0.0], 0.0), end, exact), &mut ()).unwrap();
    let error = |step_control| {
        let found = forced.run(&Motion::new(at_rest(), end, step_control), &mut ()).unwrap();
        let (u, p) = (expected.q[0], expected.p[0]);
        let exact = [u.cos(), u.sin(), -u.sin() * p, u.cos() * p, expected.z.unwrap()];
        let found = [&found.q[..], &found.p, &[found.z.unwrap()]].concat();
        found.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    for (stages, steps) in [(1, 160), (2, 40), (3, 20), (4, 12)] {
        let [coarse, fine] = [steps, 2 * steps].map(|steps| error(named(&format!("gauss_{stages}"), steps)));
        let slope = (coarse / fine).log2();
        assert!((slope - f64::from(2 * stages)).abs() < 0.15, "{stages}: {slope} from {coarse:e} and {fine:e}");
    }
    let reached = error(StepControl::Accuracy { error: 1e-10, by: None });
    assert!(reached < 1e-9, "{reached:e}");
}

/// What is not computed with constraints is refused by one error, and integrators that take none by another.
#[test]
fn what_is_refused_with_constraints() {
    let system = pendulum(NEWTON);
    let by = "gauss_2".parse().unwrap();
    for (what, error) in [
        ("geometry", system.geometry(&at_rest()).err()),
        ("path", system.path(&BoundaryProblem::new([vec![1.0, 0.0], vec![0.0, -1.0]], (0.0, 1.0), by, 10)).err()),
    ] {
        assert!(matches!(error, Some(RuntimeError::WithConstraints { .. })), "{what}: {error:?}");
    }
    for name in ["midpoint", "gauss_8", "divided_gauss_4_1e-5", "transformed_gauss_4", "midpoint_by_yoshida_4"] {
        let Ok(by) = name.parse() else { panic!("{name}") };
        let error = system.check_integrator(by).unwrap_err();
        assert!(matches!(error, InputError::Hypothesis { .. }), "{name}: {error}");
        assert!(error.to_string().contains("RATTLE") && error.to_string().contains("Lobatto"), "{error}");
        let run = Motion::new(at_rest(), 1.0, StepControl::Steps { by, steps: Steps::Count(20) });
        assert!(system.run(&run, &mut ()).is_err(), "{name}");
    }
    system.check_integrator("gauss_7".parse().unwrap()).unwrap();
    // RATTLE is for separable Lagrangians.
    let general = pendulum("(1 + x^2)*(x'^2 + y'^2)/2 - 9.81*y");
    assert!(matches!(general.check_integrator("strang".parse().unwrap()), Err(InputError::Unclaimed { .. })));
    let nine = Formula::parse("sum(i, 0, n-1, v[i]^2)/2", &["q[9]"], &[]).unwrap();
    let error = System::new(&nine.with_constraints(&["q[0] = 0"]).unwrap()).err().unwrap();
    assert!(matches!(error, RuntimeError::ConstrainedDimension { found: 9, most: 8 }), "{error}");
}

/// The exponents of a driven pendulum on its circle. In q and p the angle has the length `dtheta^2 (1 + omega^2) + domega^2`,
/// so that the sum of the exponents differs from twice the rate by the logarithms of `1 + omega^2` at both ends, and each of
/// them from that of the angle by at most its largest value.
#[test]
fn lyapunov_exponents_on_the_constraints() {
    let drive = [("gamma", -0.1), ("a", 1.2)];
    let held = Formula::parse("(x'^2 + y'^2)/2 - 2*y + a*x*cos(0.7*t) + gamma*z", &["x", "y"], &drive).unwrap();
    let held = System::new(&held.with_constraints(&["x^2 + y^2 = 1"]).unwrap()).unwrap();
    let text = "u'^2/2 - 2*sin(u) + a*cos(u)*cos(0.7*t) + gamma*z";
    let angle = System::parse(text, &["u"], &drive).unwrap();
    let (end, omega) = (40.0, 1.5);
    for by in ["gauss_4", "kahan_li_6"] {
        let steps = named(by, 800);
        let motion = Motion::new(Start::new(0.0, [1.0, 0.0], [0.0, omega], 0.0), end, steps);
        let found = held.lyapunov_exponents(&motion, &mut ()).unwrap();
        assert_eq!((found.exponents.len(), found.pairs.len(), found.pairing_defect), (3, 0, None));
        let last = held.run(&motion, &mut ()).unwrap();
        let size = |square: f64| 0.5 * (1.0 + square).ln();
        let ends = size(last.p.iter().map(|p| p * p).sum()) - size(omega * omega);
        let sum: f64 = found.exponents.iter().sum();
        // Round-off of 800 steps, which the motion enlarges by e^(lambda t).
        assert!((end * (sum - 2.0 * found.rate) - ends).abs() < 1e-9, "{by}: {sum} {}", found.rate);
        let motion = Motion::new(Start::new(0.0, [0.0], [omega], 0.0), end, named("gauss_4", 800));
        let of_angle = angle.lyapunov_exponents(&motion, &mut ()).unwrap();
        for (a, b) in found.exponents.iter().zip(&of_angle.exponents) {
            assert!((a - b).abs() < 2.0 * size(16.0) / end, "{by}: {a} {b}");
        }
    }
}

/// A comparison of integrators: those for constraints, against the contact Lobatto method of order 14.
#[test]
fn a_comparison_under_constraints() {
    let system = pendulum(NEWTON);
    let motion = Motion::new(at_rest(), 0.5, named("gauss_2", 20));
    let found = system.compare(&motion, &[], &mut |_| true).unwrap();
    let least = |by: &str| {
        found.rows.iter().filter(|row| row.integrator == by).map(|row| row.error).fold(f64::INFINITY, f64::min)
    };
    for by in ["gauss_2", "gauss_7", "strang", "kahan_li_8"] {
        assert!(least(by) < 1e-4, "{by}: {}", least(by));
    }
    assert!(least("gauss_7") < 1e-12 && found.reference.starts_with("gauss_7"), "{}", found.reference);
    assert!(found.left_out.iter().any(|(by, _)| by == "midpoint"), "{:?}", found.left_out);
}

/// A chain of five coordinates runs in eight, and three in four: the coordinates in addition do not move.
#[test]
fn constraints_in_other_dimensions() {
    for n in [3usize, 5, 6] {
        let lagrangian = "sum(i, 0, n-1, v[i]^2)/2 - sum(i, 0, n-1, i*q[i])";
        let formula = Formula::parse(lagrangian, &[format!("q[{n}]").as_str()], &[]).unwrap();
        let system = System::new(&formula.with_constraints(&["sum(i, 0, n-1, q[i]^2) = 1"]).unwrap()).unwrap();
        let mut q = vec![0.0; n];
        q[0] = 1.0;
        let outcome =
            system.run(&Motion::new(Start::new(0.0, q, vec![0.0; n], 0.0), 1.0, named("gauss_3", 20)), &mut ());
        let outcome = outcome.unwrap();
        assert_eq!((outcome.q.len(), outcome.status), (n, Status::Completed));
        assert!((outcome.q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-14, "{:?}", outcome.q);
    }
}
