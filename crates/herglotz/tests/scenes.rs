//! Reading scene files: messages for invalid ones, and robustness against random changes.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

#[path = "scenes/additions.rs"]
mod additions;
#[path = "scenes/constraints.rs"]
mod constraints;
#[path = "../../formula-lagrangian/tests/random/mod.rs"]
mod random;
#[path = "scenes/reference.rs"]
mod reference;
#[path = "scenes/sums_of_terms.rs"]
mod sums_of_terms;
#[path = "scenes/where_z_bites.rs"]
mod where_z_bites;

use herglotz::runtime::{InitialVelocity, OutputTimes};
use herglotz::{Scene, SceneError};
use random::Random;

const GOOD: &str = r#"[system]
coordinates = ["theta"]
lagrangian = "theta'^2/2 + cos(theta) + gamma*z"
parameters = { gamma = -0.1 }
[start]
theta = 1.0
"theta'" = 0.0
[run]
time = 100.0
accuracy = 1e-10
[want]
rows = { every = 0.1, columns = ["t", "theta", "theta'", "z", "energy", "exp(-0.1*t)*theta"] }
events = [{ when = "theta", direction = "rising" }]
[sweep]
gamma = { from = -1.0, to = 0.0, count = 101 }
"#;

const SEVERAL: &str = r#"
version = 2
[system]
coordinates = ["u[2]", "x"]
lagrangian = '''

r = u[0]^2 + x^2
  L = (u'[0]^2 + u'[1]^2 + x'^2)/2 - r^2
'''
[start]
u = [1, 2.5]
x = 0.5
p_u = [0.25, -1]
p_x = 3
z = 0.125
t = 2
[run]
time = -1
integrator = "gauss_4"
steps = 30
[want]
rows = { at = [2, 1.5, -1] }
[sweep]
start.x = [1, 2]
"start.p_u[1]" = { from = 1, to = 100, count = 3, spacing = "log" }
"#;

/// Changes that make a valid scene invalid, from and to.
const BAD: [(&str, &str); 57] = [
    // Names.
    ("cos(theta)", "cos(teta)"),
    ("gamma*z", "delta*z"),
    ("gamma = -0.1 }", "gama = -0.1 }"),
    ("\"energy\"", "\"enrgy\""),
    ("\"energy\"", "\"temperature\""),
    ("when = \"theta\"", "when = \"thta - 1\""),
    ("tim", "tme\ntim"),
    ("time = 100.0", "tme = 100.0"),
    ("[start]", "[strt]"),
    ("[want]", "[wanted]\n[want]"),
    ("theta = 1.0", "theta = 1.0\nphi = 2.0"),
    ("theta = 1.0", "theta = 1.0\n\"theta''\" = 2.0"),
    ("[sweep]\ngamma", "[sweep]\ngama"),
    ("[sweep]\ngamma", "[sweep]\nstart.thet"),
    ("[sweep]\ngamma", "[sweep]\nstart.t"),
    ("[sweep]\ngamma", "[sweep]\nstart.p_theta"),
    ("\"rising\"", "\"risng\""),
    ("accuracy = 1e-10", "integrator = \"gaus_12\"\nstep = 0.1"),
    ("accuracy = 1e-10", "integrator = \"runge_kutta\"\nstep = 0.1"),
    // Missing entries.
    ("theta = 1.0\n", ""),
    ("\"theta'\" = 0.0\n", ""),
    ("[start]\ntheta = 1.0\n\"theta'\" = 0.0\n", ""),
    ("parameters = { gamma = -0.1 }\n", ""),
    ("lagrangian = \"theta'^2/2 + cos(theta) + gamma*z\"\n", ""),
    ("coordinates = [\"theta\"]\n", ""),
    ("[run]\ntime = 100.0\naccuracy = 1e-10\n", ""),
    ("time = 100.0\n", ""),
    ("accuracy = 1e-10\n", ""),
    ("accuracy = 1e-10", "integrator = \"gauss_8\""),
    ("accuracy = 1e-10", "step = 0.1"),
    ("count = 101", "cont = 101"),
    // Superfluous or inconsistent entries.
    ("accuracy = 1e-10", "accuracy = 1e-10\nstep = 0.1"),
    ("accuracy = 1e-10", "integrator = \"gauss_8\"\nstep = 0.1\nsteps = 10"),
    ("\"theta'\" = 0.0", "\"theta'\" = 0.0\np_theta = 0.0"),
    ("every = 0.1", "every = 0.1, every_step = 3"),
    ("coordinates = ", "catalogue = \"pendulum\"\ncoordinates = "),
    ("coordinates = [\"theta\"]", "coordinates = [\"theta\", \"theta\"]"),
    ("coordinates = [\"theta\"]", "coordinates = [\"z\"]"),
    ("coordinates = [\"theta\"]", "coordinates = [\"q[257]\"]"),
    ("theta = 1.0", "theta = [1.0]"),
    ("theta = 1.0", "theta = 1,0"),
    ("time = 100.0", "time = 100.0 s"),
    ("time = 100.0", "time = \"100\""),
    ("[run]", "[run"),
    ("cos(theta)", "cos(theta"),
    // Values.
    ("time = 100.0", "time = nan"),
    ("accuracy = 1e-10", "accuracy = -1e-10"),
    ("accuracy = 1e-10", "integrator = \"gauss_8\"\nsteps = -3"),
    ("every = 0.1", "every = 0"),
    ("every = 0.1", "every = 1e-9"),
    ("every = 0.1", "at = [0, 2, 1]"),
    ("every = 0.1", "at = [0, 200]"),
    ("count = 101", "count = 0"),
    ("count = 101", "count = 10000000000"),
    ("count = 101", "count = 101, spacing = \"log\""),
    ("[system]", "version = 3\nnew = \"thing\"\n[system]"),
    // Integrators that do not apply to the system.
    ("accuracy = 1e-10", "integrator = \"transformed_gauss_8\"\nstep = 0.1"),
];

/// A kinetic term that no splitting can integrate.
const COUPLED: &str = "theta'^2*(2 + cos(theta))";

/// Changes whose errors are found when the motion is planned.
const BAD_MOTIONS: [(&str, &str); 4] = [
    ("theta'^2/2 + cos(theta)", "theta' + cos(theta)"),
    ("cos(theta)", "1/(theta - 1)"),
    ("accuracy = 1e-10", "accuracy = 1e-40"),
    ("accuracy = 1e-10", "integrator = \"gauss_8\"\nstep = 1e-300"),
];

fn changed((from, to): (&str, &str)) -> String {
    assert!(GOOD.contains(from), "{from}");
    GOOD.replacen(from, to, 1)
}

/// Reads a scene; errors have the name of a file.
fn read(text: &str) -> Result<Scene, SceneError> {
    Scene::read(text).map_err(|error| error.in_file("scene.toml"))
}

#[test]
fn bad_input_is_told_with_its_place_and_a_remedy() {
    let mut told = String::new();
    for change in BAD {
        let said = match read(&changed(change)) {
            Err(error) => error.to_string(),
            Ok(_) => "accepted".to_owned(),
        };
        told += &format!("{:?} -> {:?}\n{said}\n\n", change.0, change.1);
    }
    for change in BAD_MOTIONS {
        let scene = read(&changed(change)).unwrap();
        let error = scene.system.plan(&scene.motion()).unwrap_err();
        told += &format!("{:?} -> {:?}\n{}\n\n", change.0, change.1, scene.explain(&error));
    }
    let splitting = changed(("accuracy = 1e-10", "integrator = \"blanes_moan_6\"\nstep = 0.1"));
    let error = read(&splitting.replace("theta'^2/2 + cos(theta)", COUPLED)).err().unwrap();
    told += &format!("a splitting\n{error}\n\n");
    for change in ["gama=1", "gamma", "gamma=x", "start.thet=1", "run.step=0.1", "gamma=inf"] {
        let error = Scene::read_with(GOOD, &[change.to_owned()]).err().unwrap();
        told += &format!("--set {change}\n{error}\n\n");
    }
    told += &additions::errors();
    // Round-off depends on the instruction set of the processor.
    if let Some((before, (_, after))) =
        told.split_once("trial runs agree to ").and_then(|(a, b)| Some((a, b.split_once(')')?)))
    {
        told = format!("{before}trial runs agree to round-off){after}");
    }
    let expected = include_str!("snapshots/errors.txt");
    if told != expected {
        let first = told.lines().zip(expected.lines()).position(|(a, b)| a != b);
        panic!("at line {first:?} of snapshots/errors.txt; what is said now:\n{told}");
    }
}

/// A motion whose end is its start has the start as its only row, for all kinds of rows.
#[test]
fn a_motion_to_its_start_has_one_row() {
    let given = r#"every = 0.1, columns = ["t", "theta", "theta'", "z", "energy", "exp(-0.1*t)*theta"]"#;
    for rows in ["every = 0.5", "at = [0.0]", "every_step = 3", r#"columns = ["theta"]"#] {
        let scene = read(&GOOD.replace("time = 100.0", "time = 0.0").replace(given, rows)).unwrap();
        let (outcome, found) = scene.system.record(&scene.motion()).unwrap();
        assert_eq!((outcome.steps, outcome.t, found.len()), (0, 0.0, 1), "{rows}");
    }
}

#[test]
fn a_scene_is_what_it_says() {
    let scene = read(GOOD).unwrap();
    let motion = scene.motion();
    assert_eq!((motion.end, motion.start.q.as_slice(), scene.members().count()), (100.0, [1.0].as_slice(), 101));
    let Some(OutputTimes::At(times)) = &motion.rows else { panic!("{:?}", motion.rows) };
    assert_eq!((times.len(), times[0], times[1000]), (1001, 0.0, 100.0));
    assert_eq!(scene.columns[5].0, "exp(-0.1*t)*theta");
    let named = GOOD.replace("exp(-0.1*t)*theta", "growth = exp(-0.1*t); scaled = growth*theta");
    assert_eq!(read(&named).unwrap().columns[5].0, "scaled");

    let scene = read(SEVERAL).unwrap();
    let motion = scene.motion();
    assert_eq!((motion.start.t, motion.start.z, motion.end), (2.0, 0.125, -1.0));
    assert_eq!(motion.start.q, [1.0, 2.5, 0.5]);
    assert_eq!(motion.start.velocity, InitialVelocity::Momentum(vec![0.25, -1.0, 3.0]));
    let (members, close) = (scene.members(), |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs());
    assert_eq!(members.count(), 6);
    // The last swept quantity varies fastest.
    assert_eq!((members.values(0), members.values(2), members.values(3)[0]), (vec![1.0, 1.0], vec![1.0, 100.0], 2.0));
    assert!(close(members.values(4)[1], 10.0), "{:?}", members.values(4));
    let start = members.start(5);
    assert_eq!((start.q[2], start.velocity), (2.0, InitialVelocity::Momentum(vec![0.25, 100.0, 3.0])));
}

#[test]
fn changes_are_those_of_the_file() {
    let changes = ["gamma=-0.5", "start.theta=0.25", "start.z = 2", "run.time=7", "run.accuracy=1e-6"];
    let set = Scene::read_with(GOOD, &changes.map(str::to_owned)).unwrap();
    let text = GOOD.replace("gamma = -0.1", "gamma = -0.5").replace("theta = 1.0", "theta = 0.25\nz = 2");
    let written = read(&text.replace("time = 100.0", "time = 7").replace("1e-10", "1e-6")).unwrap();
    assert_eq!(set.fingerprint(), written.fingerprint());
    assert_ne!(set.fingerprint(), read(GOOD).unwrap().fingerprint());
}

/// All values of the run can be overridden; an accuracy and steps replace each other.
#[test]
fn changes_of_the_run() {
    let set = |changes: &[&str]| Scene::read_with(GOOD, &changes.iter().map(|c| (*c).to_owned()).collect::<Vec<_>>());
    let written = |run: &str| read(&changed(("accuracy = 1e-10", run))).unwrap();
    for (changes, run) in [
        (["run.integrator=gauss_8", "run.step=0.1"].as_slice(), "integrator = \"gauss_8\"\nstep = 0.1"),
        (&["run.step = 0.1", "run.integrator = \"gauss_8\""], "integrator = \"gauss_8\"\nstep = 0.1"),
        (&["run.integrator=strang", "run.steps=100"], "integrator = \"strang\"\nsteps = 100"),
        (&["run.steps=7", "run.accuracy=1e-6"], "accuracy = 1e-6"),
        (&["run.integrator=gauss_6"], "accuracy = 1e-10\nintegrator = \"gauss_6\""),
    ] {
        assert_eq!(set(changes).unwrap().fingerprint(), written(run).fingerprint(), "{changes:?}");
    }
    let by_steps = changed(("accuracy = 1e-10", "integrator = \"gauss_8\"\nsteps = 30"));
    let by_accuracy = Scene::read_with(&by_steps, &["run.accuracy=1e-4".to_owned()]).unwrap();
    assert_eq!(by_accuracy.fingerprint(), written("accuracy = 1e-4\nintegrator = \"gauss_8\"").fingerprint());
    let refused = |change: &str| set(&[change]).err().unwrap().to_string();
    for (change, why) in [
        ("run.steps=1.5", "whole number"),
        ("run.steps=-1", "whole number"),
        ("run.integrator=gaus_8", "unknown integrator `gaus_8`"),
        ("run.acuracy=1", "did you mean `run.accuracy`"),
        ("run.step=0.1", "no `integrator`"),
    ] {
        assert!(refused(change).contains(why), "{change}: {}", refused(change));
    }
}

/// One number for an array is the value of all its entries.
#[test]
fn one_number_for_all_entries() {
    let one = SEVERAL.replace("u = [1, 2.5]", "u = 2.5").replace("p_u = [0.25, -1]", "p_u = -1");
    let (one, all) = (read(&one).unwrap(), SEVERAL.replace("[1, 2.5]", "[2.5, 2.5]").replace("[0.25, -1]", "[-1, -1]"));
    assert_eq!(one.motion().start, read(&all).unwrap().motion().start);
    // A list must be as long as the array, and a single coordinate takes no list.
    assert!(read(&SEVERAL.replace("u = [1, 2.5]", "u = [1]")).is_err());
    assert!(read(&SEVERAL.replace("x = 0.5", "x = [0.5]")).is_err());
}

/// A parameter that is used nowhere is reported as misspelt; one that is used only in a column or an event is accepted.
#[test]
fn parameters_that_are_nowhere_are_refused() {
    let with = |parameters: &str| changed(("gamma = -0.1 }", parameters));
    let error = read(&with("gamma = -0.1, gama = -5.0 }")).err().unwrap();
    let told = error.to_string();
    assert!(told.contains("line 4") && told.contains("`gama`") && told.contains("did you mean `gamma`?"), "{told}");
    let told = read(&with("gamma = -0.1, level = 1.0 }")).err().unwrap().to_string();
    assert!(told.contains("the formulas use gamma"), "{told}");
    // A parameter whose name is only part of a longer name is unused.
    let levels = with("gamma = -0.1, level = 1.0, levels = 2.0 }").replace("exp(-0.1*t)*theta", "levels*theta");
    assert!(read(&levels).err().unwrap().to_string().contains("`level`"));
    for (from, to) in [("exp(-0.1*t)*theta", "a = level; a*theta"), ("when = \"theta\"", "when = \"theta - level\"")] {
        assert!(read(&with("gamma = -0.1, level = 1.0 }").replace(from, to)).is_ok(), "{to}");
    }
}

/// Energy, momenta and conformal factor can be used in columns and events.
#[test]
fn quantities_in_columns_and_events() {
    let quantities = changed(("exp(-0.1*t)*theta", "E = energy/sigma; E - p_theta^2"));
    assert!(read(&quantities.replace("when = \"theta\"", "when = \"energy - 0.5*sigma\"")).is_ok());
    let error = read(&changed(("when = \"theta\"", "when = \"enrgy - 1\""))).err().unwrap();
    assert_eq!(error.error.nearest.as_deref(), Some("energy"));
    assert!(read(&changed(("theta'^2/2", "energy"))).is_err());
}

#[test]
fn places_in_formulas_of_several_lines_are_those_of_the_file() {
    let bad = SEVERAL.replace("- r^2", "- rr^2");
    let error = read(&bad).err().unwrap().error;
    let line = bad.lines().position(|line| line.contains("rr^2")).unwrap() + 1;
    assert_eq!((error.line, error.column, error.length), (line, 38, 2));
    assert_eq!((error.text.trim(), error.nearest.as_deref()), ("L = (u'[0]^2 + u'[1]^2 + x'^2)/2 - rr^2", Some("r")));
}

const WORDS: [&str; 40] = [
    "[",
    "]",
    "{",
    "}",
    "=",
    ",",
    ".",
    "\"",
    "'",
    "'''",
    "\"\"\"",
    "\n",
    "#",
    "\\",
    "[[",
    "[system]\n",
    "[start]\n",
    "[sweep]\n",
    "start.x",
    "gamma",
    "theta",
    "theta'",
    "p_theta",
    "z",
    "t",
    "nan",
    "-inf",
    "1e308",
    "-1",
    "0",
    "1979-05-27",
    "true",
    "99999999999999999999",
    "catalogue = \"kepler\"\n",
    "every_step = ",
    "version = ",
    "count = ",
    "\u{3b8}",
    "\u{1f600}",
    "\\u0041",
];

const VALUES: [&str; 12] = [
    "0",
    "-1",
    "1e300",
    "inf",
    "[]",
    "[1, 2, 3]",
    "{ every = 1e-6 }",
    "\"x\"",
    "\"gauss_9\"",
    "[\"theta\"]",
    "true",
    "{ from = 1, to = 2, count = 1000000 }",
];

/// Changes valid scenes at random and reads them: each gives a scene or an error of moderate length. Returns the number
/// of valid scenes.
fn attack(seed: u64, count: usize) -> usize {
    let (mut random, mut good) = (Random(seed), 0);
    for k in 0..count {
        // In half of the cases a line is removed, inserted from the other scene, or given another value, so that most
        // of these pass the TOML reader.
        let mut lines: Vec<&str> = [GOOD, SEVERAL, additions::ADDED][k % 3].lines().collect();
        let others: Vec<&str> = [SEVERAL, additions::ADDED, GOOD][k % 3].lines().collect();
        let (line, other) = (random.below(lines.len()), random.below(others.len()));
        let with_value =
            lines[line].split_once("= ").map(|(key, _)| format!("{key}= {}", VALUES[other % VALUES.len()]));
        let by_lines = random.below(2) == 0;
        match random.below(4) {
            _ if !by_lines => {}
            0 => drop(lines.remove(line)),
            1 => lines.insert(line, others[other]),
            _ => lines[line] = with_value.as_deref().unwrap_or(others[other]),
        }
        let mut text: Vec<char> = lines.join("\n").chars().collect();
        for _ in 0..if by_lines { 0 } else { 1 + random.below(2) } {
            let (at, from) = (random.below(text.len()), random.below(text.len()));
            match random.below(6) {
                0 => drop(text.remove(at)),
                1 => text.insert(at, text[from]),
                2 => text.swap(at, from),
                3 => text[at] = char::from_u32(random.below(0x300) as u32).unwrap_or('\u{fffd}'),
                4 => drop(text.drain(at.min(from)..at.max(from).min(at.min(from) + 20))),
                _ => drop(text.splice(at..at, WORDS[random.below(WORDS.len())].chars())),
            }
            if text.is_empty() {
                break;
            }
        }
        match read(&text.into_iter().collect::<String>()) {
            Ok(scene) => {
                good += 1;
                assert!(scene.members().count() >= 1 && !scene.fingerprint().is_empty());
            }
            Err(error) => assert!(error.to_string().len() < 4000, "{error}"),
        }
    }
    good
}

#[test]
fn changes_of_good_scenes_do_no_harm() {
    let good = attack(0x9e37_79b9_7f4a_7c15, 10_000);
    // Some are accepted and some are refused.
    assert!((500..9_000).contains(&good), "{good}");
}

/// The same with a million changes: `cargo test --release -p herglotz --test scenes -- --ignored`.
#[test]
#[ignore = "takes a minute"]
fn a_million_changes_of_good_scenes_do_no_harm() {
    assert!(attack(0xd1b5_4a32_d192_ed03, 1_000_000) > 50_000);
}

#[test]
fn the_schema_is_that_of_the_types() {
    let checked_in: serde_json::Value =
        serde_json::from_str(include_str!("../../../scenes/scene.schema.json")).unwrap();
    assert_eq!(herglotz::schema(), checked_in, "write it anew: herglotz schema > scenes/scene.schema.json");
}
