//! Steps that do not resolve the motion of a member, and steps for an accuracy.

use super::systems::{Spring, pendulum};
use super::{By, gauss, members, pendulum_start, splitting};
use crate::lagrangians::One;
use contact_geom::VelocityPoint;
use discrete_herglotz::UnresolvedStep;
use discrete_herglotz::ensemble::{EnsembleError, Member};
use discrete_herglotz::rules::Rule;
use discrete_herglotz::{Ensemble, InputError, Integrator, Problem, SplittingScheme, Status, Steps, Until};

#[test]
fn members_that_the_steps_do_not_resolve_are_flagged_as_by_a_single_run() {
    // Frequencies from 0.1 to 11, with steps of 1: from a sixtieth of a period to nearly two of them.
    let springs: Vec<_> = (0..120).map(|i| One::from(Spring { k: (0.1 * 1.04f64.powi(i)).powi(2) })).collect();
    let start = |i: usize| VelocityPoint::new([0.5], [0.02 * i as f64], 0.0);
    let until = Until::Time(30.0);
    let mut missed = Vec::new();
    for by in SplittingScheme::ALL.map(splitting).into_iter().chain((1..=8).map(gauss)) {
        let of =
            || Ensemble::of(0.0, springs.len(), |i| (&springs[i], start(i))).by(by).steps(Steps::Count(30)).threads(1);
        let (checked, unchecked) = (members(&of(), until), members(&of().without_resolution_check(), until));
        let (mut flagged, mut unflagged) = (0, 0);
        for (i, member) in checked.iter().enumerate() {
            let problem = Problem::new(&springs[i], 0.0, start(i)).unwrap();
            let own = problem.by(by).steps(Steps::Count(30)).run(until).unwrap();
            let ending = member.ending.as_ref().unwrap();
            let bits = |s: Option<UnresolvedStep>| s.map(|s| (s.step, s.defect.to_bits()));
            if bits(ending.unresolved) != bits(own.unresolved) {
                missed.push((Integrator::<'_, One, 1>::info(&by).name, i, own.unresolved));
            }
            flagged += usize::from(ending.unresolved.is_some());
            unflagged += usize::from(ending.unresolved.is_none());
            // Detecting unresolved steps changes no bit. A single run takes other iterations, and its states may differ
            // where numbers grow without bound.
            let plain = unchecked[i].ending.as_ref().unwrap();
            if own.status == Status::Completed {
                assert_eq!(
                    (&ending.state, ending.steps, ending.status),
                    (&plain.state, plain.steps, plain.status),
                    "{by:?}, {i}"
                );
            }
        }
        assert!(flagged >= 5 && unflagged >= 20, "{by:?}: {flagged} flagged, {unflagged} not");
    }
    assert!(missed.is_empty(), "{} missed: {missed:?}", missed.len());
}

#[test]
fn an_accuracy_holds_for_every_member() {
    // One member is stiffer than all members of the trial runs.
    let (soft, stiff) = (One::from(Spring { k: 1.0 }), One::from(Spring { k: 30.0 }));
    let spring = |i: usize| if i == 50 { &stiff } else { &soft };
    let start = |i: usize| VelocityPoint::new([0.5], [0.02 * i as f64], 0.0);
    let (count, until) = (100, Until::Time(10.0));
    let exact = Ensemble::of(0.0, count, |i| (spring(i), start(i))).by(gauss(16)).steps(Steps::Count(200));
    let exact = members(&exact, until);
    let beyond = |a: &Member, wanted: f64| {
        let (x, y) = (&a.ending.as_ref().unwrap().state, &exact[a.index].ending.as_ref().unwrap().state);
        (&x.q - &y.q).norm().hypot((&x.p - &y.p).norm()) / (y.q.norm().hypot(y.p.norm()) * wanted)
    };
    // The error is the difference of two runs, of which the finer has a quarter of the other's error for order 2, and a
    // 64th or less for the others.
    for (by, wanted, most) in [
        (None, 1e-9, 1.05),
        (None, 1e-12, 1.05),
        (Some(splitting(SplittingScheme::BLANES_MOAN_6)), 1e-8, 1.05),
        (Some(splitting(SplittingScheme::STRANG)), 1e-4, 4.0 / 3.0),
        (Some(gauss(4)), 1e-7, 1.05),
    ] {
        let of = || {
            let ensemble = Ensemble::of(0.0, count, |i| (spring(i), start(i))).threads(1);
            if let Some(by) = by { ensemble.by(by) } else { ensemble }
        };
        let mut all = Vec::new();
        let tally = of().accuracy(wanted).rows_every(1).run(until, |member| all.push(member.clone())).unwrap();
        assert_eq!((tally.completed, tally.batch_kernel, tally.unresolved), (count, count - 1, 0), "{by:?}");
        for member in &all {
            let error = beyond(member, wanted);
            assert!(error <= most, "{by:?}, {}: {error}", member.index);
        }
        let steps = all[0].ending.as_ref().unwrap().steps;
        // The stiff member has steps of its own from its trial runs: with the same integrator at least half as many
        // again, and how many more depends on the order. Without a given integrator it is a single run.
        let own = all[50].ending.as_ref().unwrap();
        if by.is_some() {
            assert!(2 * own.steps > 3 * steps, "{by:?}: {} beside {steps}", own.steps);
        } else {
            let alone = Problem::new(&stiff, 0.0, start(50)).unwrap().accuracy(wanted).run(until).unwrap();
            assert_eq!((own.steps, &own.state), (alone.steps, &alone.state()));
        }
        assert_eq!(tally.own_plans, 1);
        // The other members are those of a run with that number of steps.
        let given = of().by(by.unwrap_or(gauss(if wanted < 1e-10 { 12 } else { 8 })));
        let given = members(&given.steps(Steps::Count(steps)).rows_every(1), until);
        for (a, b) in all.iter().zip(&given).filter(|(a, _)| a.index != 50) {
            assert_eq!((&a.ending, &a.rows), (&b.ending, &b.rows), "{by:?}");
        }
        // Those steps would have been too long for the stiff member.
        let error = beyond(&given[50], wanted);
        assert!(error > 2.0, "{by:?}: {error}");
    }
}

#[test]
fn an_accuracy_without_lanes_is_that_of_each_member() {
    let pendulum = pendulum(-0.1);
    let by = By::Rule(Rule::MIDPOINT);
    let ensemble = Ensemble::new(&pendulum, 0.0, 20, pendulum_start).by(by).accuracy(1e-3);
    for member in members(&ensemble, Until::Time(2.0)).iter().step_by(5) {
        let problem = Problem::new(&pendulum, 0.0, pendulum_start(member.index)).unwrap();
        let own = problem.by(by).accuracy(1e-3).run(Until::Time(2.0)).unwrap();
        let ending = member.ending.as_ref().unwrap();
        assert_eq!((&ending.state, ending.steps), (&own.state(), own.steps));
    }
    let refused = |wanted: f64| {
        let ensemble = Ensemble::new(&pendulum, 0.0, 20, pendulum_start).by(SplittingScheme::STRANG).accuracy(wanted);
        match ensemble.run(Until::Time(2.0), |_| unreachable!("nothing is computed")) {
            Err(EnsembleError::Member { cause, .. }) => cause,
            other => unreachable!("{other:?}"),
        }
    };
    assert_eq!(refused(0.0), InputError::Tolerance { wanted: 0.0 });
    assert!(matches!(refused(1e-30), InputError::Accuracy { .. }));
}
