//! The commands and options for scenes of rigid bodies: overrides, plans, runs that are resumed, and sweeps.

use crate::body::TOP;
use crate::support::{Directory, column, fail, scene, succeed};
use std::path::Path;

fn of_json(printed: &str) -> serde_json::Value {
    serde_json::from_str(printed).unwrap()
}

/// Values that are set, and the replacements in the file that they stand for.
type Case<'c> = (&'c [&'c str], &'c [(&'c str, &'c str)]);

/// The top for a second by inexpensive steps, without an event that ends it.
fn whole_second() -> String {
    TOP.replace(", terminal = true", "").replace("gauss_4", "strang")
}

/// A value that is set is that of a file with this value, for numbers, vectors and the run.
#[test]
fn values_of_bodies_are_set() {
    let at = Directory::new("body_set");
    let file = at.write("top.toml", &whole_second());
    let rows_of = |name: &str, file: &str, changes: &[&str]| {
        let out = at.path(name);
        let changes = changes.iter().flat_map(|change| ["--set", change]);
        let arguments: Vec<&str> = ["run", file, "--out", &out].into_iter().chain(changes).collect();
        succeed(&arguments);
        at.read(&format!("{name}/rows.csv"))
    };
    let original = rows_of("original", &file, &[]);
    let cases: [Case<'_>; 8] = [
        (&["gamma=-0.2"], &[("gamma = -0.1", "gamma = -0.2")]),
        (&["mass=14"], &[("mass = 15.0", "mass = 14.0")]),
        (&["inertia2=0.4"], &[("0.46875", "0.4")]),
        (&["inertia=[0.2, 0.4, 0.3]"], &[("[0.234375, 0.46875, 0.234375]", "[0.2, 0.4, 0.3]")]),
        (&["start.omega3=-4"], &[("-4.61538", "-4.0")]),
        (&["start.attitude=[0.6, 0.8, 0.0, 0.0]"], &[("[1.0, 0.0, 0.0, 0.0]", "[0.6, 0.8, 0.0, 0.0]")]),
        (
            &["centre1=0.25", "gravity=[0, 1, -9]"],
            &[("[0.0, 1.0, 0.0]", "[0.25, 1.0, 0.0]"), ("[0.0, 0.0, -9.81]", "[0.0, 1.0, -9.0]")],
        ),
        (&["run.steps=250", "run.integrator=gauss_5"], &[("step = 0.005", "steps = 250"), ("strang", "gauss_5")]),
    ];
    for (i, (changes, replaced)) in cases.into_iter().enumerate() {
        let text = replaced.iter().fold(whole_second(), |text, (from, to)| text.replacen(from, to, 1));
        let changed = at.write(&format!("{i}.toml"), &text);
        let expected = rows_of(&format!("file_{i}"), &changed, &[]);
        assert_eq!(rows_of(&format!("set_{i}"), &file, changes), expected, "{changes:?}");
        assert_ne!(expected, original, "{changes:?}");
    }
    // The time and the action that are not in the file.
    let rows = rows_of("start", &file, &["start.t=0.5", "start.z=2"]);
    assert_eq!((column(&rows, "t")[0], column(&rows, "z")[0]), (0.5, 2.0));
}

/// Overrides that cannot be made are refused with the names and the form that can, and an invalid value at its position
/// in the file.
#[test]
fn wrong_values_of_bodies_are_refused() {
    let at = Directory::new("body_set_refused");
    let file = at.write("top.toml", TOP);
    let cases = [
        ("gama=1", "--set, line 1, column 1: unknown name `gama`; the names that can be set are inertia1, inertia2"),
        ("gama=1", "start.omega3, start.z, start.t, inertia, centre"),
        ("gama=1", "did you mean `gamma`?"),
        ("omega1=1", "unknown name `omega1`; the names that can be set are inertia1"),
        ("gamma", "an override must be a name, `=` and a value"),
        ("mass=heavy", "`mass` must be a finite number, as in mass=0.5"),
        ("gamma=inf", "`gamma` must be a finite number"),
        ("inertia=[1.0, 2.0]", "`inertia` must be a list of 3 finite numbers"),
        ("start.omega=[1.0, nan, 0.0]", "`start.omega` must be a list of 3 finite numbers"),
        ("start.attitude=1", "`start.attitude` must be a list of 4 finite numbers"),
        ("run.steps=1.5", "`run.steps` must be a whole number"),
        ("mass=-1", "top.toml, line 3, column 8: `mass` is -1"),
        ("inertia3=3", "top.toml, line 2, column 11: `inertia` is refused"),
    ];
    for (change, expected) in cases {
        for command in ["run", "plan"] {
            let (code, message) = fail(&[command, &file, "--set", change]);
            assert!(code == Some(2) && message.contains(expected), "{command} {change}: {message}");
        }
    }
}

/// Plans have the steps of the run, and say what is computed; an accuracy has its estimate.
#[test]
fn bodies_are_planned() {
    let said = succeed(&["plan", &scene("heavy_top")]);
    let first = format!("60 steps of {} by sofroniou_spaletta_10, t = 0 .. 2\ncomputed:\n", 2.0 / 60.0);
    assert!(said.starts_with(&first), "{said}");
    for part in [
        "  gravity: ",
        "  rows: at 1001 times",
        "  events: 1 function,",
        "skipped:\n  drag: gamma = 0",
        "proved from the body:\n",
        "  z_free: ",
        "  M3 decays as the conformal factor\n  Pi2 decays as the conformal factor",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let plan = of_json(&succeed(&["plan", &scene("free_body"), "--json"]));
    let at = Directory::new("body_plan");
    let run = of_json(&succeed(&["run", &scene("free_body"), "--out", &at.path("out"), "--json"]));
    for name in ["integrator", "steps", "step_size", "estimated_error"] {
        assert_eq!(plan[name], run[name], "{name}");
    }
    assert!(plan["estimated_error"].as_f64().unwrap() <= 1e-12, "{plan}");
    assert!(plan["order"] == 10 && !plan["source"].as_str().unwrap().is_empty() && plan["members"] == 1, "{plan}");
    assert_eq!((&plan["proved"]["z_free"], &plan["proved"]["free"]), (&false.into(), &true.into()));
    assert_eq!(plan["momenta"], serde_json::json!(["M1", "M2", "M3"]));
    let entry = |what: &str| {
        let mut all = plan["items"].as_array().unwrap().iter();
        all.find(|entry| entry["what"] == what).unwrap()["computed"].as_bool().unwrap()
    };
    assert_eq!(["trial runs", "drag", "gravity", "events"].map(entry), [true, true, false, false]);
    // An override changes the plan.
    let said = succeed(&["plan", &scene("heavy_top"), "--set", "gamma=-0.5", "--set", "run.steps=80"]);
    assert!(said.starts_with("80 steps of 0.025 by") && said.contains("  drag: gamma = -0.5; "), "{said}");
}

/// Interrupted runs that are resumed give the same bytes, for all kinds of rows and columns, and so do runs that are
/// saved on the way.
#[test]
fn bodies_are_resumed() {
    let at = Directory::new("body_resume");
    let long = whole_second().replace("step = 0.005", "step = 0.0005");
    let all = "columns = [\"t\", \"Pi2\", \"M3\", \"z\"]";
    let of_rows = [
        format!("every = 0.003, {all}"),
        format!("every_step = 7, {all}"),
        format!("every_step = 64, {all}"),
        "at = [0.25, 0.999]".to_owned(),
        "every_step = 1".to_owned(),
    ];
    for (i, rows) in of_rows.iter().enumerate() {
        let file = at.write(&format!("{i}.toml"), &long.replace(&format!("every = 0.01, {all}"), rows));
        let (whole, parts, saved) = (format!("whole_{i}"), format!("parts_{i}"), format!("saved_{i}"));
        let said = succeed(&["run", &file, "--out", &at.path(&whole), "--plot"]);
        assert!(said.starts_with("completed: 2000 steps of 5.000000e-4 by strang"), "{said}");
        let (code, message) = fail(&["run", &file, "--out", &at.path(&parts), "--interrupt-at", "0.3"]);
        assert!(code == Some(1) && message.contains("--resume"), "{message}");
        let rest = ["run", &file, "--out", &at.path(&parts), "--resume", "--plot"];
        assert_eq!(fail(&[rest.as_slice(), &["--interrupt-at", "0.7"]].concat()).0, Some(1));
        // Output that a killed program has written after its last checkpoint.
        let written = at.read(&format!("{parts}/rows.csv"));
        at.write(&format!("{parts}/rows.csv"), &(written.clone() + "1.0e0,2.0e"));
        assert!(succeed(&rest).starts_with("completed: 2000 steps"));
        succeed(&["run", &file, "--out", &at.path(&saved), "--checkpoint-every", "0"]);
        for table in ["rows.csv", "events.csv"] {
            let expected = at.read(&format!("{whole}/{table}"));
            assert!(expected.lines().count() > 2, "{rows}: {table}");
            assert_eq!(at.read(&format!("{parts}/{table}")), expected, "{rows}: {table}");
            assert_eq!(at.read(&format!("{saved}/{table}")), expected, "{rows}: {table}");
        }
        assert!(written.len() < at.read(&format!("{whole}/rows.csv")).len(), "{rows}");
        // With all columns in the file, the figures are those of the whole run.
        if !rows.contains("columns") {
            let figure = |of: &str| at.read(&format!("{of}/polhode.svg"));
            assert_eq!(figure(&parts), figure(&whole), "{rows}");
        }
        // The runs have ended, so that there is nothing to resume.
        for out in [&parts, &saved] {
            assert!(!Path::new(&at.path(out)).join("checkpoint.json").exists(), "{rows}");
        }
        let (code, message) = fail(&rest);
        assert!(code == Some(2) && message.contains("there is no interrupted run"), "{message}");
    }
    // A different scene is not resumed, and the steps for an accuracy are those of the interrupted run.
    let file = at.path("0.toml");
    fail(&["run", &file, "--out", &at.path("parts_0"), "--interrupt-at", "0.3"]);
    let (code, message) = fail(&["run", &file, "--out", &at.path("parts_0"), "--resume", "--set", "gamma=-0.3"]);
    assert!(code == Some(2) && message.contains("the scene differs from that of the interrupted run"), "{message}");
    let accuracy = "run.accuracy=1e-6";
    let of = |out: &str, more: &[&str]| {
        let out = at.path(out);
        [["run", &file, "--out", &out, "--set", accuracy].as_slice(), more]
            .concat()
            .iter()
            .map(|x| (*x).to_owned())
            .collect::<Vec<_>>()
    };
    let run = |arguments: &[String]| fail(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(run(&of("whole", &[])).0, Some(0));
    assert_eq!(run(&of("parts", &["--interrupt-at", "0.5"])).0, Some(1));
    assert_eq!(run(&of("parts", &["--resume"])).0, Some(0));
    assert_eq!(at.read("parts/rows.csv"), at.read("whole/rows.csv"));
}

/// A sweep is the same for any number of threads; its members have the momenta of their bodies, and one that cannot
/// start is a row.
#[test]
fn bodies_are_swept() {
    let at = Directory::new("body_sweep");
    let text = whole_second()
        + "[sweep]\ngamma = [-0.4, 0.0]\nstart.omega3 = { from = -5.0, to = -4.0, count = 2 }\ninertia2 = [0.46875, 0.4]\n";
    let file = at.write("top.toml", &text);
    let run =
        |out: &str, threads: &str| succeed(&["sweep", &file, "--out", &at.path(out), "--threads", threads, "--plot"]);
    let said = run("one", "1");
    assert!(said.starts_with("8 members: 8 completed (0 unresolved), 0 failed"), "{said}");
    run("three", "3");
    for table in ["sweep.csv", "events.csv"] {
        assert_eq!(at.read(&format!("one/{table}")), at.read(&format!("three/{table}")), "{table}");
    }
    let table = at.read("one/sweep.csv");
    assert!(table.starts_with("index,gamma,start.omega3,inertia2,status,why,steps,t,Pi2,M3,z\n"), "{table}");
    let of = |name: &str| column(&table, name);
    let (gamma, omega, inertia) = (of("gamma"), of("start.omega3"), of("inertia2"));
    assert_eq!((gamma[4], omega[2], inertia[1], of("t")[7]), (0.0, -4.0, 0.4, 1.0));
    for i in 0..8 {
        let factor = gamma[i].exp();
        // The momenta at the start, times e^gamma; a rounding error for each of 200 steps.
        for (name, start) in [("Pi2", 150.0 * inertia[i]), ("M3", (0.234375 + 15.0) * omega[i])] {
            assert!((of(name)[i] / (factor * start) - 1.0).abs() < 1e-13, "{name} of {i}: {table}");
        }
    }
    let events = at.read("one/events.csv");
    assert!(events.starts_with("index,gamma,start.omega3,inertia2,event,t,q_w,"), "{events}");
    assert!(events.lines().skip(1).all(|line| line.contains(",tip_z + 0.3,")) && events.lines().count() > 8);
    assert!(at.read("one/sweep_0.svg").contains("<svg"));
    assert!(succeed(&["plan", &file]).contains("the sweep has 8 members"));
    // A member that cannot start, members that an event ends, and an override.
    let ended = at.write("ended.toml", &(TOP.to_owned() + "[sweep]\nmass = [15.0, -1.0, 14.0]\n"));
    let arguments = ["sweep", &ended, "--out", &at.path("ended"), "--json", "--set", "gamma=0"];
    let message = of_json(&succeed(&arguments));
    assert_eq!([&message["members"], &message["stopped"], &message["failed"]], [3, 2, 1], "{message}");
    let rows = at.read("ended/sweep.csv");
    let rows: Vec<&str> = rows.lines().collect();
    assert!(
        rows[1].contains(",stopped,") && rows[2].contains(",refused,") && rows[3].contains(",stopped,"),
        "{rows:?}"
    );
    for (sweep, expected) in [
        ("omega1 = [1.0]", "unknown name `omega1` in [sweep]; the names that can be swept are inertia1"),
        ("start.t = [1.0]", "all members start at the same time"),
        ("gamma = []", "the list of values is empty"),
    ] {
        let file = at.write("refused.toml", &format!("{TOP}[sweep]\n{sweep}\n"));
        let (code, message) = fail(&["sweep", &file, "--out", &at.path("refused")]);
        assert!(code == Some(2) && message.contains(expected), "{sweep}: {message}");
    }
    let (code, message) = fail(&["sweep", &scene("heavy_top"), "--out", &at.path("refused")]);
    assert!(code == Some(2) && message.contains("no swept values"), "{message}");
}

/// The steps of bodies are contact transformations, their momenta have their predictions, and a torque is message.
#[test]
fn bodies_are_checked() {
    for (name, momenta) in [("heavy_top", 2), ("free_body", 3)] {
        let check = of_json(&succeed(&["check", &scene(name), "--places", "5", "--json"]));
        assert!(check["contact"] == true && check["places"].as_array().unwrap().len() == 5, "{check}");
        assert!(check["contact_defect"].as_f64().unwrap() < 1e-11, "{check}");
        assert!(check["momentum_defect"].as_f64().unwrap() < 1e-13, "{check}");
        assert_eq!(check["places"][4]["momenta"].as_array().unwrap().len(), momenta, "{check}");
    }
    let message = succeed(&["check", &scene("free_body")]);
    assert!(message.contains("contact: the pullback of dz - Pi . (R^-1 dR) by a step of"), "{message}");
    let (code, message) = fail(&["check", &scene("free_body"), "--lyapunov"]);
    assert!(code == Some(2) && message.contains("--lyapunov"), "{message}");
}

/// A torque in a scene: about a principal axis the angular velocity decays in closed form.
#[test]
fn torques_of_bodies() {
    let at = Directory::new("body_torque");
    let text = "[system.body]\ninertia = [1.0, 2.0, 3.0]\ngamma = -0.1\ntorque = [\"0\", \"0\", \"-0.6*omega3\"]\n\
                [start]\nomega = [0.0, 0.0, 2.0]\n[run]\ntime = 3.0\naccuracy = 1e-11\n[want]\nrows = { every = 1.0 }\n";
    let file = at.write("braked.toml", text);
    succeed(&["run", &file, "--out", &at.path("out")]);
    let rows = at.read("out/rows.csv");
    for (t, omega) in column(&rows, "t").into_iter().zip(column(&rows, "omega3")) {
        assert!((omega - 2.0 * (-0.3 * t).exp()).abs() < 1e-10, "{t}: {omega}");
    }
    let check = of_json(&succeed(&["check", &file, "--json"]));
    assert!(check["contact"] == false && check["contact_defect"].as_f64().unwrap() > 1e-6, "{check}");
    // The defect is the virtual work of the torque.
    assert!(check["statements"][0]["residual"].as_f64().unwrap() < 1e-13, "{check}");
    assert!(succeed(&["plan", &file]).contains("torque: 0, 0, -0.6*omega3 in the body"));
    for (torque, expected) in [
        ("[\"0\", \"0\", \"-0.6*omega4\"]", "`torque`"),
        ("[\"0\", \"0\", \"energy\"]", "`energy`"),
        ("[\"0\", \"0\"]", "torque"),
    ] {
        let wrong = at.write("wrong.toml", &text.replace("[\"0\", \"0\", \"-0.6*omega3\"]", torque));
        let (code, message) = fail(&["run", &wrong, "--out", &at.path("wrong")]);
        assert!(code == Some(2) && message.contains(expected), "{torque}: {message}");
    }
    let split = at.write("split.toml", &text.replace("accuracy = 1e-11", "integrator = \"suzuki_4\"\nsteps = 10"));
    let (code, message) = fail(&["run", &split, "--out", &at.path("split")]);
    assert!(code == Some(2) && message.contains("takes no torque"), "{message}");
}
