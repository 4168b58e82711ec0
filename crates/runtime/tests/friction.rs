//! Dry friction that sticks and slips, against closed solutions.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use formula_lagrangian::Friction;
use herglotz_runtime::{
    AnyIntegrator, Column, Formula, Motion, OutputTimes, Start, Status, StepControl, Steps, System,
};
use std::f64::consts::PI;

fn of(text: &str, parameters: &[(&str, f64)], friction: Friction<'_>) -> System {
    let formula = Formula::parse(text, &["x"], parameters).unwrap().with_friction("x", friction).unwrap();
    System::new(&formula).unwrap()
}

fn plain(sliding: &str) -> Friction<'_> {
    Friction { sliding, sticking: None, surface: None }
}

/// The rows `t, x, x', slip_x` of a motion from x and x'.
fn rows(system: &System, [x, v]: [f64; 2], end: f64, way: StepControl, times: &[f64]) -> Vec<Vec<f64>> {
    let columns = ["t", "x", "x'", "slip_x"].map(|name| Column::parse(name, system.formula()).unwrap()).to_vec();
    let rows = Some(OutputTimes::At(times.to_vec()));
    let motion = Motion { rows, columns, ..Motion::new(Start::new(0.0, [x], [v], 0.0), end, way) };
    let (outcome, rows) = system.record(&motion).unwrap();
    assert_eq!(outcome.status, Status::Completed);
    rows
}

fn ways() -> [StepControl; 2] {
    let steps = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Size(0.05) };
    [StepControl::Accuracy { error: 1e-10, by: None }, steps]
}

/// A block on a belt, held by a spring: it sticks until the spring exceeds the static friction, slips back, and sticks again.
#[test]
fn a_block_on_a_belt() {
    for (fs, fd) in [(1.0, 0.6), (1.0, 1.0), (0.8, 0.1)] {
        let parameters = [("k", 1.3), ("u", 0.3), ("fs", fs), ("fd", fd)];
        let friction = Friction { sliding: "fd", sticking: Some("fs"), surface: Some("u") };
        let system = of("x'^2/2 - k*x^2/2", &parameters, friction);
        let (k, u) = (1.3_f64, 0.3);
        let (w, released) = (k.sqrt(), fs / (k * u));
        // x = fd/k + A cos w tau + B sin w tau until x' is u again; with fs = fd this is a tangential zero, at the limit of friction.
        let (a, b) = ((fs - fd) / k, u / w);
        let slips = 2.0 * (PI - (a * w / u).atan()) / w;
        let end = if fs == fd { released + 0.99 * slips } else { released + slips + 1.0 };
        let times: Vec<f64> = (0..=200).map(|i| end * f64::from(i) / 200.0).collect();
        for way in ways() {
            for row in rows(&system, [0.0, u], end, way, &times) {
                let [t, x, v, mode] = row[..] else { panic!("{row:?}") };
                let (expected, expected_v, expected_mode) = if t <= released {
                    (u * t, u, 0.0)
                } else if t <= released + slips {
                    let tau = w * (t - released);
                    let x = fd / k + a * tau.cos() + b * tau.sin();
                    (x, w * (b * tau.cos() - a * tau.sin()), 1.0)
                } else {
                    let tau = w * slips;
                    (fd / k + a * tau.cos() + b * tau.sin() + u * (t - released - slips), u, 0.0)
                };
                let case = format!("fs {fs}, fd {fd}, t {t}: {row:?}, {expected}, {expected_v}");
                assert!((x - expected).abs() < 1e-8 && (v - expected_v).abs() < 1e-8, "{case}");
                assert!(mode == expected_mode || (t - released).abs() < 1e-8, "{case}");
                // It sticks truly.
                assert!(mode != 0.0 || (v - u).abs() < 1e-14, "{case}");
            }
        }
    }
}

/// A sliding block stops, and stays where it is; on a slope that is steep it does not.
#[test]
fn a_block_stops_and_stays() {
    let system = of("m*x'^2/2 - m*g*s*x", &[("m", 2.0), ("g", 9.81), ("s", 0.1), ("mu", 0.3)], plain("mu*m*g"));
    let (up, down) = (9.81 * 0.4, 9.81 * 0.2);
    for way in ways() {
        let found = rows(&system, [0.0, 2.0], 3.0, way, &[0.1, 2.0, 3.0]);
        let stop = 2.0 * 2.0 / (2.0 * up);
        assert!((found[0][1] - (0.2 - up * 0.01 / 2.0)).abs() < 1e-9 && found[0][3] == -1.0, "{found:?}");
        for row in &found[1..] {
            assert!((row[1] - stop).abs() < 1e-9 && row[2].abs() < 1e-14 && row[3] == 0.0, "{row:?}");
        }
        // Downward it is braked less.
        let found = rows(&system, [0.0, -2.0], 3.0, way, &[3.0]);
        assert!((found[0][1] + 2.0 * 2.0 / (2.0 * down)).abs() < 1e-9 && found[0][3] == 0.0, "{found:?}");
    }
    let steep = of("m*x'^2/2 - m*g*s*x", &[("m", 2.0), ("g", 9.81), ("s", 0.5), ("mu", 0.3)], plain("mu*m*g"));
    for way in ways() {
        let found = rows(&steep, [0.0, 1.0], 2.0, way, &[2.0]);
        let (t, stop) = (1.0 / (9.81 * 0.8), 1.0 / (2.0 * 9.81 * 0.8));
        let expected = stop - 9.81 * 0.2 * (2.0 - t) * (2.0 - t) / 2.0;
        assert!((found[0][1] - expected).abs() < 1e-8 && found[0][3] == 1.0, "{found:?}, {expected}");
    }
}

/// A drive that is weaker than the friction moves nothing; a stronger one is felt from the time at which it exceeds it. L depends
/// on z, and the mass on the position.
#[test]
fn a_drive_below_and_above_the_friction() {
    let system = |a: f64| {
        let text = "(1 + x^2)*x'^2/2 - x^2/4 + a*x*sin(t) - z/10";
        of(text, &[("a", a), ("f", 0.5)], plain("f"))
    };
    for way in ways() {
        let still = rows(&system(0.49), [0.0, 0.0], 10.0, way, &[3.0, 10.0]);
        assert!(still.iter().all(|row| row[1] == 0.0 && row[2] == 0.0 && row[3] == 0.0), "{still:?}");
        let moved = rows(&system(0.8), [0.0, 0.0], 1.4, way, &[0.6, 1.4]);
        assert!(moved[0][1] == 0.0 && moved[1][1] > 1e-3 && moved[1][3] == -1.0, "{moved:?}");
    }
}

/// What has no friction that sticks is refused with the reason.
#[test]
fn refusals() {
    let refused = |text: &str, coordinates: &[&str], on: &str, friction: Friction<'_>| {
        let formula = Formula::parse(text, coordinates, &[]).unwrap();
        formula.with_friction(on, friction).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let coupled = refused("(x'^2 + y'^2 + x'*y')/2", &["x", "y"], "x", plain("1"));
    assert!(coupled.contains("choose coordinates without such terms"), "{coupled}");
    let moving = refused("x'^2/2", &["x"], "x", Friction { surface: Some("x"), ..plain("1") });
    assert!(moving.contains("must be a function of time"), "{moving}");
    let unknown = refused("x'^2/2", &["x"], "y", plain("1"));
    assert!(unknown.contains("`y`"), "{unknown}");
    let system = of("x'^2/2", &[], plain("1"));
    let twice = system.formula().with_friction("x", plain("1")).err().unwrap().to_string();
    assert!(twice.contains("has friction already"), "{twice}");
    let way = StepControl::Accuracy { error: 1e-9, by: None };
    let backward = system.run(&Motion::new(Start::new(0.0, [0.0], [1.0], 0.0), -1.0, way), &mut ());
    assert!(backward.unwrap_err().to_string().contains("no unique past"));
    let constrained = Formula::parse("(x'^2 + y'^2)/2", &["x", "y"], &[]).unwrap().with_constraints(&["x^2 + y^2 = 1"]);
    assert!(constrained.unwrap().with_friction("x", plain("1")).is_err());
}
