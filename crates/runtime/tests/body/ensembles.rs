//! Many motions of rigid bodies on several threads.

use super::{free, motion};
use herglotz_runtime::{
    Body, BodyEnsemble, BodyEvent, BodyMember, BodyMotion, GroupStatus, Interrupt, OutputTimes, RuntimeError,
    StepControl, Tally,
};
use std::ops::ControlFlow;

/// More than one block of members on one thread.
const COUNT: usize = 70;

/// Members of different drag and spin; one with an invalid body, and one that an event ends.
fn member(i: usize) -> (Body, BodyMotion) {
    let gamma = if i == 3 { f64::NAN } else { -0.01 * i as f64 };
    let mut event = BodyEvent::parse(if i == 5 { "t - 1.5" } else { "omega1" }).unwrap();
    event.terminal = i == 5;
    let request = BodyMotion {
        omega: [1.0, 0.5, 0.3 + 0.01 * i as f64],
        rows: Some(OutputTimes::Every(10)),
        events: vec![event],
        ..motion("strang", 100)
    };
    (Body { gamma, ..free() }, request)
}

fn run(threads: usize) -> (Tally, Vec<BodyMember>) {
    let mut members = Vec::new();
    let ensemble = BodyEnsemble { count: COUNT, member: &member, threads: Some(threads), interrupt: None };
    let tally = ensemble.run(&mut |member| {
        members.push(member);
        ControlFlow::Continue(())
    });
    (tally.unwrap(), members)
}

/// The members are those of single runs, in their order, whatever the number of threads.
#[test]
fn members_do_not_depend_on_threads() {
    let (tally, one) = run(1);
    assert_eq!((tally.members, tally.completed, tally.stopped, tally.failed), (COUNT, COUNT - 2, 1, 1));
    assert_eq!((tally.first_failed, tally.own_plans, one.len()), (Some(3), 0, COUNT));
    for (i, member_of) in one.iter().enumerate() {
        let (body, request) = member(i);
        assert_eq!(member_of.index, i);
        match body.record(&request) {
            Ok((outcome, rows)) => {
                assert_eq!((member_of.outcome.as_ref().unwrap(), &member_of.rows), (&outcome, &rows), "{i}");
            }
            Err(error) => {
                assert_eq!(i, 3);
                assert_eq!(member_of.outcome.as_ref().unwrap_err().to_string(), error.to_string());
            }
        }
    }
    assert!(matches!(one[5].outcome, Ok(ref outcome) if matches!(outcome.status, GroupStatus::Event { .. })));
    for threads in [2, 5] {
        let (of_several, several) = run(threads);
        assert_eq!((of_several, several.len()), (tally, COUNT));
        for (a, b) in several.iter().zip(&one) {
            assert_eq!((a.index, &a.rows, &a.crossings), (b.index, &b.rows, &b.crossings), "{threads} threads");
            assert_eq!(a.outcome.as_ref().ok(), b.outcome.as_ref().ok(), "{threads} threads");
        }
    }
}

/// An ensemble ends where its caller or its condition requests it; invalid requests are refused.
#[test]
fn ensembles_end_and_are_refused() {
    let good = || BodyEnsemble { count: COUNT, member: &member, threads: Some(2), interrupt: None };
    let mut seen = 0;
    let tally = good().run(&mut |member| {
        seen += 1;
        if member.index == 9 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!((tally.unwrap().members, seen), (10, 10));
    let accurate = |i: usize| {
        let (body, motion) = member(i);
        (body, BodyMotion { step_control: StepControl::Accuracy { error: 1e-6, by: None }, ..motion })
    };
    let accurate = BodyEnsemble { count: 2, member: &accurate, ..good() };
    assert_eq!(accurate.run(&mut |_| ControlFlow::Continue(())).unwrap().own_plans, 2);
    let interrupt = Some(Interrupt::when(|| true));
    let interrupted = BodyEnsemble { interrupt, ..good() };
    assert_eq!(interrupted.run(&mut |_| ControlFlow::Continue(())).unwrap().members, 0);
    let wrong = |i: usize| (member(i).0, motion("midpoint", 10));
    let refused = |ensemble: BodyEnsemble<'_>| ensemble.run(&mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(refused(BodyEnsemble { count: 0, ..good() }), RuntimeError::Ensemble(_)));
    assert!(matches!(refused(BodyEnsemble { threads: Some(0), ..good() }), RuntimeError::Ensemble(_)));
    let error = refused(BodyEnsemble { member: &wrong, ..good() });
    assert!(error.to_string().starts_with("`integrator` is \"midpoint\""), "{error}");
}
