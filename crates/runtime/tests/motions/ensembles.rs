//! Ensembles, compared with single runs.

use super::{Seen, accurate, by_steps, members, pendulum};
use herglotz_runtime::{Column, Direction, Ensemble, Event, Motion, OutputTimes, Start, Varied};

#[test]
fn members_are_single_runs_whatever_the_threads() {
    let system = pendulum();
    let start = |i: usize| Start::new(0.0, [0.1 + 0.01 * i as f64], [0.0], 0.0);
    // One member has an invalid parameter.
    let values = |i: usize| vec![if i == 7 { f64::NAN } else { -0.05 - 0.001 * i as f64 }];
    let columns = [Column::Position(0), Column::Energy];
    let of = |threads| Ensemble {
        count: 20,
        start: &start,
        t0: 0.0,
        varied: Some(Varied { names: &["gamma"], values: &values }),
        end: 10.0,
        step_control: by_steps(40),
        rows: None,
        columns: &columns,
        events: &[],
        threads: Some(threads),
    };
    let (one, three) = (members(&system, &of(1)), members(&system, &of(3)));
    for (i, (a, b)) in one.iter().zip(&three).enumerate() {
        // Compared as text, since NaN is not equal to itself.
        assert_eq!((a.index, format!("{:?}", a.ending)), (i, format!("{:?}", b.ending)));
        let Ok(ending) = &a.ending else {
            assert_eq!(i, 7);
            continue;
        };
        let own = system.with_parameters(&[("gamma", values(i)[0])]).unwrap();
        let outcome = own.run(&Motion::new(start(i), 10.0, by_steps(40)), &mut ()).unwrap();
        // The sine of the SIMD lanes differs by some units in the last place, and the motion does not amplify the
        // difference.
        let near = |x: f64, y: f64| (x - y).abs() < 1e-14;
        assert!(near(ending.q[0], outcome.q[0]) && near(ending.p[0], outcome.p[0]), "{i}: {ending:?} {outcome:?}");
        assert_eq!(ending.columns[0], ending.q[0]);
    }
    assert!(one[7].ending.is_err());

    // Rows are those of a single run.
    let recorded = Ensemble { rows: Some(OutputTimes::At(vec![0.0, 5.0, 10.0])), varied: None, ..of(2) };
    let all = members(&system, &recorded);
    let motion =
        Motion { rows: recorded.rows.clone(), columns: columns.to_vec(), ..Motion::new(start(4), 10.0, by_steps(40)) };
    assert_eq!(all[4].rows, system.record(&motion).unwrap().1);
    // The final state does not depend on the rows, also where the last row is before the end.
    let early = Ensemble { rows: Some(OutputTimes::At(vec![0.0, 5.0])), varied: None, ..of(2) };
    let ending = members(&system, &early).swap_remove(4).ending.unwrap();
    let end_of_all = all[4].ending.clone().unwrap();
    assert_eq!((ending.v, ending.columns), (end_of_all.v, end_of_all.columns));
    // With a requested accuracy.
    let accurate = Ensemble { step_control: accurate(1e-8), ..of(2) };
    for (a, b) in members(&system, &accurate).iter().zip(&one) {
        if let (Ok(a), Ok(b)) = (&a.ending, &b.ending) {
            assert!((a.q[0] - b.q[0]).abs() < 1e-8, "{a:?} {b:?}");
        }
    }
}

/// The events of each member are those of a single run with its parameters. A terminal event ends its member only, and
/// nothing beyond it is reported.
#[test]
fn events_of_members_are_those_of_single_runs() {
    let system = pendulum();
    // All start below the upper equilibrium with weak damping, so that all pass the lower equilibrium.
    let start = |i: usize| Start::new(0.0, [0.3 + 0.05 * i as f64], [0.0], 0.0);
    let values = |i: usize| vec![-0.01 * i as f64];
    let columns = [Column::Time, Column::Velocity(0)];
    let of = |text: &str| system.formula().expression(text).unwrap();
    for terminal in [false, true] {
        // One event contains a parameter of the member.
        let slow = Event::new(of("theta' - gamma*theta"));
        let down = Event { direction: Direction::Falling, terminal, ..Event::new(of("theta")) };
        let events = [slow, down];
        let rows = Some(OutputTimes::At((0..=8).map(f64::from).collect()));
        let many = Ensemble {
            count: 40,
            start: &start,
            t0: 0.0,
            varied: Some(Varied { names: &["gamma"], values: &values }),
            end: 8.0,
            step_control: by_steps(32),
            rows: rows.clone(),
            columns: &columns,
            events: &events,
            threads: Some(2),
        };
        for member in members(&system, &many) {
            let i = member.index;
            let own = system.with_parameters(&[("gamma", values(i)[0])]).unwrap();
            // Events that are parsed again have the parameter values of the member.
            let of = |text: &str| own.formula().expression(text).unwrap();
            let slow = Event { function: of("theta' - gamma*theta"), ..events[0].clone() };
            let motion = Motion {
                rows: rows.clone(),
                columns: columns.to_vec(),
                events: vec![slow, events[1].clone()],
                ..Motion::new(start(i), 8.0, by_steps(32))
            };
            let mut alone = Seen::default();
            let outcome = own.run(&motion, &mut alone).unwrap();
            let ending = member.ending.unwrap();
            assert_eq!((ending.t, &ending.q, &ending.p), (outcome.t, &outcome.q, &outcome.p), "{i}");
            assert_eq!(ending.t < 8.0, terminal, "{i}");
            assert_eq!((member.rows, member.crossings), (alone.rows, alone.crossings), "{i}");
        }
    }
}
