//! Events in scenes: columns of their own, the time from which they count, and angles that are wrapped in figures.

use crate::support::{Directory, column, refuses_each, succeed};
use herglotz::Scene;

/// A rotating pendulum. It is compared with closed forms: the energy `theta'^2/2 - a cos theta` is conserved.
const TURNING: &str = r#"[system]
coordinates = ["theta"]
lagrangian = "theta'^2/2 + a*cos(theta)"
parameters = { a = 1.0 }
[start]
theta = 0.0
"theta'" = 3.0
[run]
time = 100.0
integrator = "gauss_8"
step = 0.1
[want]
rows = { every = 0.5, columns = ["t", "theta", "theta'"] }
wrap = ["theta", "phase"]
[[want.events]]
when = "sin(theta - 1)"
direction = "rising"
from = 30.0
columns = ["energy", "turns = a*theta/(2*pi)", "p_theta - theta'"]
[[want.events]]
when = "sin(0.3*t)"
columns = ["phase = 0.3*t", "turns = 7*a"]
[sweep]
a = [1.0, 0.5]
"#;

/// The lines of a table with this entry in a column, with the header of the table.
fn lines_with(csv: &str, name: &str, entry: &str) -> String {
    let i = csv.lines().next().unwrap().split(',').position(|column| column == name).unwrap();
    let chosen = csv.lines().enumerate().filter(|(k, line)| *k == 0 || line.split(',').nth(i) == Some(entry));
    chosen.map(|(_, line)| format!("{line}\n")).collect()
}

/// Each event has its own columns, which are empty for other events, and counts from its time on, in runs and in
/// sweeps.
#[test]
fn events_have_columns_and_a_time_from_which_they_count() {
    let at = Directory::new("events");
    let file = at.write("scene.toml", TURNING);
    succeed(&["run", &file, "--out", &at.path("out")]);
    let all = at.read("out/events.csv");
    let header = "event,t,theta,theta',p_theta,z,energy,turns,p_theta - theta',phase\n";
    assert!(all.starts_with(header), "{all}");
    let first = lines_with(&all, "event", "sin(theta - 1)").replace(",\n", "\n").replace(",phase\n", "\n");
    let [t, theta, energy, turns, none] =
        ["t", "theta", "energy", "turns", "p_theta - theta'"].map(|name| column(&first, name));
    // A turn takes between 2 pi/3 and 2 pi/sqrt(5), so that about 25 to 34 turns fit into the remaining time.
    assert!((25..=34).contains(&t.len()) && t.iter().all(|t| *t >= 30.0), "{t:?}");
    for i in 0..t.len() {
        // The initial energy 3^2/2 - cos 0; a hundred steps of a method of order 16 that resolve the motion conserve it
        // up to rounding.
        assert!((energy[i] - 3.5).abs() < 1e-12 && none[i] == 0.0, "{first}");
        assert!((turns[i] * std::f64::consts::TAU - theta[i]).abs() < 1e-13 * theta[i], "{first}");
        // All events are at one point of the circle.
        assert!((theta[i] - 1.0).sin().abs() < 1e-12, "{first}");
    }
    let second = lines_with(&all, "event", "sin(0.3*t)");
    assert_eq!(second.lines().count() - 1, (30.0 / std::f64::consts::PI) as usize);
    assert!(second.lines().nth(1).unwrap().contains(",,7.0000000000000000e0,,3.14159265358979"), "{second}");

    // The events of a member, with its own parameters.
    let printed = succeed(&["sweep", &file, "--out", &at.path("sweep"), "--plot"]);
    assert!(printed.starts_with("2 members: 2 completed"), "{printed}");
    let all = at.read("sweep/events.csv");
    assert!(all.starts_with(&format!("index,a,{header}")), "{all}");
    let of_first = lines_with(&lines_with(&all, "event", "sin(theta - 1)"), "index", "0");
    let of_first: Vec<&str> = of_first.lines().skip(1).map(|line| line.split_once(",sin").unwrap().1).collect();
    let of_run: Vec<&str> = first.lines().skip(1).map(|line| line.split_once("sin").unwrap().1).collect();
    assert_eq!(of_first.len(), of_run.len());
    for (member, run) in of_first.iter().zip(of_run) {
        assert_eq!(member.trim_end_matches(','), run);
    }
    let of_other = lines_with(&lines_with(&all, "event", "sin(theta - 1)"), "index", "1");
    for (theta, turns) in column(&of_other, "theta").iter().zip(column(&of_other, "turns")) {
        assert!((turns - 0.5 * theta / std::f64::consts::TAU).abs() < 1e-13 * turns, "{of_other}");
    }
    // The columns of the first event are drawn like the coordinates.
    for i in 0..4 {
        assert!(at.read(&format!("sweep/sweep_events_{i}.svg")).contains("<svg"), "{i}");
    }
    assert!(at.read("sweep/sweep_events_2.svg").contains(">turns<"));
}

/// A run that is resumed from a checkpoint writes the same events. It is not resumed with other columns of its events.
#[test]
fn columns_of_events_after_an_interruption() {
    let at = Directory::new("events_resumed");
    // sigma is the conformal factor of the whole motion, also after an interruption.
    let damped = TURNING.replace("cos(theta)\"", "cos(theta) - 1e-3*z\"").replace("\"energy\"", "\"sigma\"");
    let file = at.write("scene.toml", &damped);
    succeed(&["run", &file, "--out", &at.path("whole")]);
    let parts = ["run", &file, "--out", &at.path("parts")];
    assert_eq!(crate::support::fail(&[&parts[..], &["--interrupt-at", "0.5"]].concat()).0, Some(1));
    let other = at.write("other.toml", &damped.replace("7*a", "8*a"));
    let (code, printed) = crate::support::fail(&["run", &other, "--out", &at.path("parts"), "--resume"]);
    assert!(code == Some(2) && printed.contains("the scene differs from that of the interrupted run"), "{printed}");
    succeed(&[&parts[..], &["--resume"]].concat());
    let events = at.read("whole/events.csv");
    assert_eq!(events, at.read("parts/events.csv"));
    let first = lines_with(&events, "event", "sin(theta - 1)").replace(",\n", "\n").replace(",phase\n", "\n");
    for (t, sigma) in column(&first, "t").iter().zip(column(&first, "sigma")) {
        assert!((sigma - (-1e-3 * t).exp()).abs() < 1e-14, "{t}: {sigma}");
    }
}

/// In a backward motion, events count at times before `from`.
#[test]
fn events_of_a_motion_that_runs_backward() {
    let at = Directory::new("events_backward");
    let backward = TURNING.replace("time = 100.0", "time = -100.0").replace("from = 30.0", "from = -30.0");
    let file = at.write("scene.toml", &backward);
    succeed(&["run", &file, "--out", &at.path("out")]);
    let first = lines_with(&at.read("out/events.csv"), "event", "sin(theta - 1)");
    let t = column(&first, "t");
    assert!((25..=34).contains(&t.len()) && t.iter().all(|t| (-100.0..=-30.0).contains(t)), "{t:?}");
}

#[test]
fn wrong_columns_and_times_of_events_are_refused() {
    let changes = [
        ("from = 30.0", "from = nan", "line 18, column 8: `from` is NaN; it must be a finite number"),
        (
            "from = 30.0",
            "from = 300.0",
            "line 18, column 8: the time 300 is outside of the motion, which runs from 0 to",
        ),
        (
            "from = 30.0",
            "from = 30.0\nterminal = true",
            "line 18, column 8: a terminal event is detected from the start; remove `from` or `terminal`",
        ),
        ("\"energy\"", "\"enrgy\"", "line 19, column 13: unknown name `enrgy`; did you mean `energy`?"),
        ("\"energy\"", "\"theta'\"", "line 19, column 12: every event already has the column `theta'`"),
        ("\"energy\"", "\"event = theta\"", "line 19, column 12: every event already has the column `event`"),
        ("\"energy\"", "\"turns = t\"", "line 19, column 25: the event has two columns `turns`"),
        (
            "a*cos(theta)\"",
            "a*cos(theta) - 0.1*z^2\"|\"energy\"|\"sigma\"",
            "line 19, column 12: `sigma` and `log_factor` are known at events only if L_z is constant",
        ),
        (
            "a*cos(theta)\"",
            "a*cos(theta) - 0.1*z^2\"|sin(theta - 1)|log_factor + 1",
            "line 16, column 8: `sigma` and `log_factor` are known at events only if L_z is constant",
        ),
        (
            "wrap = [\"theta\", \"phase\"]",
            "wrap = [\"thta\"]",
            "line 14, column 9: unknown column `thta` in `wrap`; the columns are theta, t, theta', p_theta, z, energy, turns, p_theta - theta', phase; \
             did you mean `theta`?",
        ),
        ("a = 1.0 }", "a = 1.0, b = 2.0 }", "line 4, column 25: the parameter `b` is not used in the Lagrangian"),
    ];
    refuses_each(TURNING, &changes, |text| Scene::read(text).err().map(|error| error.to_string()));
    // A parameter that occurs only in a column counts as used.
    assert!(Scene::read(&TURNING.replace("a = 1.0 }", "a = 1.0, b = 2.0 }").replace("7*a", "7*b")).is_ok());
}

/// The tick label of an axis of angles.
const HALF_TURN: &str = ">\u{2212}\u{3c0}<";

/// Angles are wrapped in all figures, and in no table.
#[test]
fn wrapped_columns_are_folded_in_pictures() {
    let at = Directory::new("wrap");
    let file = at.write("scene.toml", TURNING);
    succeed(&["run", &file, "--out", &at.path("out"), "--plot"]);
    succeed(&["sweep", &file, "--out", &at.path("sweep"), "--plot"]);
    let pictures = ["out/columns.svg", "out/phase.svg", "sweep/sweep_0.svg", "sweep/sweep_events_0.svg"];
    for picture in pictures {
        assert!(at.read(picture).contains(HALF_TURN), "{picture}");
    }
    assert!(column(&at.read("out/rows.csv"), "theta").last().unwrap() > &100.0);
    // Without `wrap`, axes are as wide as the motion.
    let free = at.write("free.toml", &TURNING.replace("wrap = [\"theta\", \"phase\"]\n", ""));
    succeed(&["run", &free, "--out", &at.path("free"), "--plot"]);
    succeed(&["sweep", &free, "--out", &at.path("free"), "--plot"]);
    for picture in pictures {
        let name = picture.split_once('/').unwrap().1;
        assert!(!at.read(&format!("free/{name}")).contains(HALF_TURN), "{picture}");
    }
}

/// A ball that bounces: a reset is written with the state before and after it, in runs, in runs that are resumed, and in
/// sweeps; forces and tables of a file beside the scene act.
#[test]
fn resets_are_written_with_the_state_before_and_after() {
    const BALL: &str = r#"[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - g*x"
parameters = { g = 2.0, e = 0.8 }
[force]
x = "lift(t)"
[tables.lift]
csv = "lift.csv"
[start]
x = 1.0
"x'" = 0.0
[run]
time = 6.0
integrator = "gauss_3"
steps = 2000
[[want.events]]
when = "x"
direction = "falling"
then = { "x'" = "-e*x'" }
columns = ["speed = abs(x')"]
[[want.events]]
when = "x'"
[sweep]
e = [0.8, 0.9]
"#;
    let at = Directory::new("resets");
    at.write("lift.csv", "t,lift\n0,0\n3,0\n");
    let file = at.write("scene.toml", BALL);
    succeed(&["run", &file, "--out", &at.path("out")]);
    let all = at.read("out/events.csv");
    assert!(all.starts_with("event,t,x,x',p_x,z,speed,x after,x' after,z after\n"), "{all}");
    let bounces = lines_with(&all, "event", "x");
    let [t, before, speed, after] = ["t", "x'", "speed", "x' after"].map(|name| column(&bounces, name));
    // It falls for 1, and flies for the velocity after each bounce.
    assert!((t[0] - 1.0).abs() < 1e-12 && (before[0] + 2.0).abs() < 1e-12 && t.len() == 5, "{bounces}");
    for i in 0..t.len() {
        assert!((after[i] + 0.8 * before[i]).abs() < 1e-12 && speed[i] == -before[i], "{bounces}");
        assert!(i == 0 || (t[i] - t[i - 1] - after[i - 1]).abs() < 1e-12, "{bounces}");
    }
    // Other events have no state after.
    let turns = lines_with(&all, "event", "x'");
    assert!(turns.lines().count() > 3 && turns.lines().skip(1).all(|line| line.ends_with(",,,,")), "{turns}");

    let parts = ["run", &file, "--out", &at.path("parts")];
    assert_eq!(crate::support::fail(&[&parts[..], &["--interrupt-at", "0.5"]].concat()).0, Some(1));
    succeed(&[&parts[..], &["--resume"]].concat());
    assert_eq!(all, at.read("parts/events.csv"));
    let printed = succeed(&["sweep", &file, "--out", &at.path("sweep")]);
    assert!(printed.starts_with("2 members: 2 completed"), "{printed}");
    let of_sweep = at.read("sweep/events.csv");
    assert!(of_sweep.starts_with("index,e,event,t,x,x',p_x,z,speed,x after,x' after,z after\n"), "{of_sweep}");
    assert!(of_sweep.contains(bounces.lines().nth(1).unwrap()), "{of_sweep}");
    // A lift above the weight from t = 3 on: the ball does not come back.
    at.write("lift.csv", "t,lift\n0,0\n3,0\n3.001,5\n");
    succeed(&["run", &file, "--out", &at.path("lifted")]);
    assert!(lines_with(&at.read("lifted/events.csv"), "event", "x").lines().count() < 4);
}
