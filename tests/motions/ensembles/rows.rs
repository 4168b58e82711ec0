//! Rows of members, and observers of members.

use super::systems::{Bowl, pendulum};
use super::{By, integrators, members, pendulum_start};
use crate::lagrangians::{One, one};
use contact_examples::systems::HarmonicOscillator;
use contact_geom::VelocityPoint;
use discrete_herglotz::ensemble::{EnsembleError, Member};
use discrete_herglotz::{
    Ensemble, Event, Events, InputError, Problem, Row, Rows, SplittingScheme, Status, Steps, Until,
};

#[test]
fn rows_are_those_of_single_runs() {
    for by in integrators() {
        for (steps, stride) in [(10, 3), (12, 4), (5, 9), (3, 1)] {
            // To the last bit where no sine is evaluated; up to rounding by collocation, and on the pendulum.
            let exact = matches!(by, By::Splitting(_) | By::Rule(_));
            let oscillator = one(HarmonicOscillator { gamma: -0.1 });
            for without in [false, true] {
                let problem = Problem::new(&oscillator, 0.5, pendulum_start(0)).unwrap();
                let ensemble = problem.ensemble(60, pendulum_start).by(by).steps(Steps::Count(steps));
                let ensemble = ensemble.rows_every(stride).threads(1);
                let ensemble = if without { ensemble.without_action() } else { ensemble };
                for member in members(&ensemble, Until::Time(2.0)).iter().step_by(13) {
                    let own = Problem::new(&oscillator, 0.5, pendulum_start(member.index)).unwrap();
                    let run = own.by(by).steps(Steps::Count(steps));
                    let rows = Rows::every(stride).unwrap();
                    let (run, mut rows) =
                        if without { (run.without_action(), rows.without_action()) } else { (run, rows) };
                    run.observe(&mut rows).run(Until::Time(2.0)).unwrap();
                    assert_eq!(member.rows.len(), rows.rows.len(), "{by:?}, {steps} by {stride}");
                    for (a, b) in member.rows.iter().zip(&rows.rows) {
                        if exact {
                            assert_eq!(a, b, "{by:?}, {steps} by {stride}");
                        }
                        assert_eq!((a.t, a.z.is_some()), (b.t, b.z.is_some()), "{by:?}, {steps} by {stride}");
                        for (x, y) in a.numbers().zip(b.numbers()) {
                            // Both solve the stages to round-off, in at most twelve steps, for numbers of size 2.
                            assert!((x - y).abs() <= 16.0 * f64::EPSILON, "{by:?}: {a:?}, {b:?}");
                        }
                    }
                    let last = member.ending.as_ref().unwrap();
                    let row = member.rows.last().unwrap();
                    assert_eq!((row.t, &row.q, &row.p), (last.t, &last.state.q, &last.state.p), "{by:?}");
                }
            }
        }
    }
}

#[test]
fn rows_change_no_bit_and_none_depends_on_the_neighbours() {
    let pendulum = pendulum(-0.1);
    for by in integrators() {
        let of = |count: usize, shift: usize| {
            let start = move |i: usize| pendulum_start(i + shift);
            Ensemble::new(&pendulum, 0.0, count, start).by(by).steps(Steps::Count(9))
        };
        let until = Until::Time(2.0);
        let with = members(&of(50, 0).rows_every(2).threads(2), until);
        let shifted = members(&of(37, 9).rows_every(2).threads(1), until);
        for (a, b) in with.iter().zip(members(&of(50, 0), until)) {
            assert_eq!(a.ending, b.ending, "{by:?}");
            assert!(b.rows.is_empty(), "{by:?}");
        }
        for (a, b) in with[9..].iter().zip(&shifted) {
            assert_eq!((&a.ending, &a.rows), (&b.ending, &b.rows), "{by:?}");
        }
    }
}

#[test]
fn rows_of_a_member_that_fails_end_before_it_does() {
    // One member crosses the edge at about t = 0.1; the others continue.
    let start = |i: usize| VelocityPoint::new([if i == 5 { 0.5 } else { 0.01 }], [if i == 5 { 5.0 } else { 0.1 }], 0.0);
    let bowl = One::from(Bowl);
    let ensemble = Ensemble::new(&bowl, 0.0, 20, start).by(SplittingScheme::STRANG).steps(Steps::Count(80));
    let all = members(&ensemble.rows_every(1), Until::Time(2.0));
    let failed = all[5].ending.as_ref().unwrap();
    assert!(matches!(failed.status, Status::Failed { .. }), "{failed:?}");
    assert!((1..80).contains(&failed.steps) && all[5].rows.len() == failed.steps + 1, "{failed:?}");
    assert_eq!(all[5].rows.last().map(|row| row.t), Some(failed.t));
    assert!(all.iter().filter(|member| member.index != 5).all(|member| member.rows.len() == 81));
}

#[test]
fn rows_are_in_the_checkpoint() {
    let path = std::env::temp_dir().join(format!("rows-of-ensembles-{}", std::process::id()));
    let pendulum = pendulum(-0.1);
    let start = |i: usize| if i == 3 { VelocityPoint::new([f64::NAN], [0.0], 0.0) } else { pendulum_start(i) };
    let run = |stride: usize, path: Option<&std::path::Path>| {
        let ensemble = Ensemble::new(&pendulum, 0.0, 900, start).by(SplittingScheme::STRANG).steps(Steps::Count(6));
        let ensemble = ensemble.rows_every(stride).threads(2);
        let ensemble = if let Some(path) = path { ensemble.checkpoint(path) } else { ensemble };
        // As text, since a NaN does not equal itself.
        let mut all = Vec::new();
        ensemble.run(Until::Time(1.0), |member| all.push(format!("{member:?}"))).map(|_| all)
    };
    let plain = run(2, None).unwrap();
    assert_eq!(run(2, Some(&path)).unwrap(), plain);
    // The whole checkpoint is read, and a half of it.
    assert_eq!(run(2, Some(&path)).unwrap(), plain);
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    assert_eq!(run(2, Some(&path)).unwrap(), plain);
    assert!(std::fs::read(&path).unwrap() == whole);
    // An ensemble with other rows is another ensemble.
    assert!(matches!(run(3, Some(&path)), Err(EnsembleError::AnotherEnsemble { .. })));
    std::fs::remove_file(path).unwrap();
}

#[test]
fn rows_that_cannot_be_are_refused() {
    let pendulum = pendulum(-0.1);
    let refused = |stride: usize, steps: usize| {
        let ensemble = Ensemble::new(&pendulum, 0.0, 1000, pendulum_start).by(SplittingScheme::STRANG);
        let ensemble = ensemble.steps(Steps::Count(steps)).rows_every(stride);
        match ensemble.run(Until::Time(1.0), |_| unreachable!("nothing is computed")) {
            Err(EnsembleError::Member { cause, .. }) => cause,
            other => unreachable!("{other:?}"),
        }
    };
    assert!(matches!(refused(0, 10), InputError::Count { least: 1, found: 0, .. }));
    assert!(matches!(refused(1, 1 << 30), InputError::TooMany { .. }));
}

#[test]
fn observers_of_members_see_what_those_of_single_runs_do() {
    let pendulum = pendulum(-0.1);
    for by in integrators() {
        let observer = |index: usize| {
            if index == 8 {
                return Err(InputError::NoSteps);
            }
            let bottom = Event::new(|_, x| x.q[0]);
            Ok((Rows::every(2)?.with_energy().with_velocity(), Events::new([bottom])))
        };
        let seen = |(rows, events): (Rows<'_>, Events<'_>)| (rows.rows, events.crossings);
        let start = |i: usize| if i == 4 { VelocityPoint::new([0.0], [f64::INFINITY], 0.0) } else { pendulum_start(i) };
        let run = |threads: usize| {
            let ensemble = Ensemble::new(&pendulum, 0.0, 40, start).by(by).steps(Steps::Count(20)).threads(threads);
            let mut all = Vec::new();
            let reported = std::cell::Cell::new(0.0);
            let ensemble = ensemble.progress(|part| reported.set(part)).observe(observer, seen);
            let tally = ensemble.run(Until::Time(6.0), |member, seen| all.push((member.clone(), seen))).unwrap();
            assert_eq!(
                (tally.members, tally.completed, tally.batch_kernel, reported.get()),
                (40, 38, 0, 1.0),
                "{by:?}"
            );
            all
        };
        let all = run(1);
        assert!(all == run(3), "{by:?}");
        let mut crossed = 0;
        for (i, (member, seen)) in all.into_iter().enumerate() {
            assert_eq!(member.index, i);
            if i == 4 || i == 8 {
                assert!(member.ending.is_err() && seen.is_none(), "{by:?}: {member:?}");
                continue;
            }
            let (mut rows, mut events) = observer(i).unwrap();
            let problem = Problem::new(&pendulum, 0.0, start(i)).unwrap();
            let run = problem.by(by).steps(Steps::Count(20)).observe(&mut rows).observe(&mut events);
            let own = run.run(Until::Time(6.0)).unwrap();
            assert_eq!(member.ending.clone().map(|ending| ending.state), Ok(own.state()), "{by:?}");
            crossed += events.crossings.len();
            assert_eq!(seen, Some((rows.rows, events.crossings)), "{by:?}");
        }
        // They pass the lowest point about once in half a period of about six.
        assert!(crossed > 38, "{by:?}: {crossed}");
    }
    let ensemble = Ensemble::new(&pendulum, 0.0, 9, pendulum_start).by(SplittingScheme::STRANG).steps(Steps::Count(4));
    let none = |_: usize| Rows::every(1);
    let observed = ensemble.checkpoint("nowhere").observe(none, |rows: Rows<'_>| rows.rows);
    let fold = |_: &Member, _: Option<Vec<Row>>| unreachable!("nothing is computed");
    assert!(matches!(observed.run(Until::Time(1.0), fold), Err(EnsembleError::Observed)));
}
