//! Coordinates that come to rest on the surface of a reset and stay there, against closed solutions.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use crate::event_times::crossings;
use formula_lagrangian::{Direction, Reset};
use herglotz_runtime::{
    AnyIntegrator, Column, Direction as SignChanges, Event, Formula, Impact, InitialVelocity, Motion, OutputTimes,
    Start, Status, StepControl, Steps, System,
};

fn ways() -> [StepControl; 3] {
    let steps = |stages, h| StepControl::Steps { by: AnyIntegrator::Gauss { stages }, steps: Steps::Size(h) };
    [StepControl::Accuracy { error: 1e-10, by: None }, steps(4, 0.05), steps(2, 0.0025)]
}

/// A formula with the contact of a reset of restitution e on a surface with a velocity.
fn with_reset(formula: &Formula, when: &str, direction: Direction, e: &str, [v, rate]: [&str; 2]) -> System {
    let then = format!("{rate} - {e}*({v} - ({rate}))");
    let reset = Reset { when, direction, then: &[(v, &then)], rest: Some(&[(v, rate)]) };
    System::new(&formula.with_reset(reset).unwrap().with_resting_contact().unwrap()).unwrap()
}

/// The rows `t, x, x', contact_x, z` of a motion from x and x'.
fn rows(system: &System, [x, v]: [f64; 2], way: StepControl, times: &[f64]) -> Vec<[f64; 5]> {
    let columns = ["t", "x", "x'", "contact_x", "z"].map(|name| Column::parse(name, system.formula()).unwrap());
    let rows = Some(OutputTimes::At(times.to_vec()));
    let (start, end) = (Start::new(0.0, [x], [v], 0.0), *times.last().unwrap());
    let motion = Motion { rows, columns: columns.to_vec(), ..Motion::new(start, end, way) };
    let (outcome, rows) = system.record(&motion).unwrap();
    assert_eq!(outcome.status, Status::Completed, "{way:?}");
    rows.into_iter().map(|row| row.try_into().unwrap()).collect()
}

/// A ball from the height 1 over its floor with g = 1 and e = 0.5 comes to rest at 3 sqrt(2), whatever the law, the direction
/// and the place of the floor, and also below a ceiling. Then L is the constant potential, and so is the rate of z.
#[test]
fn a_ball_comes_to_rest() {
    let limit = 3.0 * f64::sqrt(2.0);
    let ball = |text: &str| Formula::parse(text, &["x"], &[("e", 0.5)]).unwrap();
    let (falls, rises) = (ball("x'^2/2 - x"), ball("x'^2/2 + x"));
    let rate = ["x'", "0"];
    let impact = |law, when: &str| {
        let formula = falls.with_impact(when, law, Some(&[("x'", "0")])).unwrap();
        System::new(&formula.with_resting_contact().unwrap()).unwrap()
    };
    let cases = [
        (with_reset(&falls, "x", Direction::Falling, "e", rate), 0.0, 1.0, 1.0, limit),
        (with_reset(&falls, "x - 0.3", Direction::Both, "e", rate), 0.3, 1.0, 1.0, limit),
        (with_reset(&falls, "0.1 - x/3", Direction::Rising, "e", rate), 0.3, 1.0, -1.0, limit),
        (with_reset(&falls, "0.3 - x", Direction::Both, "e", rate), 0.3, 1.0, -1.0, limit),
        (with_reset(&rises, "0.3 - x", Direction::Falling, "e", rate), 0.3, -1.0, 1.0, limit),
        (with_reset(&rises, "x - 0.3", Direction::Both, "e", rate), 0.3, -1.0, -1.0, limit),
        (with_reset(&falls, "x - 0.3", Direction::Falling, "0", rate), 0.3, 1.0, 1.0, f64::sqrt(2.0)),
        (impact(Impact::Restitution(0.5), "3*x - 0.9"), 0.3, 1.0, 1.0, limit),
        (impact(Impact::Restitution(0.0), "3*x - 0.9"), 0.3, 1.0, 1.0, f64::sqrt(2.0)),
        // Its restitution is the root of its factor where the potential on the floor is 0.
        (impact(Impact::Conformal(0.25), "3*x"), 0.0, 1.0, 1.0, limit),
    ];
    for (case, (system, floor, up, mode, limit)) in cases.iter().enumerate() {
        for way in ways() {
            let times = [0.0, 1.0, limit - 0.01, limit + 0.01, 5.0, 40.0];
            let found = rows(system, [floor + up, 0.0], way, &times);
            for [t, x, v, contact, _] in &found[..3] {
                assert!(up * (x - floor) > 0.0 && *contact == 0.0, "{case} by {way:?}: {t}, {x}, {v}");
            }
            let [_, at, .., z0] = found[3];
            for [t, x, v, contact, z] in &found[3..] {
                let what = format!("{case} by {way:?}: {t}, {x}, {v}, {contact}, {z}");
                assert!(
                    (x - floor).abs() <= 4.0 * f64::EPSILON && *x == at && *v == 0.0 && *contact == *mode,
                    "{what}"
                );
                assert!((z - z0 + up * x * (t - found[3][0])).abs() <= 1e-10 * (1.0 + t), "{what}");
            }
        }
    }
}

/// A ball without restitution on a plate `a sin t` lies on it until the plate falls faster than the ball would, flies, and lands
/// again, in each period.
#[test]
fn a_ball_on_a_plate() {
    let (a, g) = (2.0_f64, 1.0);
    let ball = Formula::parse("x'^2/2 - g*x", &["x"], &[("g", g), ("a", a)]).unwrap();
    let system = with_reset(&ball, "x - a*sin(t)", Direction::Falling, "0", ["x'", "a*cos(t)"]);
    let released = (g / a).asin();
    let flight = |t: f64| {
        let dt = t - released;
        a * released.sin() + a * released.cos() * dt - 0.5 * g * dt * dt
    };
    let mut landing = [released + 0.5, released + std::f64::consts::TAU];
    for _ in 0..80 {
        let middle = 0.5 * (landing[0] + landing[1]);
        landing[usize::from(flight(middle) < a * middle.sin())] = middle;
    }
    let times: Vec<f64> = (0..=180).map(|i| 0.1 * f64::from(i)).collect();
    for way in ways() {
        for [t, x, v, contact, _] in rows(&system, [0.0, a], way, &times) {
            let phase = t % std::f64::consts::TAU;
            // Landings lie in the first half of the next period.
            let flies = phase > released && phase < landing[0];
            assert!(landing[0] < std::f64::consts::TAU, "{landing:?}");
            let (expected, rate) = if flies {
                (flight(phase), a * released.cos() - g * (phase - released))
            } else {
                (a * t.sin(), a * t.cos())
            };
            let what = format!("{way:?}, t {t}: {x}, {expected}, {v}, {rate}, {contact}");
            assert!((x - expected).abs() < 1e-7 && (v - rate).abs() < 1e-7, "{what}");
            assert!(contact == f64::from(u8::from(!flies)), "{what}");
        }
    }
}

/// A ball of restitution 0.8 comes to rest on its plate hundreds of times, by flights that end in round-off. It never passes through.
#[test]
fn a_ball_does_not_fall_through_its_plate() {
    let ball = Formula::parse("x'^2/2 - x", &["x"], &[("a", 1.5)]).unwrap();
    let system = with_reset(&ball, "x - a*cos(t)", Direction::Falling, "0.8", ["x'", "-a*sin(t)"]);
    for k in 0..6 {
        let a = 1.5 + 1e-3 * f64::from(k);
        let system = system.with_parameters(&[("a", a)]).unwrap();
        let columns = ["t", "x"].map(|name| Column::parse(name, system.formula()).unwrap()).to_vec();
        let steps = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Size(0.25) };
        let rows = Some(OutputTimes::Every(4));
        let motion = Motion { rows, columns, ..Motion::new(Start::new(0.0, [4.0], [0.0], 0.0), 20000.0, steps) };
        let (outcome, rows) = system.record(&motion).unwrap();
        assert_eq!((outcome.status, rows.len()), (Status::Completed, 20001), "{a}");
        let fallen = rows.iter().find(|row| row[1] < a * row[0].cos() - 1e-9);
        assert!(fallen.is_none(), "{a}: {fallen:?}");
    }
}

/// The changes of a mode are events: the state is that after them. They do not end a motion.
#[test]
fn changes_of_the_mode_are_events() {
    let ball = Formula::parse("x'^2/2 - g*x", &["x"], &[("g", 1.0), ("a", 2.0)]).unwrap();
    let system = with_reset(&ball, "x - a*sin(t)", Direction::Falling, "0", ["x'", "a*cos(t)"]);
    let event = |text: &str| Event::new(system.formula().expression(text).unwrap());
    let events = vec![
        event("contact_x"),
        Event { direction: SignChanges::Rising, ..event("contact_x") },
        Event { direction: SignChanges::Falling, ..event("contact_x") },
        Event { reset: Some(0), ..event("x") },
    ];
    for way in ways() {
        let motion = Motion { events: events.clone(), ..Motion::new(Start::new(0.0, [0.0], [2.0], 0.0), 18.0, way) };
        let found = crossings(&system, &motion);
        let times = |event: usize| found.iter().filter(|at| at.event == event).map(|at| at.t).collect::<Vec<f64>>();
        let released = f64::asin(0.5);
        let expected: Vec<f64> = (0..3).map(|k| released + f64::from(k) * std::f64::consts::TAU).collect();
        assert_eq!((times(0).len(), times(1)), (6, times(3)), "{way:?}");
        assert!(times(2).iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-8) && times(2).len() == 3, "{way:?}");
        let terminal = vec![Event { terminal: true, ..event("contact_x") }];
        let refused = system.run(&Motion { events: terminal, ..motion }, &mut ()).unwrap_err().to_string();
        assert!(refused.contains("do not end a motion"), "{refused}");
    }
}

/// A force that grows pulls the ball off the floor where it exceeds the weight: with an acceleration that grows from 0.
#[test]
fn a_force_pulls_a_ball_off() {
    for (floor, direction) in
        [(0.0, Direction::Falling), (0.3, Direction::Both), (1e3, Direction::Falling), (1e3, Direction::Both)]
    {
        let text = format!("m*x'^2/2 - m*g*(x - {floor:?}) + k*t*x + c*z");
        let parameters = [("m", 2.0), ("g", 1.5), ("k", 0.7), ("c", 0.0)];
        let ball = Formula::parse(&text, &["x"], &parameters).unwrap();
        let system = with_reset(&ball, &format!("x - {floor:?}"), direction, "0.5", ["x'", "0"]);
        let released = 2.0 * 1.5 / 0.7;
        for way in ways() {
            let times = [1.0, released - 0.01, released + 0.01, 5.0, 8.0];
            for [t, x, v, contact, _] in rows(&system, [floor, 0.0], way, &times) {
                let dt = f64::max(t - released, 0.0);
                let (height, rate) = (0.7 * dt.powi(3) / 12.0, 0.7 * dt * dt / 4.0);
                let what = format!("{way:?} on {floor}, t {t}: {x}, {height}, {v}, {rate}");
                let tolerance = 1e-8 + 64.0 * f64::EPSILON * floor;
                assert!((x - floor - height).abs() < tolerance && (v - rate).abs() < tolerance, "{what}");
                assert!(contact == f64::from(u8::from(dt == 0.0)), "{what}");
            }
        }
    }
}

/// In two coordinates the other one moves on, with drag; the mass depends on it, and L on z.
#[test]
fn the_other_coordinate_moves_on() {
    let text = "(x'^2 + (1 + s^2)*s'^2)/2 - x*(2 + s) - s^2/2 - z/5";
    let free = Formula::parse(text, &["x", "s"], &[]).unwrap();
    let system = with_reset(&free, "x", Direction::Falling, "0", ["x'", "0"]);
    let alone = System::new(&Formula::parse("(1 + s^2)*s'^2/2 - s^2/2 - z/5", &["s"], &[]).unwrap()).unwrap();
    let run = |system: &System, q: &[f64], v: &[f64], way| {
        system.run(&Motion::new(Start::new(0.0, q, v, 0.0), 6.0, way), &mut ()).unwrap()
    };
    for way in ways() {
        let (together, expected) = (run(&system, &[0.0, 0.5], &[0.0, 1.0], way), run(&alone, &[0.5], &[1.0], way));
        assert!((together.q[1] - expected.q[0]).abs() < 1e-9 && together.q[0] == 0.0, "{together:?}, {expected:?}");
        assert_eq!((together.status, together.q[2]), (Status::Completed, 1.0));
        assert!((together.z.unwrap() - expected.z.unwrap()).abs() < 1e-9);
    }
}

/// The position in contact has the error of the steps; the ball leaves the plate from the plate itself, and not from below.
#[test]
fn coarse_steps() {
    let ball = Formula::parse("x'^2/2 - x", &["x"], &[]).unwrap();
    let system = with_reset(&ball, "x - 2*sin(t)", Direction::Falling, "0", ["x'", "2*cos(t)"]);
    let way = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 1 }, steps: Steps::Size(0.1) };
    let times: Vec<f64> = (0..=1000).map(|i| 0.1 * f64::from(i)).collect();
    for [t, x, _, contact, _] in rows(&system, [0.0, 2.0], way, &times) {
        let above = x - 2.0 * t.sin();
        // Of order 2, over one period.
        assert!(if contact == 1.0 { above.abs() < 0.02 } else { above > -1e-9 }, "{t}: {x}, {above}, {contact}");
    }
}

/// A start on the floor is in contact where the ball is pressed onto it. A start by its momentum is that of a free ball; a motion backward has no unique past; the state at an end is a start.
#[test]
fn starts() {
    let ball = Formula::parse("x'^2/2 - x", &["x"], &[]).unwrap();
    let system = with_reset(&ball, "x", Direction::Falling, "0.5", ["x'", "0"]);
    let [way, ..] = ways();
    let momentum = Start { velocity: InitialVelocity::Momentum(vec![0.0]), ..Start::new(0.0, [1.0], [0.0], 0.0) };
    let by_momentum = system.run(&Motion::new(momentum, 10.0, way), &mut ()).unwrap();
    let by_velocity = system.run(&Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 10.0, way), &mut ()).unwrap();
    assert_eq!((&by_momentum.q, by_momentum.z), (&by_velocity.q, by_velocity.z));
    let again = Start::new(10.0, by_velocity.q.clone(), by_velocity.v.clone().unwrap(), 0.0);
    let on = system.run(&Motion::new(again, 20.0, way), &mut ()).unwrap();
    assert_eq!((on.q, on.status), (vec![0.0, 1.0], Status::Completed));
    let risen =
        with_reset(&Formula::parse("x'^2/2 + x", &["x"], &[]).unwrap(), "x", Direction::Falling, "0.5", ["x'", "0"]);
    let [start, end] = rows(&risen, [0.0, 0.0], way, &[0.0, 1.0])[..] else { panic!("two rows") };
    assert!(start[3] == 0.0 && (end[1] - 0.5).abs() < 1e-9, "{start:?}, {end:?}");
    let backward = system.run(&Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), -1.0, way), &mut ());
    assert!(backward.unwrap_err().to_string().contains("no unique past"));
}
