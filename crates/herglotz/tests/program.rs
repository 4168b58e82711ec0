//! The program: output and exit codes of its commands.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

#[path = "program/body.rs"]
mod body;
#[path = "program/body_commands.rs"]
mod body_commands;
#[path = "program/ends.rs"]
mod ends;
#[path = "program/events.rs"]
mod events;
#[path = "program/fit.rs"]
mod fit;
#[path = "program/kinds.rs"]
mod kinds;
#[path = "program/reports.rs"]
mod reports;
#[path = "program/support.rs"]
mod support;

use std::path::Path;
use std::process::Command;
use support::{Directory, REPOSITORY, column, fail, refuses_each, scene, succeed};

/// x'' = -x + gamma x', whose closed-form solution is compared with the tables.
const OSCILLATOR: &str = r#"
[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - x^2/2 + gamma*z"
parameters = { gamma = -0.2 }
[start]
x = 1.0
"x'" = 0.0
[run]
time = 400.0
integrator = "gauss_4"
step = 0.25
[want]
rows = { every = 0.3, columns = ["t", "x", "exp(-gamma*t/2)*x"] }
events = [{ when = "x", direction = "rising" }]
[sweep]
gamma = [-0.4, -0.2, 0.0]
start.x = { from = 0.5, to = 1.0, count = 2 }
"#;

fn oscillation(gamma: f64, t: f64) -> f64 {
    let omega = f64::sqrt(1.0 - gamma * gamma / 4.0);
    f64::exp(gamma * t / 2.0) * (f64::cos(omega * t) - gamma / (2.0 * omega) * f64::sin(omega * t))
}

#[test]
fn rows_and_events_are_those_of_the_motion() {
    let at = Directory::new("rows");
    let file = at.write("scene.toml", OSCILLATOR);
    let said = succeed(&["run", &file, "--out", &at.path("out"), "--set", "run.time=30", "--plot"]);
    assert!(said.starts_with("completed: 120 steps of 0.25 by gauss_4\n101 rows, 4 events"), "{said}");
    let rows = at.read("out/rows.csv");
    assert!(rows.starts_with("t,x,exp(-gamma*t/2)*x\n0.0000000000000000e0,1.0000000000000000e0,"), "{rows}");
    for (t, x) in column(&rows, "t").iter().zip(column(&rows, "x")) {
        assert!((x - oscillation(-0.2, *t)).abs() < 1e-9, "{t}: {x}");
    }
    // Events are one period apart.
    let times = column(&at.read("out/events.csv"), "t");
    let period = std::f64::consts::TAU / f64::sqrt(0.99);
    assert!(times.len() == 4 && times.windows(2).all(|t| (t[1] - t[0] - period).abs() < 1e-9), "{times:?}");
    assert!(at.read("out/columns.svg").contains("<svg"));
    // A column that is not finite in some rows.
    let of_column = at.write("column.toml", &OSCILLATOR.replace("\"exp(-gamma*t/2)*x\"", "\"log(x)\""));
    let (code, told) = fail(&["run", &of_column, "--out", &at.path("column")]);
    assert!(code == Some(0) && told.contains("the column `log(x)` is not a finite number in"), "{told}");
    // The summary as JSON.
    let said = succeed(&["run", &file, "--out", &at.path("out"), "--set", "run.time=30", "--json"]);
    let told: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((&told["status"], &told["rows"], &told["events"]), (&"completed".into(), &101.into(), &4.into()));
    assert!((told["end"]["x"].as_f64().unwrap() - oscillation(-0.2, 30.0)).abs() < 1e-9);
}

/// Interrupted runs that are resumed give the same bytes, for all kinds of rows and wherever they are interrupted.
#[test]
fn resumed_runs_are_those_that_were_not_interrupted() {
    let at = Directory::new("resume");
    // Some rows are given by steps, and the run is interrupted at some of them.
    for (i, rows) in ["every = 0.3", "every_step = 7", "every_step = 256", "at = [0.5, 399.9]"].iter().enumerate() {
        let file = at.write(&format!("{i}.toml"), &OSCILLATOR.replace("every = 0.3", rows));
        let (whole, parts) = (format!("whole_{i}"), format!("parts_{i}"));
        succeed(&["run", &file, "--out", &at.path(&whole)]);
        let first = ["run", &file, "--out", &at.path(&parts), "--interrupt-at", "0.3"];
        let (code, told) = fail(&first);
        assert_eq!(code, Some(1), "{told}");
        assert!(told.contains("--resume"), "{told}");
        let rest = ["run", &file, "--out", &at.path(&parts), "--resume"];
        assert_eq!(fail(&[rest.as_slice(), &["--interrupt-at", "0.7"]].concat()).0, Some(1));
        // Output that a killed program has written after its last checkpoint.
        let written = at.read(&format!("{parts}/rows.csv"));
        at.write(&format!("{parts}/rows.csv"), &(written.clone() + "1.0e0,2.0e"));
        succeed(&rest);
        for table in ["rows.csv", "events.csv"] {
            assert_eq!(at.read(&format!("{whole}/{table}")), at.read(&format!("{parts}/{table}")), "{rows}: {table}");
        }
        assert!(written.len() < at.read(&format!("{whole}/rows.csv")).len() || i == 3);
        // The run has ended, so that there is nothing to resume.
        let (code, told) = fail(&rest);
        assert!(code == Some(2) && told.contains("there is no interrupted run"), "{told}");
    }
    // A different scene is not resumed.
    let file = at.path("0.toml");
    fail(&["run", &file, "--out", &at.path("parts_0"), "--interrupt-at", "0.3"]);
    let (code, told) = fail(&["run", &file, "--out", &at.path("parts_0"), "--resume", "--set", "gamma=-0.3"]);
    assert!(code == Some(2) && told.contains("the scene differs from that of the interrupted run"), "{told}");
}

/// A killed run that is resumed from its last checkpoint gives the same bytes.
#[test]
fn killed_runs_go_on_from_their_checkpoint() {
    let at = Directory::new("killed");
    let long = OSCILLATOR.replace("time = 400.0", "time = 8000.0").replace("gamma = -0.2", "gamma = -1e-5");
    for (i, rows) in ["every = 30.1", "every_step = 256", "every_step = 100"].iter().enumerate() {
        let file = at.write(&format!("{i}.toml"), &long.replace("every = 0.3", rows));
        let (whole, parts) = (at.path(&format!("whole_{i}")), at.path(&format!("parts_{i}")));
        succeed(&["run", &file, "--out", &whole]);
        assert!(!Path::new(&whole).join("checkpoint.json").exists());
        // A checkpoint at every poll takes longer than the steps between polls.
        let mut child = Command::new(env!("CARGO_BIN_EXE_herglotz"))
            .args(["run", &file, "--out", &parts, "--checkpoint-every", "0", "--json"])
            .spawn()
            .unwrap();
        let saved = Path::new(&parts).join("checkpoint.json");
        let taken = || -> Option<u64> {
            serde_json::from_str::<serde_json::Value>(&std::fs::read_to_string(&saved).ok()?).ok()?["taken"].as_u64()
        };
        while taken().is_none_or(|taken| taken < 2000) {
            assert!(child.try_wait().unwrap().is_none(), "it has ended without a checkpoint");
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(taken().is_some_and(|taken| (2000..32_000).contains(&taken)), "{:?}", taken());
        succeed(&["run", &file, "--out", &parts, "--resume"]);
        for table in ["rows.csv", "events.csv"] {
            let read = |of: &str| std::fs::read_to_string(Path::new(of).join(table)).unwrap();
            assert_eq!(read(&whole), read(&parts), "{rows}: {table}");
        }
        assert!(!saved.exists());
    }
}

#[test]
fn sweeps_do_not_depend_on_threads() {
    let at = Directory::new("sweep");
    let file = at.write("scene.toml", OSCILLATOR);
    let run = |out: &str, threads: &str| {
        succeed(&["sweep", &file, "--out", &at.path(out), "--threads", threads, "--set", "run.time=20", "--plot"])
    };
    let said = run("one", "1");
    assert!(said.starts_with("6 members: 6 completed"), "{said}");
    run("three", "3");
    let table = at.read("one/sweep.csv");
    assert_eq!(table, at.read("three/sweep.csv"));
    assert!(table.starts_with("index,gamma,start.x,status,why,steps,t,x,exp(-gamma*t/2)*x\n"), "{table}");
    let (gamma, start, x) = (column(&table, "gamma"), column(&table, "start.x"), column(&table, "x"));
    let scaled = column(&table, "exp(-gamma*t/2)*x");
    assert_eq!((gamma.len(), gamma[1], start[1], gamma[4]), (6, -0.4, 1.0, 0.0));
    for i in 0..6 {
        let expected = start[i] * oscillation(gamma[i], 20.0);
        assert!((x[i] - expected).abs() < 1e-9, "member {i}: {} {expected}", x[i]);
        // The column is evaluated with the parameters of the member.
        assert!((scaled[i] - x[i] * f64::exp(-gamma[i] * 10.0)).abs() < 1e-12 * scaled[i].abs(), "member {i}");
    }
    assert!(at.read("one/sweep_0.svg").contains("<svg"));

    // x rises through 0 after 3/4 of a period, and then once in each period.
    let events = at.read("one/events.csv");
    assert_eq!(events, at.read("three/events.csv"));
    assert!(events.starts_with("index,gamma,start.x,event,t,x,x',p_x,z\n"), "{events}");
    let (gamma, t) = (column(&events, "gamma"), column(&events, "t"));
    assert_eq!(t.len(), 2 * 3 * 3);
    for (gamma, t) in gamma.iter().zip(t) {
        assert!(oscillation(*gamma, t).abs() < 1e-9, "{gamma}, {t}");
    }
    assert!(at.read("one/sweep_events_0.svg").contains("<svg"));

    // A terminal event ends its member.
    let terminal = OSCILLATOR.replace("\"rising\" }", "\"falling\", terminal = true }");
    let file = at.write("terminal.toml", &terminal);
    let said = succeed(&["sweep", &file, "--out", &at.path("terminal")]);
    assert!(said.starts_with("6 members: 0 completed (0 unresolved), 0 failed, 6 stopped by an event"), "{said}");
    // The reason contains a comma.
    let table = at.read("terminal/sweep.csv").replace(", in step", " in step");
    for (gamma, t) in column(&table, "gamma").iter().zip(column(&table, "t")) {
        assert!(t < 2.0 && oscillation(*gamma, t).abs() < 1e-9, "{gamma}, {t}: {table}");
    }
    let with_factor = terminal.replace("\"x\", \"exp", "\"log_factor\", \"exp");
    let file = at.write("factor.toml", &with_factor);
    let (code, told) = fail(&["sweep", &file, "--out", &at.path("factor")]);
    assert!(code == Some(2) && told.contains("the column `log_factor`"), "{told}");
}

/// A member that fails has a row with its status, and the others are complete.
#[test]
fn members_that_fail_are_rows() {
    let at = Directory::new("fail");
    let text = OSCILLATOR.replace("- x^2/2", "- sqrt(x)").replace("[-0.4, -0.2, 0.0]", "[-0.1]");
    let file =
        at.write("scene.toml", &text.replace("from = 0.5, to = 1.0, count = 2", "from = -1.0, to = 50.0, count = 3"));
    succeed(&["sweep", &file, "--out", &at.path("out"), "--set", "run.time=2"]);
    let table = at.read("out/sweep.csv");
    let rows: Vec<&str> = table.lines().skip(1).collect();
    assert!(rows.len() == 3 && rows[0].contains(",refused,") && rows[2].contains(",completed,"), "{table}");
}

#[test]
fn endings_are_told_by_the_code() {
    let at = Directory::new("codes");
    // The motion leaves the domain of its Lagrangian: exit code 1.
    let file = at.write("fall.toml", &OSCILLATOR.replace("- x^2/2", "- sqrt(x)"));
    let (code, told) = fail(&["run", &file, "--out", &at.path("out")]);
    assert!(code == Some(1) && told.contains("failed in step"), "{told}");
    // The rows before the failure are in the file.
    assert!(at.read("out/rows.csv").lines().count() > 2);
    // Invalid input: exit code 2, with file, line and column.
    let file = at.write("bad.toml", &OSCILLATOR.replace("x^2/2", "y^2/2"));
    let (code, told) = fail(&["run", &file, "--out", &at.path("out")]);
    assert!(code == Some(2) && told.contains(&format!("{file}, line 4, column 24: unknown name `y`")), "{told}");
    for arguments in [["run", &at.path("none.toml")], ["new", "kepplr"], ["list", "things"]] {
        assert_eq!(fail(&arguments).0, Some(2), "{arguments:?}");
    }
    assert!(fail(&["new", "keplr"]).1.contains("did you mean \"kepler\"?"));
    // A run that a terminal event ends is successful.
    let said = succeed(&["run", &scene("landing"), "--out", &at.path("landing")]);
    assert!(said.starts_with("stopped by an event at t = 2.60"), "{said}");
}

#[test]
fn plans_and_checks_say_what_holds() {
    let said = succeed(&["plan", &scene("kepler")]);
    for part in ["proved from the formula", "separable", "x*p_y - y*p_x decays as the conformal factor"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let told: serde_json::Value = serde_json::from_str(&succeed(&["plan", &scene("nonlinear"), "--json"])).unwrap();
    assert_eq!((&told["proved"]["z_affine"], &told["proved"]["separable"]), (&false.into(), &true.into()));
    let told: serde_json::Value =
        serde_json::from_str(&succeed(&["check", &scene("kepler"), "--places", "3", "--json"])).unwrap();
    assert_eq!((&told["contact"], &told["places"].as_array().unwrap().len()), (&true.into(), &3));
    let place = &told["places"][2];
    let (value, predicted) = (&place["momenta"][0]["value"], &place["momenta"][0]["predicted"]);
    assert!((value.as_f64().unwrap() - predicted.as_f64().unwrap()).abs() < 1e-12, "{place}");
    assert!(told["statements"].as_array().unwrap().iter().all(|s| s["residual"].as_f64().unwrap() < 1e-12), "{told}");
    assert!(succeed(&["check", &scene("pendulum")]).starts_with("contact: "));
}

/// Pairs of exponents have the sum of the rate of the conformal factor, to round-off; without constant `L_z` only the sum
/// of all is known; a lattice is refused.
#[test]
fn checks_have_lyapunov_exponents() {
    let of = |name: &str| -> serde_json::Value {
        serde_json::from_str(&succeed(&["check", &scene(name), "--places", "1", "--lyapunov", "--json"])).unwrap()
    };
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let lyapunov = &of("double_pendulum")["lyapunov"];
    assert_eq!((lyapunov["exponents"].as_array().unwrap().len(), lyapunov["pairs"].as_array().unwrap().len()), (5, 2));
    let rate = number(&lyapunov["rate"]);
    for pair in lyapunov["pairs"].as_array().unwrap() {
        assert!((number(&pair[0]) + number(&pair[1]) - rate).abs() <= 1e-11, "{lyapunov}");
    }
    assert!(number(&lyapunov["pairing_defect"]) <= 1e-11 && number(&lyapunov["volume_defect"]) <= 1e-11, "{lyapunov}");
    let lyapunov = &of("nonlinear")["lyapunov"];
    assert!(lyapunov["pairing_defect"].is_null() && number(&lyapunov["volume_defect"]) <= 1e-10, "{lyapunov}");
    let said = succeed(&["check", &scene("duffing"), "--places", "1", "--lyapunov"]);
    for part in ["Lyapunov exponents of ", "of the second half", "the sums of the pairs are ln(sigma_d)/h to "] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let (code, said) = fail(&["check", &scene("kinks"), "--places", "1", "--lyapunov"]);
    assert!(code == Some(2) && said.contains("it can have from 1 to 256"), "{said}");
}

/// The defects of the modified Hamiltonians of order k fall as `h^(k+1)`, for a Hamiltonian and for a Lagrangian; a system
/// that depends on time is refused.
#[test]
fn checks_have_modified_hamiltonians() {
    let at = Directory::new("modified");
    for (name, system) in [
        ("hamiltonian", "hamiltonian = \"p_x^2/2 + cos(x) + z/5 + z^2/10\""),
        ("lagrangian", "lagrangian = \"x'^2/2 - cos(x) - z/5 - z^2/10\""),
    ] {
        let text = format!(
            "version = 2\n[system]\ncoordinates = [\"x\"]\n{system}\n[start]\nx = 0.4\n\"x'\" = 0.7\n\
             [run]\ntime = 4.0\nintegrator = \"gauss_1\"\nstep = 0.05\n"
        );
        let file = at.write(&format!("{name}.toml"), &text);
        let found: serde_json::Value =
            serde_json::from_str(&succeed(&["check", &file, "--places", "1", "--modified", "--json"])).unwrap();
        let defect = |k: u64, h: f64| {
            let mut all = found["modified"].as_array().unwrap().iter();
            let one = all.find(|of| of["k"].as_u64() == Some(k) && of["h"].as_f64() == Some(h)).unwrap();
            one["defect"].as_f64().unwrap()
        };
        for k in 1..=6 {
            let slope = (defect(k, 0.025) / defect(k, 0.0125)).log2();
            assert!((slope - (k + 1) as f64).abs() < 0.15, "{name}, {k}: {slope}");
        }
        assert!(succeed(&["check", &file, "--places", "1", "--modified"]).contains("h = 0.0125"), "{name}");
    }
    let (_, said) = fail(&["check", &scene("duffing"), "--places", "1", "--modified"]);
    assert!(said.contains("autonomous"), "{said}");
}

#[test]
fn lists_templates_and_completions_are_complete() {
    let systems: serde_json::Value = serde_json::from_str(&succeed(&["list", "systems", "--json"])).unwrap();
    let at = Directory::new("new");
    for system in systems.as_array().unwrap() {
        let name = system["name"].as_str().unwrap();
        // A template is a scene that can be run.
        let file = at.write(&format!("{name}.toml"), &succeed(&["new", name]));
        assert!(succeed(&["plan", &file]).contains("steps"), "{name}");
    }
    let integrators = succeed(&["list", "integrators"]);
    assert!(integrators.lines().any(|line| line.starts_with("gauss_12 ")), "{integrators}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let text = succeed(&["completions", shell]);
        // fish writes options without their hyphens, and no values of arguments without a name. Hidden options are for tests.
        assert!(text.contains("resume") && !text.contains("interrupt-at"), "{shell}");
        if ["bash", "zsh"].contains(&shell) {
            for system in systems.as_array().unwrap() {
                assert!(text.contains(system["name"].as_str().unwrap()), "{shell}: {system}");
            }
        }
    }
    assert!(succeed(&["schema"]).contains("every_step"));
}

/// All scenes of the repository run, and each has its figure in the documentation.
#[test]
fn scenes_run() {
    let at = Directory::new("scenes");
    let page = std::fs::read_to_string(format!("{REPOSITORY}/docs/scenes.md")).unwrap();
    let mut names = Vec::new();
    for file in std::fs::read_dir(Path::new(REPOSITORY).join("scenes")).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let (name, path) = (path.file_stem().unwrap().to_str().unwrap().to_owned(), path.to_str().unwrap());
        let said = succeed(&["run", path, "--out", &at.path(&name)]);
        assert!(
            ["completed: ", "stopped by an event", "found: "].iter().any(|ending| said.starts_with(ending)),
            "{name}: {said}"
        );
        let rows = at.read(&format!("{name}/rows.csv"));
        assert!(rows.lines().count() > 100 && !rows.contains("NaN"), "{name}");
        assert!(page.contains(&format!("(scenes/{name}.svg)")), "{name} is not in docs/scenes.md");
        assert!(Path::new(REPOSITORY).join(format!("docs/scenes/{name}.svg")).exists(), "{name}");
        names.push(name);
    }
    assert_eq!(names.len(), 31, "{names:?}");
    // The results of two scenes: a momentum that decays with the conformal factor, and a conformal factor in closed
    // form.
    let kept = column(&at.read("kepler/rows.csv"), "exp(-gamma*t)*(x*y' - y*x')");
    assert!(kept.iter().all(|x| (x - 1.1).abs() < 1e-10));
    let field = at.read("field/rows.csv");
    for (t, log_factor) in column(&field, "t").iter().zip(column(&field, "log_factor")) {
        assert!((log_factor + 2.0 * t.ln()).abs() < 1e-9, "{t}");
    }
    // A path of light in closed form, a bracket that is dissipated, and a fall with an action that is not named z.
    let off = column(&at.read("ray/rows.csv"), "off");
    assert!(off.iter().all(|x| x.abs() < 1e-12), "{off:?}");
    let kept = column(&at.read("van_der_pol/rows.csv"), "exp(k*t)*(energy - k*z)");
    // The error 1e-10 of (q, p) is multiplied by e^8.
    assert!(kept.iter().all(|x| (x + 1.0).abs() < 1e-5), "{kept:?}");
    // Two containers: the published state at t = 30.
    let rows = at.read("containers/rows.csv");
    for (name, published) in [
        ("q", 1.16581228326),
        ("p", -0.53388914243),
        ("E1", 2.63142893086),
        ("E2", 3.22605226094),
        ("S", 1.10085901608),
    ] {
        let last = *column(&rows, name).last().unwrap();
        assert!((last - published).abs() < 1e-10, "{name}: {last}");
    }
    // Density times volume, the radius of a polytrope, a factor in closed form and the capture, the rate of an optimizer.
    let kept = column(&at.read("thermostat/rows.csv"), "invariant");
    assert!(kept.iter().all(|x| (x - kept[0]).abs() < 1e-9), "{kept:?}");
    let surface = *column(&at.read("lane_emden/events.csv"), "t").last().unwrap();
    assert!((surface - 3.65375374).abs() < 1e-8, "{surface}");
    let rows = at.read("spin_orbit/rows.csv");
    assert!(column(&rows, "off").iter().all(|x| x.abs() < 1e-9));
    assert!(column(&rows, "p_q").iter().rev().take(100).all(|p| (p - 1.0).abs() < 0.16));
    let rows = at.read("optimizer/rows.csv");
    for (t, factor) in column(&rows, "t").iter().zip(column(&rows, "log_factor")) {
        assert!((factor + 3.0 * (t / 0.5).ln()).abs() < 1e-9, "{factor} at {t}");
    }
    assert!(*column(&rows, "log_f").last().unwrap() < -3.0 * 20.0_f64.ln());
    assert!(column(&at.read("thrown/rows.csv"), "off").iter().all(|x| x.abs() < 1e-9));
    // A damped free body in closed form, and a heavy top of the literature.
    let last = |rows: &str, names: [&str; 3]| names.map(|name| *column(rows, name).last().unwrap());
    let found = last(&at.read("free_body/rows.csv"), ["Pi1", "Pi2", "Pi3"]);
    for (x, exact) in found.iter().zip([0.3288170813719329, -0.49415961406739636, -0.23171416126910247]) {
        assert!((x - exact).abs() < 1e-12, "{found:?}");
    }
    let found = last(&at.read("heavy_top/rows.csv"), ["tip_x", "tip_y", "tip_z"]);
    for (x, u) in found.iter().zip([-0.150416822746, 1.0 - 1.724165591637, -0.673022269560]) {
        assert!((x - u).abs() < 1e-11, "{found:?}");
    }
    assert!(column(&at.read("heavy_top/events.csv"), "tip_z").iter().all(|x| (x + 0.4).abs() < 1e-12));
}

/// A comparison names the best integrator for each error, and shorter steps have smaller errors.
#[test]
fn comparisons_name_the_best() {
    let at = Directory::new("compare");
    let file = at.write("scene.toml", &OSCILLATOR.replace("time = 400.0", "time = 20.0"));
    let said = succeed(&["compare", &file, "--out", &at.path("out")]);
    let best = said.lines().find(|line| line.starts_with("fastest integrator for an error of 1e-3: ")).unwrap();
    assert!(["1e-6: ", "1e-9: ", "1e-12: "].iter().all(|error| best.contains(error)), "{said}");
    let table = at.read("out/compare.csv");
    let of = |name: &str| {
        let rows: Vec<&str> = table.lines().filter(|line| line.starts_with(name)).collect();
        rows.iter().map(|row| row.split(',').nth(5).unwrap().parse::<f64>().unwrap()).collect::<Vec<_>>()
    };
    let errors = of("midpoint,");
    assert!(errors.len() > 2 && errors[0] > 10.0 * errors[errors.len() - 1], "{errors:?}");
    // The figure shows the best integrators.
    let picture = at.read("out/compare.svg");
    assert!(!of("gauss_8,").is_empty() && picture.contains("gauss_"));
    // A peer is measured in the same way, but cannot be named in a scene.
    let errors = of("dop853,");
    assert!(
        picture.contains(">dop853<") && errors.len() > 5 && errors[0] > 1e3 * errors[errors.len() - 1],
        "{errors:?}"
    );
    let beside = said
        .lines()
        .find(|line| line.starts_with("fastest method of another library for an error of 1e-3: dop853 with "))
        .unwrap();
    assert!(beside.contains("1e-9: dop853") && !best.contains("dop853"), "{said}");
    let told = succeed(&["compare", &file, "--out", &at.path("out"), "--json"]);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["best_of_peers"][0]["integrator"], "dop853", "{told}");
}

const LATTICE: &str = r#"
[system]
parameters = { k = 1.0, gamma = -0.1 }
[system.lattice]
sites = [2, 20]
boundary = "fixed"
site = "x'^2/2 + gamma*z"
bond = "-k*(xr - xl)^2/2"
[start]
x = "sin(pi*(i + 1)/3)*sin(pi*(j + 1)/21)"
[run]
time = 3.0
integrator = "blanes_moan_6"
step = 0.05
[want.rows]
every = 1.0
"#;

/// A lattice: its rows are those of a normal mode, and its figures and its summary are written. Commands that do not
/// apply to lattices are refused.
#[test]
fn a_lattice_runs() {
    let at = Directory::new("lattice");
    let (scene, out) = (at.write("lattice.toml", LATTICE), at.path("out"));
    let said = succeed(&["run", &scene, "--out", &out, "--plot"]);
    assert!(
        said.starts_with("completed: 60 steps of 40 sites by blanes_moan_6\n4 rows; the final state:\n  t = 3\n"),
        "{said}"
    );
    let rows = at.read("out/rows.csv");
    assert!(rows.starts_with("t,x[0],x[1],"), "{rows}");
    // From the frequencies of the mode along each direction.
    let half = |k: f64| 4.0 * (0.5 * k).sin().powi(2);
    let pi = std::f64::consts::PI;
    let omega = (half(pi / 3.0) + half(pi / 21.0) - 0.0025f64).sqrt();
    let (t, x) = (column(&rows, "t"), column(&rows, "x[26]"));
    let shape = (2.0 * pi / 3.0).sin() * (7.0 * pi / 21.0).sin();
    assert_eq!(t, [0.0, 1.0, 2.0, 3.0]);
    for (t, x) in t.iter().zip(x) {
        let expected = shape * (-0.05 * t).exp() * ((omega * t).cos() + 0.05 / omega * (omega * t).sin());
        // A method of order 6 with steps of a hundredth of the period.
        assert!((x - expected).abs() < 1e-10, "{x} for {expected} at {t}");
    }
    for figure in ["space-time.svg", "sites.svg"] {
        assert!(at.read(&format!("out/{figure}")).contains("<svg"), "{figure}");
    }
    assert!(succeed(&["run", &scene, "--out", &out, "--json"]).contains("\"rows\": 4"));
    // A value that is set is that of the file.
    succeed(&["run", &scene, "--out", &out, "--set", "k=2"]);
    let set = at.read("out/rows.csv");
    let double = at.write("double.toml", &LATTICE.replace("k = 1.0", "k = 2.0"));
    succeed(&["run", &double, "--out", &out]);
    assert!(set == at.read("out/rows.csv") && set != rows);
    let (code, said) = fail(&["run", &scene, "--out", &out, "--resume"]);
    assert!(code == Some(2) && said.contains("--resume does not apply to a lattice"), "{said}");
    // Other commands take it as a formula, up to its size.
    let by_gauss = at.write("gauss.toml", &LATTICE.replace("blanes_moan_6", "gauss_4"));
    assert!(succeed(&["plan", &by_gauss]).starts_with("60 steps of 0.05 by gauss_4"));
    let large = at.write("large.toml", &LATTICE.replace("[2, 20]", "[2, 200]"));
    for command in ["check", "compare", "sweep", "fit"] {
        let (code, said) = fail(&[command, &large]);
        assert!(code == Some(2) && said.contains("it can have from 1 to 256"), "{command}: {said}");
    }
}

/// A lattice of few sites and one of many are the same motion; so is a formula with the same start, by a formula in the index.
#[test]
fn lattices_of_few_and_many_coordinates_agree() {
    let at = Directory::new("lattices");
    let of = |name: &str, text: &str| {
        let file = at.write(&format!("{name}.toml"), text);
        succeed(&["run", &file, "--out", &at.path(name)]);
        at.read(&format!("{name}/rows.csv"))
    };
    let sparse = LATTICE.replace("blanes_moan_6", "gauss_2");
    let formula = sparse.replace("every = 1.0", "every = 1.0\ncolumns = [\"t\", \"x[0]\", \"x'[26]\", \"energy\"]");
    let (sparse, formula) = (of("sparse", &sparse), of("formula", &formula));
    for name in ["x[0]", "x'[26]", "energy"] {
        for (a, b) in column(&sparse, name).iter().zip(column(&formula, name)) {
            // Both solve the same equations of a step, to the round-off of sixty steps.
            assert!((a - b).abs() < 1e-13, "{name}: {a} {b}");
        }
    }
    let two =
        LATTICE.replace("[system]\n", "[system]\ncoordinates = [\"x\", \"y\"]\n").replace("x'^2/2", "(x'^2 + y'^2)/2");
    let two =
        two.replace("-k*(xr - xl)^2/2", "-k*((xr - xl)^2 + (yr - yl)^2)/2").replace("[start]\n", "[start]\ny = 0.5\n");
    let many = of("two", &two);
    assert!(many.starts_with("t,x_0,y_0,x_1,"), "{many}");
    let written = two
        .replace("every = 1.0", "every = 1.0\ncolumns = [\"t\", \"x_7\", \"y_39\"]")
        .replace("blanes_moan_6", "gauss_8");
    let few = of("written", &written);
    // The same start with single sites.
    let single = two.replace("y = 0.5\n", "y = 0.5\ny_39 = 0.25\n\"y_0'\" = 0.125\n");
    let single = of("single", &single);
    assert_eq!(
        (column(&single, "y_39")[0], column(&single, "y_38")[0], column(&single, "y_0'")[0]),
        (0.25, 0.5, 0.125)
    );
    for name in ["x_7", "y_39"] {
        for (a, b) in column(&many, name).iter().zip(column(&few, name)) {
            // A method of order 6 with steps of a hundredth of the period.
            assert!((a - b).abs() < 1e-10, "{name}: {a} {b}");
        }
    }
}

/// A scene of version 1 is refused with the command that translates it; what this writes has its comments and its motion.
#[test]
fn old_scenes_are_translated() {
    let at = Directory::new("migrate");
    let old = "# A chain.\nversion = 1 # old\n\n# Its sites.\n[lattice]\nsites = 20\n# The mass is 1.\nsite = \"x'^2/2 + gamma*z\"\n\
               bond = \"-(xr - xl)^2/2\"\n[lattice.parameters]\n# The rate.\ngamma = -0.1\n[start]\nx = \"sin(2*pi*i/n)\"\n[run]\n\
               time = 1.0\nintegrator = \"strang\"\nstep = 0.1\n";
    let file = at.write("old.toml", old);
    for command in ["run", "plan"] {
        let (code, said) = fail(&[command, &file]);
        let expected = "old.toml, line 5, column 1: `[lattice]` is `[system.lattice]` from version 2 of scene files on; `herglotz migrate`";
        assert!(code == Some(2) && said.contains(expected), "{said}");
    }
    let new = succeed(&["migrate", &file]);
    for part in [
        "# A chain.\n",
        "version = 2 # old\n",
        "# Its sites.\n[system.lattice]\n",
        "# The mass is 1.\n",
        "# The rate.\ngamma = -0.1\n",
    ] {
        assert!(new.contains(part), "{part}: {new}");
    }
    succeed(&["migrate", &file, "--in-place"]);
    assert_eq!(at.read("old.toml"), new);
    // x'' = -(2 sin(pi/20))^2 x - 0.1 x', to the order of the steps.
    succeed(&["run", &file, "--out", &at.path("out")]);
    let end = *column(&at.read("out/rows.csv"), "x[5]").last().unwrap();
    let omega = (4.0 * (std::f64::consts::PI / 20.0).sin().powi(2) - 0.0025f64).sqrt();
    let exact = (-0.05f64).exp() * (omega.cos() + 0.05 / omega * omega.sin());
    assert!((end - exact).abs() < 1e-4, "{end} for {exact}");
    // The new one is left as it is, also one without a version.
    assert_eq!(succeed(&["migrate", &file]), new);
    let body = "[body]\ninertia = [1.0, 2.0, 3.0]\n[start]\nomega = [1.0, 0.0, 0.0]\n";
    assert_eq!(succeed(&["migrate", &at.write("body.toml", body)]), body.replace("[body]", "[system.body]"));
    // Nothing is lost of a file that is of no version.
    let both = at.write("both.toml", &format!("{body}[system]\ncatalogue = \"pendulum\"\n"));
    let (code, said) = fail(&["migrate", &both, "--in-place"]);
    assert!(code == Some(2) && said.contains("the scene has [system] and [body]"), "{said}");
    assert!(at.read("both.toml").contains("pendulum"));
    let (code, said) = fail(&["migrate", &at.write("bad.toml", "version = \n")]);
    assert!(code == Some(2) && said.contains("bad.toml, line 1"), "{said}");
}

/// Errors of a lattice scene are reported with their position.
#[test]
fn wrong_lattices_are_refused() {
    let formula = "x = \"sin(pi*(i + 1)/3)*sin(pi*(j + 1)/21)\"";
    let changes = [
        ("gamma*z", "gama*z", "line 7, column 18: unknown name `gama`; did you mean `gamma`?"),
        ("-k*(xr - xl)^2/2", "-k*(xr - x)^2/2", "line 8, column 18: unknown name `x`"),
        ("-k*(xr - xl)^2/2", "-k*(xr' - xl')^2/2", "line 8, column 8: `bond` depends on velocities"),
        ("k = 1.0", "k = 1.0, c = 2.0", "line 3, column 16: `parameters` has `c`"),
        ("[2, 20]", "[0, 20]", "line 5, column 9: `sites` has 0 along a direction"),
        ("[2, 20]", "[2000000, 20000]", "line 5, column 9: the lattice has more than 1000000 sites"),
        ("\"fixed\"", "\"open\"", "line 6, column 12: unknown word `open`"),
        (
            "x = \"sin",
            "y = \"sin",
            "line 10, column 1: unknown name `y` in the start; the known names are x, x', p_x, z, t",
        ),
        ("x = \"sin", "\"x'\" = \"sin", "line 9, column 1: the coordinate `x` has no value at the start"),
        ("(j + 1)/21", "(k + l)/21", "line 10, column"),
        (
            formula,
            "x = [1.0, 2.0]",
            "line 10, column 5: `x` is a list of length 2; it must be a list of 40 numbers, one number for all, or a formula in `i`",
        ),
        (formula, "x = \"1/(i - 1)\"", "line 10, column 5: `x` is inf at the entry 20"),
        (formula, "x = 0.0\nz = \"1\"", "line 11, column 5: `z` is a text; it must be a number"),
        ("\"blanes_moan_6\"", "\"gauss_8\"", "line 13, column 14: `integrator` is \"gauss_8\""),
        ("step = 0.05", "", "line 11, column 1: the run of a large lattice needs"),
        ("time = 3.0", "", "line 11, column 1: the run has no `time`; add it"),
        (
            "step = 0.05",
            "accuracy = 1e-9",
            "line 14, column 12: `accuracy` takes a formula, which has at most 256 coordinates",
        ),
        (
            "every = 1.0",
            "columns = [\"t\", \"2*x[0]\"]",
            "line 16, column 17: `2*x[0]` is no column; those of a lattice",
        ),
        (
            "every = 1.0",
            "columns = [\"x'[40]\"]",
            "line 16, column 12: `x'[40]` is no column; those of a lattice of more than 256 coordinates are t, z, energy, log_factor, and of each site such names as x[39], x'[39] and p_x[39], without formulas",
        ),
        ("every = 1.0", "columns = []", "line 16, column 11: `columns` is empty"),
    ];
    refuses_each(LATTICE, &changes, |text| match herglotz::LatticeScene::read(text) {
        Err(error) => Some(error.to_string()),
        // Errors that are found when the lattice is run.
        Ok(scene) => scene.system.run(&scene.motion, &mut ()).err().map(|error| scene.explain(&error).to_string()),
    });
}

/// The columns that a scene of many sites chooses are those of the whole state.
#[test]
fn many_sites_have_columns() {
    let at = Directory::new("columns");
    let text = LATTICE.replace("[2, 20]", "[20, 20]");
    let rows = |name: &str, columns: &str| {
        let file = at.write(name, &text.replace("every = 1.0", &format!("every = 1.0\n{columns}")));
        succeed(&["run", &file, "--out", &at.path("out"), "--plot"]);
        at.read("out/rows.csv")
    };
    let whole = rows("whole.toml", "");
    let names = ["log_factor", "p_x[399]", "x[3]", "x'[250]", "energy", "z", "t"];
    let chosen = rows("chosen.toml", &format!("columns = {names:?}"));
    assert_eq!(chosen.lines().next().unwrap(), names.join(","));
    for name in &names[1..] {
        assert_eq!(column(&chosen, name), column(&whole, name), "{name}");
    }
    assert!(at.read("out/columns.svg").contains("x[3]"));
    // The rate of L is gamma, -0.1.
    let (t, log) = (column(&chosen, "t"), column(&chosen, "log_factor"));
    assert!(t.len() == 4 && t.iter().zip(&log).all(|(t, log)| (log + 0.1 * t).abs() < 1e-12), "{log:?}");
    assert_eq!(
        succeed(&["plan", &at.path("chosen.toml")]),
        "60 steps of 0.05 by blanes_moan_6, t = 0 to 3\n400 sites; steps and integrator are as given\n"
    );
}

/// A small coordinate that grows quickly is resolved where the scene gives its scale.
#[test]
fn coordinates_have_scales() {
    const SCENE: &str = r#"[system]
coordinates = ["x", "y"]
lagrangian = "(x'^2 + y'^2 - x^2 - (1 + 900*x^2)*y^2)/2"
[start]
x = 0.0
"x'" = 1.0
y = 1e-8
"y'" = 0.0
[run]
time = 5.0
accuracy = 1e-6
scales = [1.0, 1e-8]
[want]
rows = { at = [5.0], columns = ["y"] }
"#;
    let at = Directory::new("scales");
    let end = |name: &str, text: &str| {
        let file = at.write(name, text);
        succeed(&["run", &file, "--out", &at.path("out")]);
        column(&at.read("out/rows.csv"), "y")[0]
    };
    let exact = end("exact.toml", &SCENE.replace("accuracy = 1e-6", "integrator = \"gauss_16\"\nstep = 0.01"));
    let off = |y: f64| (y - exact).abs() / 1e-8;
    let (with, without) = (end("with.toml", SCENE), end("without.toml", &SCENE.replace("scales = [1.0, 1e-8]\n", "")));
    assert!(off(with) <= 1e-6 && off(without) > 1e-6, "{with:e}, {without:e}, {exact:e}");
    let changes = [
        ("[1.0, 1e-8]", "[1.0]", "line 12, column 10: `scales` has 1 numbers"),
        ("[1.0, 1e-8]", "[1.0, 0.0]", "line 12, column 10: the scale of coordinate 1 is 0"),
    ];
    for (from, to, expected) in changes {
        let file = at.write("refused.toml", &SCENE.replacen(from, to, 1));
        let (code, told) = fail(&["run", &file, "--out", &at.path("refused")]);
        assert!(code == Some(2) && told.contains(expected), "{code:?}: {told}");
    }
}
