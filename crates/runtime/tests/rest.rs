//! Motions that come to rest before the end that was requested: they stay there, in every output.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use crate::motions::Seen;
use formula_lagrangian::{Formula, Reset};
use herglotz_runtime::{
    AnyIntegrator, Column, Crossing, EndCovector, Ensemble, Event, MemberEnd, Motion, MotionFit, OutputTimes, Series,
    Start, Status, StepControl, Steps, System, Unknown,
};

/// An oscillator about `a` = 0 with drag, whose action tends to `c/g` as it comes to rest.
const FORMULA: &str = "x'^2/2 - (x - a)^2/2 + c - g*z";
const PARAMETERS: [(&str, f64); 3] = [("a", 0.0), ("c", 0.5), ("g", 2.0)];

fn formula() -> Formula {
    Formula::parse(FORMULA, &["x"], &PARAMETERS).unwrap()
}

fn oscillator() -> System {
    System::new(&formula()).unwrap()
}

/// By accuracy, and by steps of two kinds. The action of splittings rests where their steps have it, not at `c/g`.
fn ways() -> [StepControl; 3] {
    let by_steps = |name: &str, h: f64| StepControl::Steps { by: name.parse().unwrap(), steps: Steps::Size(h) };
    [StepControl::Accuracy { error: 1e-9, by: None }, by_steps("gauss_8", 0.5), by_steps("gauss_3", 0.125)]
}

/// From 1 at rest, until the time `end`.
fn motion(end: f64, way: StepControl) -> Motion {
    Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), end, way)
}

fn columns(of: &Formula) -> Vec<Column> {
    ["t", "x", "x'", "z", "energy", "log_factor"].iter().map(|text| Column::parse(text, of).unwrap()).collect()
}

/// Rows after rest are the state of rest: `x = 0`, `z = c/g`, and a conformal factor that still decreases.
#[test]
fn rows_after_rest_are_the_state_of_rest() {
    let system = oscillator();
    for way in ways() {
        for sign in [1.0, -1.0] {
            // Backward in time the drag of the reversed system is dissipative.
            let system =
                if sign > 0.0 { oscillator() } else { system.with_parameters(&[("g", -2.0), ("c", -0.5)]).unwrap() };
            for times in [vec![0.0, sign * 1e5], vec![sign * 3000.0, sign * 7e4, sign * 1e5], vec![sign * 1e5]] {
                let motion = Motion {
                    rows: Some(OutputTimes::At(times.clone())),
                    columns: columns(system.formula()),
                    conformal_factor: true,
                    ..motion(sign * 1e5, way)
                };
                let (outcome, rows) = system.record(&motion).unwrap();
                assert_eq!((outcome.status, outcome.t), (Status::Completed, sign * 1e5), "{way:?}");
                let rested = outcome.rests_from.unwrap();
                assert!(rested * sign > 500.0 && rested * sign < 3000.0, "{way:?}: {rested}");
                assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), times, "{way:?}");
                for row in rows.iter().filter(|row| row[0] != 0.0) {
                    let [t, x, v, z, energy, log_factor] = row[..] else { panic!("{row:?}") };
                    assert!(x.abs() < 1e-270 && v.abs() < 1e-270, "{way:?}: {row:?}");
                    // L has terms of the size 1/2, and its drag divides their round-off by 2.
                    assert!(
                        (z - 0.25).abs() < 64.0 * f64::EPSILON && energy.abs() < 256.0 * f64::EPSILON,
                        "{way:?}: {row:?}"
                    );
                    // The steps before the rest, a hundredth of the time or less, have the rate to their order.
                    assert!((log_factor + 2.0 * sign * t).abs() <= 1e-7 * t.abs(), "{way:?}: {row:?}");
                }
                let (q, z) = (outcome.q[0], outcome.z.unwrap());
                let end = rows.last().unwrap();
                assert_eq!((q, z), (end[1], end[3]), "{way:?}");
                assert!((outcome.log_factor.unwrap() - end[5]).abs() <= 1e-12 * end[5].abs(), "{way:?}");
            }
        }
    }
}

/// Rows at steps have one more row: no step is taken at rest.
#[test]
fn rows_at_steps_end_with_the_state_of_rest() {
    for (way, end) in ways().into_iter().zip([1e9, 1e5, 1e5]) {
        let system = oscillator();
        let motion =
            Motion { rows: Some(OutputTimes::Every(8)), columns: columns(system.formula()), ..motion(end, way) };
        let (outcome, rows) = system.record(&motion).unwrap();
        assert_eq!((outcome.status, outcome.t), (Status::Completed, end));
        assert_eq!(rows.last().unwrap()[0], end);
        assert!(rows.len() <= outcome.steps / 8 + 2 && rows[rows.len() - 2][0] <= outcome.rests_from.unwrap());
    }
}

/// An event that depends on time is found after rest, one of the state is not.
#[test]
fn events_after_rest_are_those_that_depend_on_time() {
    let (system, end) = (oscillator(), 6000.0);
    let event = |text: &str| Event::new(system.formula().expression(text).unwrap());
    for way in ways() {
        let events: Vec<Event> = ["x", "t - 4000", "sin(t)", "z - 0.2", "x' + 1 - t/5000"].map(event).into();
        let mut seen = Seen::default();
        let outcome = system.run(&Motion { events: events.clone(), ..motion(end, way) }, &mut seen).unwrap();
        assert_eq!((outcome.status, outcome.t), (Status::Completed, end), "{way:?}");
        let rested = outcome.rests_from.unwrap();
        let after = |k: usize| {
            let found = seen.crossings.iter().filter(|c| c.event == k && c.t > rested);
            found.map(|c| c.t).collect::<Vec<_>>()
        };
        assert_eq!((after(0), after(3)), (vec![], vec![]), "{way:?}");
        for (k, t) in [(1, 4000.0), (4, 5000.0)] {
            assert!(matches!(after(k)[..], [found] if (found - t).abs() <= 1e-9), "{way:?}: {:?}", after(k));
        }
        let pi = std::f64::consts::PI;
        let waves: Vec<f64> = ((rested / pi) as usize + 1..).map(|k| k as f64 * pi).take_while(|t| *t < end).collect();
        assert_eq!(after(2).len(), waves.len(), "{way:?}");
        assert!(after(2).iter().zip(&waves).all(|(a, b)| (a - b).abs() <= 1e-9), "{way:?}");
        // A terminal event ends the motion there, and rows before it are kept.
        let terminal = Event { terminal: true, ..event("t - 4000") };
        let motion = Motion {
            rows: Some(OutputTimes::At(vec![3500.0, 3999.0, 4001.0, end])),
            columns: columns(system.formula()),
            events: vec![terminal],
            ..motion(end, way)
        };
        let (outcome, rows) = system.record(&motion).unwrap();
        assert!(matches!(outcome.status, Status::Stopped { by: "an event", .. }), "{way:?}: {}", outcome.status);
        assert!((outcome.t - 4000.0).abs() <= 1e-9 && rows.len() == 2, "{way:?}: {outcome:?}, {rows:?}");
        assert!((outcome.z.unwrap() - 0.25).abs() < 64.0 * f64::EPSILON);
    }
}

/// A reset that depends on time moves what was at rest: such a motion is followed.
#[test]
fn a_reset_moves_what_was_at_rest() {
    let kicked =
        Reset { when: "t - 3000", direction: formula_lagrangian::Direction::Rising, then: &[("x'", "1")], rest: None };
    let system = System::new(&formula().with_reset(kicked).unwrap()).unwrap();
    let way = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 8 }, steps: Steps::Size(0.5) };
    let outcome = system.run(&motion(3001.0, way), &mut ()).unwrap();
    // The critical oscillator from 0 with speed 1: t e^-t.
    assert!((outcome.q[0] - (-1.0_f64).exp()).abs() < 1e-9, "{outcome:?}");
}

/// The derivatives of the state of rest: those of `x = a`, `z = c/g`.
#[test]
fn the_state_of_rest_has_derivatives() {
    let system = oscillator();
    let names = ["x", "x'", "a", "c", "g", "t_end"];
    let expected = [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 0.5], [0.0, -0.125], [0.0, 0.0]];
    let times = [2500.0, 1e5, 2e5];
    for way in ways() {
        let motion = motion(2e5, way);
        let found = system.sensitivity(&motion, &names, &times, &mut ()).unwrap();
        assert_eq!((found.status, found.states.len()), (Status::Completed, 3), "{way:?}");
        for row in &found.rows {
            for (column, [x, z]) in row.iter().zip(expected) {
                // Both tend to these values like the motion itself.
                let close =
                    (column.q[0] - x).abs() < 1e-12 && (column.z - z).abs() < 1e-12 && column.v[0].abs() < 1e-12;
                assert!(close, "{way:?}: {column:?}, not {x}, {z}");
            }
        }
        // The adjoint of the same: of x at two times, and of z at the end.
        let of_x = EndCovector { q: [1.0].into(), ..EndCovector::zero(1) };
        let of_z = EndCovector { z: 1.0, ..EndCovector::zero(1) };
        let mut loss = |states: &[_]| (states.len() as f64, vec![of_x.clone(), of_x.clone(), of_z.clone()]);
        let found = system.gradient(&motion, &times, &mut loss, &mut ()).unwrap();
        let (value, gradient) = found.loss.unwrap();
        let parameters: Vec<f64> = gradient.parameters.to_vec();
        assert_eq!((found.status, value), (Status::Completed, 3.0), "{way:?}");
        let close = parameters.iter().zip([2.0, 0.5, -0.125]).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(close && gradient.q[0].abs() < 1e-12 && gradient.t_end.abs() < 1e-12, "{way:?}: {gradient:?}");
        let loss = system.formula().expression("x + 4*z").unwrap();
        let (value, gradient) = system.end_gradient(&motion, &loss, &mut ()).unwrap().loss.unwrap();
        assert!((value - 1.0).abs() < 1e-13 && (gradient.parameters[1] - 2.0).abs() < 1e-12, "{way:?}");
    }
}

/// What was interrupted at rest goes on with the same rows and crossings, whether the steps or the rest was interrupted.
#[test]
fn a_motion_at_rest_is_resumed() {
    let system = oscillator();
    for way in ways() {
        let event = Event::new(system.formula().expression("sin(t/100)").unwrap());
        let motion = Motion {
            rows: Some(OutputTimes::At((0..=200).map(|k| 300.0 * f64::from(k)).collect())),
            columns: columns(system.formula()),
            conformal_factor: true,
            events: vec![event],
            resumable: true,
            ..motion(6e4, way)
        };
        let mut whole = Seen::default();
        let expected = system.run(&motion, &mut whole).unwrap();
        for polls in [1, 3, 9, 40, 150] {
            let mut first = Seen { polls: Some(polls), ..Seen::default() };
            let ended = system.run(&motion, &mut first).unwrap();
            let Some(at) = first.interrupted else {
                assert_eq!(ended, expected);
                continue;
            };
            let mut then = Seen::default();
            let outcome = system.resume(&motion, at, &mut then).unwrap();
            assert_eq!(outcome, expected, "{way:?}, {polls}");
            let all = |a: &[Crossing], b: &[Crossing]| a.iter().chain(b).map(|c| c.t).collect::<Vec<_>>();
            assert_eq!(all(&first.crossings, &then.crossings), all(&whole.crossings, &[]), "{way:?}, {polls}");
            let rows: Vec<_> = first.rows.into_iter().chain(then.rows).collect();
            assert_eq!(rows, whole.rows, "{way:?}, {polls}");
        }
    }
}

/// Another motion continues from the state of rest.
#[test]
fn the_state_of_rest_is_a_start() {
    let system = oscillator();
    for way in ways() {
        let first = system.run(&motion(1e4, way), &mut ()).unwrap();
        let start = Start::new(1e4, [first.q[0]], [first.v.unwrap()[0]], first.z.unwrap());
        let event = Event::new(system.formula().expression("t - 15000").unwrap());
        let next = Motion { events: vec![event], ..Motion::new(start, 2e4, way) };
        let mut seen = Seen::default();
        let end = system.run(&next, &mut seen).unwrap();
        assert_eq!((end.status, end.t, end.unresolved), (Status::Completed, 2e4, None), "{way:?}");
        assert!(end.q[0].abs() < 1e-270 && (end.z.unwrap() - 0.25).abs() < 64.0 * f64::EPSILON, "{way:?}: {end:?}");
        assert!(
            matches!(&seen.crossings[..], [found] if (found.t - 15000.0).abs() <= 1e-9),
            "{way:?}: {:?}",
            seen.crossings
        );
    }
}

/// A fit to data of which some are of the time after rest.
#[test]
fn data_after_rest_are_fitted() {
    let truth = oscillator();
    let guess = truth.with_parameters(&[("a", 0.0), ("c", 0.3), ("g", 1.8)]).unwrap();
    for way in ways().into_iter().skip(1) {
        let times = vec![0.5, 1.0, 1e4, 2e4];
        let values = |column: &str| {
            let columns = vec![Column::parse(column, truth.formula()).unwrap()];
            let rows = Some(OutputTimes::At(times.clone()));
            let rows = truth.record(&Motion { rows, columns, ..motion(2e4, way) }).unwrap().1;
            rows.into_iter().map(|row| row[0]).collect::<Vec<f64>>()
        };
        let series = ["x", "z"].map(|quantity| Series {
            quantity: quantity.to_owned(),
            times: times.clone(),
            values: values(quantity),
            deviations: None,
            event: None,
        });
        let fit = MotionFit::new(motion(2e4, way), ["c", "g"].map(Unknown::free), series);
        let found = guess.fit(&fit, &mut ()).unwrap();
        assert!(found.fit.status.is_converged(), "{way:?}: {}", found.fit);
        let close = found.fit.parameters.iter().zip([0.5, 2.0]).all(|(a, b)| (a - b).abs() < 1e-10);
        assert!(close, "{way:?}: {}", found.fit);
    }
}

/// The steps of a plan can be taken again by their number, as the program and dense output do.
#[test]
fn the_steps_of_a_plan_can_be_taken_again() {
    let system = oscillator();
    let motion = motion(1e5, ways()[0]);
    let plan = system.plan(&motion).unwrap();
    let again = StepControl::Steps { by: plan.by().unwrap(), steps: Steps::Count(plan.steps) };
    let mut seen = Seen::default();
    let again = system.run(&Motion { nodes: true, step_control: again, ..motion.clone() }, &mut seen).unwrap();
    let outcome = system.run(&motion, &mut ()).unwrap();
    let rested = outcome.rests_from.unwrap();
    // They are the same steps. Where each is observed, the rest is found earlier than by the trial runs.
    assert!(rested < 1500.0 && again.rests_from.unwrap() <= rested, "{outcome:?}, {again:?}");
    assert_eq!((seen.nodes.len(), seen.nodes.last()), (again.steps + 2, Some(&1e5)));
    assert!((rested / outcome.steps as f64 - seen.nodes[1]).abs() <= 1e-9);
    let check = system.check(&motion, 4).unwrap();
    assert!(check.samples.iter().all(|sample| sample.contact_defect < 1e-9), "{:?}", check.samples);
}

/// Members of an ensemble that come to rest are completed, in lanes, with runs of their own, and with rows.
#[test]
fn members_at_rest_are_completed() {
    let system = oscillator();
    let own = columns(system.formula())[..4].to_vec();
    for way in ways() {
        for rows in [None, Some(OutputTimes::At(vec![0.0, 4e3, 8e3]))] {
            let start = |i: usize| Start::new(0.0, [1.0 + i as f64], [0.0], 0.0);
            let ensemble = Ensemble {
                count: 3,
                start: &start,
                t0: 0.0,
                varied: None,
                end: 8e3,
                step_control: way,
                rows: rows.clone(),
                columns: &own,
                events: &[],
                threads: Some(1),
            };
            let mut members: Vec<MemberEnd> = Vec::new();
            let tally = system.ensemble(&ensemble, &mut |member| {
                members.push(member);
                std::ops::ControlFlow::Continue(())
            });
            assert_eq!(tally.unwrap().completed, 3, "{way:?}");
            for member in members {
                let end = member.ending.unwrap();
                assert!(
                    end.t == 8e3 && end.q[0].abs() < 1e-270 && (end.z - 0.25).abs() < 64.0 * f64::EPSILON,
                    "{way:?}: {end:?}"
                );
                assert_eq!(member.rows.len(), if rows.is_some() { 3 } else { 0 }, "{way:?}");
                assert!(member.rows.iter().skip(1).all(|row| row[1].abs() < 1e-270), "{way:?}: {:?}", member.rows);
            }
        }
    }
}
