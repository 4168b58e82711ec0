//! Forces, tables, breaks and resets in scenes.

use crate::{SceneError, read};
use herglotz::runtime::{
    Crossing, Ending, Ensemble, EnsembleMonitor, Event, MemberEnd, Motion, NotContact, RunMonitor, Start, Status,
    StepControl, Steps, Varied,
};
use herglotz::{EndsScene, Scene};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// A scene with all of them.
pub const ADDED: &str = r#"[system]
coordinates = ["height", "u[2]"]
lagrangian = "(height'^2 + u'[0]^2 + u'[1]^2)/2 - g*height + u[0]*drive(t) + gamma*z"
parameters = { g = 2.0, gamma = -0.1, c = 0.2, e = 0.8 }
[force]
height = "-c*height'*abs(height')"
"u[0]" = "-c*u'[0] + step(t)"
rayleigh = "c*u'[1]^2/2"
[tables.drive]
times = [0.0, 1.0, 2.5]
values = [0.0, 1.0, 0.5]
pieces = "cubic"
[tables.step]
times = [0.0, 4.0]
values = [0.0, 1.0]
pieces = "held"
[start]
height = 1.0
u = [0.0, 0.5]
"height'" = 0.0
"u'" = 0.5
[run]
time = 5.0
accuracy = 1e-9
breaks = [3.0]
[want]
rows = { every = 0.5, columns = ["t", "height", "u[0]", "drive(t)"] }
[[want.events]]
when = "height"
direction = "falling"
then = { "height'" = "-e*height'", z = "z + 1" }
columns = ["speed = abs(height')"]
[[want.events]]
when = "1 - u[1]"
impact = { restitution = 0.5 }
rest = { "u'[1]" = "0" }
"#;

/// Changes that make it invalid.
const BAD: [(&str, &str); 38] = [
    // Forces.
    ("[force]\nheight", "[force]\nheigth"),
    ("[force]\nheight", "[force]\nw"),
    ("[force]\nheight", "[force]\n\"height'\""),
    ("rayleigh = ", "\"u[i]\" = \"0.1*i\"\nrayleigh = "),
    ("-c*u'[0] +", "-cc*u'[0] +"),
    ("c*u'[1]^2/2", "c*u'[1]^2/2 +"),
    ("accuracy = 1e-9", "integrator = \"strang\"\nstep = 0.1"),
    // Tables.
    ("times = [0.0, 1.0, 2.5]\nvalues = [0.0, 1.0, 0.5]", "times = [0.0]\nvalues = [0.0]"),
    ("times = [0.0, 1.0, 2.5]", "times = [0.0, 1.0, 1.0]"),
    ("times = [0.0, 1.0, 2.5]", "times = [0.0, 1.0]"),
    ("times = [0.0, 1.0, 2.5]\n", ""),
    ("times = [0.0, 1.0, 2.5]\nvalues = [0.0, 1.0, 0.5]\n", ""),
    ("pieces = \"cubic\"", "csv = \"drive.csv\""),
    ("pieces = \"cubic\"", "time = \"t\""),
    ("pieces = \"cubic\"", "pieces = \"spline\""),
    ("times = [0.0, 1.0, 2.5]\nvalues = [0.0, 1.0, 0.5]", "csv = \"missing.csv\""),
    ("times = [0.0, 1.0, 2.5]\nvalues = [0.0, 1.0, 0.5]", "csv = \"samples.csv\""),
    ("times = [0.0, 1.0, 2.5]\nvalues = [0.0, 1.0, 0.5]", "csv = \"samples.csv\"\nvalue = \"forse\""),
    ("times = [0.0, 1.0, 2.5]\nvalues = [0.0, 1.0, 0.5]", "csv = \"samples.csv\"\nvalue = \"note\""),
    ("[tables.step]", "[tables.g]"),
    ("drive(t) + gamma", "drve(t) + gamma"),
    // Breaks.
    ("breaks = [3.0]", "breaks = [30.0]"),
    ("breaks = [3.0]", "breaks = [3.0, 2.0]"),
    ("breaks = [3.0]", "breaks = [nan]"),
    // Resets.
    ("then = { \"height'\"", "then = { \"heigth'\""),
    ("z = \"z + 1\"", "z = \"z + one\""),
    ("z = \"z + 1\"", "\"v[0]\" = \"1\""),
    ("then = { \"height'\" = \"-e*height'\", z = \"z + 1\" }", "then = {}"),
    ("when = \"height\"", "when = \"heigth\""),
    ("when = \"height\"", "when = \"g\""),
    ("direction = \"falling\"", "terminal = true"),
    ("direction = \"falling\"", "from = 1.0"),
    ("direction = \"falling\"", "impact = \"elastic\""),
    ("direction = \"falling\"\nthen = { \"height'\" = \"-e*height'\", z = \"z + 1\" }", "rest = { z = \"0\" }"),
    ("when = \"1 - u[1]\"", "when = \"1 - u'[1]\""),
    ("restitution = 0.5", "restitution = 1.5"),
    ("impact = { restitution = 0.5 }", "impact = \"plastic\""),
    ("rest = { \"u'[1]\"", "rest = { \"w'[1]\""),
];

/// A folder with a file of samples.
fn folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("herglotz_additions_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("samples.csv"), "# newtons\nt, force, note\n0, 1, a\n0.5, 3, b\n2, 0, c\n").unwrap();
    folder
}

fn read_in(text: &str, folder: &Path) -> Result<Scene, SceneError> {
    Scene::read_in(text, &[], folder).map_err(|error| error.in_file("scene.toml"))
}

fn changed(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    })
}

/// What is said of each invalid scene.
pub fn errors() -> String {
    let (mut told, folder) = (String::new(), folder());
    for change in BAD {
        let said = match read_in(&changed(ADDED, &[change]), &folder) {
            Err(error) => error.to_string(),
            Ok(_) => "accepted".to_owned(),
        };
        told += &format!("{:?} -> {:?}\n{said}\n\n", change.0, change.1);
    }
    let scene = read(&changed(ADDED, &[("-c*height'*abs(height')", "-sqrt(height - 10)")])).unwrap();
    let error = scene.system.plan(&scene.motion()).unwrap_err();
    told += &format!("a force that is not a number\n{}\n\n", scene.explain(&error));
    told
}

/// Keeps the crossings of a motion.
#[derive(Default)]
struct Kept(Vec<Crossing>);

impl RunMonitor for Kept {
    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.0.push(crossing.clone());
        ControlFlow::Continue(())
    }
}

fn crossings(scene: &Scene) -> (Vec<Crossing>, Status) {
    let mut kept = Kept::default();
    let outcome = scene.system.run(&scene.motion(), &mut kept).unwrap();
    (kept.0, outcome.status)
}

/// The tables of a scene give the same motion as those in its formulas, from lists and from a file.
#[test]
fn a_scene_has_what_it_says() {
    let scene = read(ADDED).unwrap();
    let formula = scene.system.formula();
    // The two of the events, and the end of the contact of the one with `rest`.
    assert!(formula.has_forces() && formula.resets() == 3 && scene.system.symmetries().is_empty());
    let (found, status) = crossings(&scene);
    assert_eq!(status, Status::Completed, "{status}");
    let first: Vec<&Crossing> = found.iter().filter(|crossing| crossing.event == 0).collect();
    assert!(first.len() >= 2 && found.iter().any(|crossing| crossing.event == 1), "{found:?}");
    for crossing in &found {
        let after = crossing.after.as_ref().unwrap();
        assert_eq!(after.q, crossing.q);
        let (i, e, z) = if crossing.event == 0 { (0, 0.8, 1.0) } else { (2, 0.5, 0.0) };
        assert!((after.v[i] + e * crossing.v[i]).abs() < 1e-12, "{crossing:?}");
        assert!((after.z - crossing.z - z).abs() < 1e-12, "{crossing:?}");
    }
    assert_eq!(first[0].columns, [first[0].v[0].abs()]);
    let row = scene.numbers_of_event(first[0]);
    assert_eq!(row.len(), scene.columns_of_events().len());
    assert_eq!(scene.columns_of_events().last().map(String::as_str), Some("z after"));
    assert!((row[row.len() - 1].unwrap() - first[0].z - 1.0).abs() < 1e-12);

    // A file, and the same samples as lists; the name of the column of values is by default that of the table.
    let lists =
        ("times = [0.0, 1.0, 2.5]\nvalues = [0.0, 1.0, 0.5]", "times = [0.0, 0.5, 2.0]\nvalues = [1.0, 3.0, 0.0]");
    let by_lists = read(&changed(ADDED, &[lists])).unwrap();
    let folder = folder();
    let by_file = read_in(&changed(ADDED, &[(lists.0, "csv = \"samples.csv\"\nvalue = \"force\"")]), &folder).unwrap();
    let end = |scene: &Scene| scene.system.run(&scene.bare_motion(), &mut ()).unwrap().q;
    assert_eq!(end(&by_lists), end(&by_file));
    assert_ne!(end(&by_lists), end(&scene));
    assert_eq!(by_lists.fingerprint(), by_file.fingerprint());
    // Everything that is added tells scenes apart.
    for change in [
        lists,
        ("breaks = [3.0]", "breaks = [2.0]"),
        ("-c*u'[0] +", "-2*c*u'[0] +"),
        ("z = \"z + 1\"", "z = \"z + 2\""),
        ("restitution = 0.5", "restitution = 0.25"),
        ("\"u'[1]\" = \"0\"", "\"u'[1]\" = \"1\""),
    ] {
        assert_ne!(read(&changed(ADDED, &[change])).unwrap().fingerprint(), scene.fingerprint(), "{change:?}");
    }
}

/// Forces in the text of L are those of [force].
#[test]
fn forces_in_the_lagrangian_are_those_of_the_table() {
    let table = r#"[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - x^2/2"
parameters = { c = 0.3 }
[force]
x = "-c*x'*abs(x')"
[start]
x = 1.0
"x'" = 0.0
[run]
time = 10.0
accuracy = 1e-10
"#;
    let lines = changed(
        table,
        &[
            ("[force]\nx = \"-c*x'*abs(x')\"\n", ""),
            ("\"x'^2/2 - x^2/2\"", "\"\"\"\nforce[x] = -c*x'*abs(x')\nx'^2/2 - x^2/2\"\"\""),
        ],
    );
    let end = |text: &str| {
        let scene = read(text).unwrap();
        scene.system.run(&scene.bare_motion(), &mut ()).unwrap()
    };
    assert_eq!(end(table), end(&lines));
    let scene = read(table).unwrap();
    let plan = scene.system.plan(&scene.motion()).unwrap();
    assert!(plan.text.contains("not contact: forced; the defect is the virtual work of the force"), "{}", plan.text);
    let check = scene.system.check(&scene.bare_motion(), 3).unwrap();
    assert_eq!((check.not_contact, check.is_contact()), (Some(NotContact::Forced), false));
    assert!(check.is_as_expected() && check.contact_defect() > 1e-6, "{check:?}");
    assert_eq!(check.statements.len(), 1);
    // A motion with a reset is not contact, but for elastic and conformal impacts.
    for (change, contact) in [
        ("then = { \"x'\" = \"-x'/2\" }", false),
        ("impact = { restitution = 0.5 }", false),
        ("impact = \"elastic\"", true),
        ("impact = { conformal = 0.5 }", true),
    ] {
        let text = changed(table, &[("[force]\nx = \"-c*x'*abs(x')\"\n", ""), ("parameters = { c = 0.3 }\n", "")]);
        let scene = read(&format!("{text}[[want.events]]\nwhen = \"x + 0.5\"\n{change}\n")).unwrap();
        let check = scene.system.check(&scene.bare_motion(), 3).unwrap();
        assert!(check.is_as_expected() && check.is_contact() == contact, "{change}: {check:?}");
    }
}

/// A ball that bounces, in closed form: the flights have the times `2 v/g`, and v is multiplied by e.
const BALL: &str = r#"[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - g*x"
parameters = { g = 2.0, e = 0.8 }
[start]
x = 1.0
"x'" = 0.0
[run]
time = 6.0
accuracy = 1e-9
[[want.events]]
when = "x"
direction = "falling"
then = { "x'" = "-e*x'" }
[[want.events]]
when = "x'"
direction = "falling"
[sweep]
e = [0.8, 0.9, 1.0]
"#;

fn flights(e: f64) -> Vec<f64> {
    // It falls for a time 1, with the velocity 2 at the end.
    let next = |(t, v): &(f64, f64)| Some((t + v, v * e));
    std::iter::successors(Some((1.0, 2.0 * e)), next).map(|(t, _)| t).take_while(|t| *t < 6.0).take(100).collect()
}

#[test]
fn bounces_are_those_of_the_closed_form_in_runs_and_ensembles() {
    let scene = read(BALL).unwrap();
    let compare = |found: &[Crossing], e: f64, off: f64| {
        let times: Vec<f64> = found.iter().filter(|crossing| crossing.event == 0).map(|crossing| crossing.t).collect();
        let expected = flights(e);
        assert!(times.len() == expected.len() && times.len() >= 3, "{e}: {times:?} {expected:?}");
        assert!(times.iter().zip(expected).all(|(a, b)| (a - b).abs() < off), "{e}: {times:?}");
        // The highest points are between the bounces, in the order of time.
        assert!(found.windows(2).all(|pair| pair[0].t <= pair[1].t && pair[0].event != pair[1].event), "{found:?}");
    };
    let (found, status) = crossings(&scene);
    assert_eq!(status, Status::Completed);
    compare(&found, 0.8, 1e-8);
    // By every kind of integrator.
    for by in ["gauss_1", "gauss_6", "strang", "blanes_moan_6", "midpoint", "midpoint_by_yoshida_4"] {
        let steps = changed(BALL, &[("accuracy = 1e-9", &format!("integrator = \"{by}\"\nstep = 0.07"))]);
        compare(&crossings(&read(&steps).unwrap()).0, 0.8, 1e-10);
    }
    // An ensemble with a restitution of its own for each member.
    struct Members(Vec<MemberEnd>);
    impl EnsembleMonitor for Members {
        fn member(&mut self, member: MemberEnd) -> ControlFlow<()> {
            self.0.push(member);
            ControlFlow::Continue(())
        }
    }
    let members = scene.members();
    let (start, values) = (|i: usize| members.start(i), |i: usize| members.parameter_values(i));
    let names = members.parameters();
    let events: Vec<Event> = scene.events.iter().map(|(_, event)| event.clone()).collect();
    let ensemble = Ensemble {
        count: members.count(),
        start: &start,
        t0: 0.0,
        varied: Some(Varied { names: &names, values: &values }),
        end: 6.0,
        step_control: scene.bare_motion().step_control,
        rows: None,
        columns: &[],
        events: &events,
        threads: Some(2),
    };
    let mut ended = Members(Vec::new());
    scene.system.ensemble(&ensemble, &mut ended).unwrap();
    assert_eq!(ended.0.len(), 3);
    for (member, e) in ended.0.iter().zip([0.8, 0.9, 1.0]) {
        assert!(matches!(&member.ending, Ok(Ending { status: Status::Completed, .. })), "{member:?}");
        compare(&member.crossings, e, 1e-7);
    }
    // Members without events are not observed.
    let ensemble = Ensemble { events: &[], columns: &[], varied: None, ..ensemble };
    let mut ended = Members(Vec::new());
    scene.system.ensemble(&ensemble, &mut ended).unwrap();
    let run = scene.system.run(&Motion::new(scene.motion().start, 6.0, scene.bare_motion().step_control), &mut ());
    let Ok(end) = &ended.0[0].ending else { panic!("{:?}", ended.0[0]) };
    assert!((end.q[0] - run.unwrap().q[0]).abs() < 1e-7, "{end:?}");
}

/// Where bounces accumulate the run ends at their limit, or continues from the state that `rest` gives.
#[test]
fn bounces_that_accumulate() {
    let long = changed(BALL, &[("time = 6.0", "time = 20.0")]);
    // 1 + 2 e (1 + e + ...) = 1 + 2 e/(1 - e)
    let limit = 9.0;
    let says_the_limit = |told: &str| {
        let at: f64 = told.split("accumulate at t = ").nth(1).unwrap().split(':').next().unwrap().parse().unwrap();
        assert!((at - limit).abs() < 1e-6, "{told}");
    };
    let by_steps = changed(&long, &[("accuracy = 1e-9", "integrator = \"gauss_4\"\nstep = 0.1")]);
    let (found, status) = crossings(&read(&by_steps).unwrap());
    says_the_limit(&status.to_string());
    assert!(found.len() > 20 && found.iter().all(|crossing| crossing.t < limit), "{}", found.len());
    // An accuracy over a span that the motion does not have is refused.
    let scene = read(&long).unwrap();
    let error = scene.explain(&scene.system.plan(&scene.motion()).unwrap_err()).to_string();
    says_the_limit(&error);
    assert!(error.contains("`rest`") && error.contains("bouncing.toml"), "{error}");
    // A ball whose velocity is that of the floor lies on it.
    for way in [&by_steps, &long] {
        let stopped = changed(way, &[("\"-e*x'\" }", "\"-e*x'\" }\nrest = { \"x'\" = \"0\" }")]);
        let scene = read(&stopped).unwrap();
        let outcome = scene.system.run(&scene.motion(), &mut ()).unwrap();
        assert_eq!((outcome.status, outcome.q), (Status::Completed, vec![0.0, 1.0]));
        assert_eq!(outcome.v, Some(vec![0.0, 0.0]));
    }
    let resting = changed(
        &long,
        &[
            ("[\"x\"]", "[\"x\", \"m\"]"),
            ("\"x'^2/2 - g*x\"", "\"force[x] = (m - 1)*g; L = (x'^2 + m'^2)/2\""),
            ("x = 1.0", "x = 1.0\nm = 0.0\n\"m'\" = 0.0"),
            ("\"-e*x'\" }", "\"-e*x'\" }\nrest = { x = \"0\", \"x'\" = \"0\", m = \"1\" }"),
        ],
    );
    let scene = read(&resting).unwrap();
    let outcome = scene.system.run(&scene.motion(), &mut ()).unwrap();
    assert_eq!((outcome.status, outcome.q.as_slice()), (Status::Completed, [0.0, 1.0].as_slice()));
}

/// `herglotz compare` lists the integrators that take the force, and says which do not.
#[test]
fn comparisons_with_a_force_say_which_integrators_take_it() {
    let text = changed(BALL, &[("x'^2/2 - g*x\"", "force[x] = -0.1*x'^3; x'^2/2 - x^2/2\"")]);
    let text = changed(&text[..text.find("[[want").unwrap()], &[("g = 2.0, e = 0.8", "")]);
    let scene = read(&text).unwrap();
    let found = scene.system.compare(&Motion { end: 2.0, ..scene.bare_motion() }, &[], &mut |_| true).unwrap();
    let has = |name: &str| found.rows.iter().any(|work| work.integrator == name);
    assert!(has("gauss_4") && !has("strang"));
    let (_, why) = found.left_out.iter().find(|(name, _)| name == "strang").unwrap();
    assert!(why.contains("force") && why.contains("gauss_4"), "{why}");
}

/// Conformal impacts change the conformal factor, which is then not known within steps.
#[test]
fn conformal_impacts_and_the_conformal_factor() {
    let conformal = changed(
        BALL,
        &[
            ("direction = \"falling\"\nthen = { \"x'\" = \"-e*x'\" }", "impact = { conformal = 0.64 }"),
            ("{ g = 2.0, e = 0.8 }", "{ g = 2.0 }"),
            ("[sweep]\ne = [0.8, 0.9, 1.0]\n", ""),
        ],
    );
    let text = conformal.clone() + "[want.rows]\nat = [0.5, 1.5]\ncolumns = [\"log_factor\"]\n";
    let (_, rows) = {
        let scene = read(&text).unwrap();
        scene.system.record(&scene.motion()).unwrap()
    };
    assert!(rows[0][0].abs() < 1e-14 && (rows[1][0] - 0.64f64.ln()).abs() < 1e-14, "{rows:?}");
    let error = read(&changed(&conformal, &[("when = \"x'\"", "when = \"x'\"\ncolumns = [\"sigma\"]")])).err().unwrap();
    assert!(error.to_string().contains("conformal impacts"), "{error}");
}

/// A fall from rest with quadratic drag covers `(1/k) ln cosh(sqrt(gk) t)`, here 8.25 with g = 9.81 and k = 0.2 in two
/// units of time: the path to this end, by a rule, with the force in its table or in the Lagrangian. Gauss methods, the
/// default, are refused at the place of the integrator.
#[test]
fn paths_with_forces() {
    let text = r#"
        system = { coordinates = ["x"], lagrangian = "x'^2/2 + g*x", parameters = { g = 9.81, k = 0.2 } }
        force = { x = "-k*x'*abs(x')" }
        start = { x = 0.0 }
        ends = { x = END, t = 2.0 }
        run = { steps = 200, integrator = "midpoint" }
    "#;
    let distance = |t: f64| (1.962f64.sqrt() * t).cosh().ln() / 0.2;
    let text = text.replace("END", &distance(2.0).to_string());
    let in_lagrangian = changed(
        &text,
        &[
            ("force = { x = \"-k*x'*abs(x')\" }", ""),
            ("\"x'^2/2 + g*x\"", "\"force[x] = -k*x'*abs(x'); x'^2/2 + g*x\""),
        ],
    );
    let [found, same] = [&text, &in_lagrangian].map(|text| {
        let scene = EndsScene::read(text).unwrap();
        scene.system.path(&scene.problem).unwrap()
    });
    assert!(found.is_found() && found.unresolved.is_none() && found.iterations <= 8, "{found:?}");
    // The same equations, up to the order of their sums.
    assert!(found.q.iter().zip(&same.q).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {same:?}");
    let error = found.t.iter().zip(&found.q).map(|(t, x)| (x - distance(*t)).abs()).fold(0.0, f64::max);
    // Of order h^2 with h = 0.01; the estimate is in units of the range of x.
    let estimate = found.error_estimate.unwrap() * distance(2.0);
    assert!(error < 1e-3 && estimate > 0.5 * error && estimate < 2.0 * error, "{estimate:e} for {error:e}");
    assert!(found.v[0].abs() < 1e-3 && found.v.iter().zip(&found.p).all(|(v, p)| (v - p).abs() < 1e-13), "{found:?}");
    for (from, to, word) in [
        ("midpoint", "gauss_2", "\"midpoint\" or \"trapezoidal\""),
        (", integrator = \"midpoint\"", "", "no discrete Lagrangian with forces"),
    ] {
        let scene = EndsScene::read(&changed(&text, &[(from, to)])).unwrap();
        let error = scene.explain(&scene.system.path(&scene.problem).unwrap_err());
        assert!(error.to_string().contains(word) && error.to_string().contains("line 6"), "{error}");
    }
    let error = EndsScene::read(&changed(&text, &[("force = { x", "force = { y")])).err().unwrap().to_string();
    assert!(error.contains('y') && error.contains("line 3"), "{error}");
}

/// A resumed run does not depend on where it was interrupted, with bounces before and after.
#[test]
fn resets_after_an_interruption() {
    struct Interrupted(Option<herglotz::runtime::ResumeState>, Vec<Crossing>);
    impl RunMonitor for Interrupted {
        fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
            self.1.push(crossing.clone());
            ControlFlow::Continue(())
        }
        fn poll(&mut self, part: f64) -> ControlFlow<()> {
            if part > 0.4 && self.0.is_none() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
        fn interrupted(&mut self, at: herglotz::runtime::ResumeState) {
            self.0 = Some(at);
        }
    }
    let scene = read(BALL).unwrap();
    let by = "gauss_4".parse().unwrap();
    let motion = Motion {
        resumable: true,
        step_control: StepControl::Steps { by, steps: Steps::Count(2000) },
        start: Start::new(0.0, [1.0], [0.0], 0.0),
        ..scene.motion()
    };
    let mut whole = Kept::default();
    let expected = scene.system.run(&motion, &mut whole).unwrap();
    let mut parts = Interrupted(None, Vec::new());
    scene.system.run(&motion, &mut parts).unwrap();
    let from = parts.0.clone().unwrap();
    let found = scene.system.resume(&motion, from, &mut parts).unwrap();
    assert_eq!((found, parts.1), (expected, whole.0));
}

fn scene(name: &str) -> Scene {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes"));
    read_in(&std::fs::read_to_string(folder.join(name)).unwrap(), folder).unwrap()
}

/// The first integral of a projectile with the drag `-c |v| v`: `1/v_x^2 + (c/g) (s sqrt(1 + s^2) + asinh s)` with
/// `s = v_y/v_x`; by the chosen integrator, and by a splitting, which takes this drag.
#[test]
fn the_projectile_has_its_first_integral() {
    let projectile = scene("projectile.toml");
    let (names, c_over_g) = (["x'", "y'"], 0.02 / 9.81);
    let place = names.map(|name| projectile.columns.iter().position(|(column, _)| column == name).unwrap());
    let by = StepControl::Steps { by: "kahan_li_6".parse().unwrap(), steps: Steps::Size(0.01) };
    for (control, bound) in [(projectile.motion().step_control, 1e-10), (by, 1e-8)] {
        let motion = Motion { step_control: control, ..projectile.motion() };
        let (_, rows) = projectile.system.record(&motion).unwrap();
        let kept = rows.iter().map(|row| {
            let (vx, s) = (row[place[0]], row[place[1]] / row[place[0]]);
            1.0 / (vx * vx) + c_over_g * (s * s.hypot(1.0) + s.asinh())
        });
        let kept: Vec<f64> = kept.collect();
        assert!(kept.len() > 200 && kept.iter().all(|x| (x / kept[0] - 1.0).abs() < bound), "{control:?} {kept:?}");
    }
}

/// The stick-slip motion in closed form: the block is carried from x = 0.2 to x = 1, and slips back as an oscillator
/// around x = fd/k.
#[test]
fn sticking_and_slipping_alternate_with_their_period() {
    let (found, status) = crossings(&scene("stick_slip.toml"));
    assert_eq!(status, Status::Completed);
    let (stick, slip) = (0.8 / 0.3, std::f64::consts::PI + 2.0 * f64::atan2(0.3, 0.4));
    let mut t = 1.0 / 0.3;
    for (k, crossing) in found.iter().enumerate() {
        assert!(crossing.event == k % 2 && (crossing.t - t).abs() < 1e-8, "{k}: {crossing:?} {t}");
        assert!((crossing.v[0] - 0.3).abs() < 1e-9, "{crossing:?}");
        t += if k % 2 == 0 { slip } else { stick };
    }
    assert_eq!(found.len(), 11);
}

/// The same motion by friction that sticks by itself, whose mode is a column.
#[test]
fn friction_sticks_and_slips_by_itself() {
    let text = r#"
[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - k*x^2/2"
parameters = { k = 1.0, u = 0.3, fs = 1.0, fd = 0.6 }
[friction.x]
sliding = "fd"
sticking = "fs"
surface = "u"
[start]
x = 0.0
"x'" = 0.3
[run]
time = 40.0
accuracy = 1e-9
[want]
rows = { every = 0.5, columns = ["t", "x'", "slip_x"] }
[sweep]
u = [0.1, 0.3]
"#;
    let scene = read(text).unwrap();
    let (outcome, rows) = scene.system.record(&scene.motion()).unwrap();
    assert_eq!(outcome.status, Status::Completed);
    let (stick, slip) = (0.8 / 0.3, std::f64::consts::PI + 2.0 * f64::atan2(0.3, 0.4));
    for row in &rows {
        // The time since it was last released, in the period of sticking and slipping.
        let since = row[0] - 1.0 / 0.3;
        let phase = since.rem_euclid(stick + slip);
        let slips = since > 0.0 && phase < slip;
        assert_eq!(row[2], f64::from(u8::from(slips)), "{row:?}");
        assert!(slips || (row[1] - 0.3).abs() < 1e-14, "{row:?}");
    }
    assert!(rows.len() == 81 && rows.iter().filter(|row| row[2] == 1.0).count() > 30);
    for (of, what) in [
        ("sliding = \"fd\"", "surface = \"fd\""),
        ("sliding = \"fd\"", "sliding = \"fd*\""),
        ("[friction.x]", "[friction.y]"),
        ("surface = \"u\"", "surface = \"x\""),
        ("time = 40.0", "time = -40.0"),
    ] {
        let wrong = read(&text.replace(of, what)).and_then(|scene| {
            let plan = scene.system.plan(&scene.motion()).map(|_| ());
            plan.map_err(|error| scene.explain(&error))
        });
        assert!(wrong.is_err(), "{what}");
    }
}
