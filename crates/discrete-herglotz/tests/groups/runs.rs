//! Runs on Lie groups: rows at times, events, resuming to the last bit, steps for an accuracy, and failures.

use super::{Top, distance, end_of, heavy_top, heavy_top_start, start, tilted};
use contact_geom::Scalar;
use contact_geom::groups::{GroupError, GroupLagrangian, LieGroup, Rotation, Rotations};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::MaxAbsOrNan;
use discrete_herglotz::SplittingScheme;
use discrete_herglotz::groups::{
    GroupEvent, GroupGauss, GroupMotion, GroupObserver, GroupRows, GroupRun, GroupState, GroupStatus,
    RigidBodySplitting, group_steps,
};
use std::ops::ControlFlow;

/// Keeps the rows and the sign changes of a run.
#[derive(Default)]
struct Kept {
    rows: Vec<(f64, GroupState<Rotations, 3>)>,
    crossings: Vec<(usize, f64, GroupState<Rotations, 3>)>,
}

impl GroupObserver<Rotations, 3> for Kept {
    fn row(&mut self, t: f64, state: &GroupState<Rotations, 3>) -> ControlFlow<()> {
        self.rows.push((t, *state));
        ControlFlow::Continue(())
    }

    fn crossing(&mut self, event: usize, t: f64, state: &GroupState<Rotations, 3>) -> ControlFlow<()> {
        self.crossings.push((event, t, *state));
        ControlFlow::Continue(())
    }
}

/// The height of the centre of mass of the heavy top, which is 0 at the start.
fn height(state: &GroupState<Rotations, 3>) -> f64 {
    state.g.apply(&SVector::from([0.0, 1.0, 0.0]))[2]
}

/// Rows at times within steps are the ends of runs to these times: a splitting of order 10 has an error of 1e-12 there.
#[test]
fn rows_at_times_are_ends_of_runs() {
    let top = heavy_top(-0.1);
    let method = |h: f64| RigidBodySplitting::new(top, SplittingScheme::SOFRONIOU_SPALETTA_10, h).unwrap();
    let times = [0.0, 0.0137, 0.4, 0.61, 1.0];
    let run = GroupRun { rows: GroupRows::At(times.to_vec()), ..GroupRun::new(40) };
    let (mut kept, mut motion) = (Kept::default(), GroupMotion::new(0.0, heavy_top_start(&top)).unwrap());
    assert_eq!(run.run(&mut motion, &method(1.0 / 40.0), &mut kept), Ok(GroupStatus::Completed));
    assert!(kept.rows.iter().map(|(t, _)| *t).eq(times));
    assert_eq!(kept.rows[4].1, motion.state());
    for (t, state) in &kept.rows[1..] {
        let mut alone = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
        alone.advance(&method(t / 64.0), 64).unwrap();
        // The momenta are of the size 70, and the action of 8000.
        let turn = Rotations::log(&Rotations::compose(&Rotations::inverse(&alone.state().g), &state.g));
        let momentum = (alone.state().momentum - state.momentum).max_abs_or_nan() / 70.0;
        let action = (alone.state().z / state.z - 1.0).abs();
        assert!(turn.max_abs_or_nan() < 1e-11 && momentum < 1e-11 && action < 1e-12, "t = {t}: {turn:?}");
    }
}

/// The centre of mass of the heavy top passes a height: at each sign change the function vanishes to round-off, the
/// times are those of a run with other steps, and signs alternate. A terminal event leaves the motion there.
#[test]
fn the_heavy_top_passes_a_height() {
    let top = heavy_top(0.0);
    let level = |_: f64, state: &GroupState<Rotations, 3>| height(state) + 0.4;
    // An error of 1e-13 with 120 steps; a speed of a few metres per second.
    let method = |h: f64| RigidBodySplitting::new(top, SplittingScheme::SOFRONIOU_SPALETTA_10, h).unwrap();
    let crossings = |steps: usize| {
        let method = method(2.0 / steps as f64);
        let mut motion = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
        let mut kept = Kept::default();
        let events = vec![GroupEvent::new(level), GroupEvent::new(level).falling()];
        let run = GroupRun { events, ..GroupRun::new(steps) };
        assert_eq!(run.run(&mut motion, &method, &mut kept), Ok(GroupStatus::Completed));
        kept.crossings
    };
    let (found, again) = (crossings(120), crossings(160));
    let all: Vec<_> = found.iter().filter(|(event, ..)| *event == 0).collect();
    assert!(all.len() >= 2 && found.len() == again.len(), "{} {}", found.len(), again.len());
    // The first sign change is downward, since the centre starts at the height 0, and they alternate.
    assert_eq!(found.len() - all.len(), all.len().div_ceil(2));
    for ((event, t, state), (_, other, _)) in found.iter().zip(&again) {
        assert!(level(*t, state).abs() < 1e-13, "{event} {t}: {:e}", level(*t, state));
        assert!((t - other).abs() < 1e-12, "{event} {t} {other}");
    }
    let method = method(2.0 / 120.0);
    let mut motion = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
    let run = GroupRun { events: vec![GroupEvent::new(level).rising().terminal()], ..GroupRun::new(120) };
    let status = run.run(&mut motion, &method, &mut ()).unwrap();
    let GroupStatus::Event { event: 0, t } = status else { panic!("{status}") };
    assert!((t - all[1].1).abs() < 1e-12 && (motion.t() - t).abs() < 1e-15 * 4.0, "{t}");
    assert!(level(t, &motion.state()).abs() < 1e-13);
    // The run goes on from there, and does not count the same sign change again.
    let run = GroupRun { events: vec![GroupEvent::new(level).rising().terminal()], ..GroupRun::new(6) };
    assert_eq!(run.run(&mut motion, &method, &mut ()), Ok(GroupStatus::Completed));
}

/// Two runs of a motion are one, to the last bit, with a row within a step between them.
#[test]
fn a_resumed_run_is_the_same_to_the_last_bit() {
    let top = heavy_top(-0.1);
    let method = GroupGauss::new(top, 3, 0.01).unwrap();
    let mut whole = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
    GroupRun::new(60).run(&mut whole, &method, &mut ()).unwrap();
    let mut parts = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
    let rows = GroupRun { rows: GroupRows::At(vec![0.111]), ..GroupRun::new(25) };
    assert_eq!(rows.run(&mut parts, &method, &mut Kept::default()), Ok(GroupStatus::Completed));
    let mut parts = GroupMotion::<Rotations, 3>::restore(&parts.save()).unwrap();
    GroupRun::new(35).run(&mut parts, &method, &mut ()).unwrap();
    assert_eq!((whole.state(), whole.t()), (parts.state(), parts.t()));
    assert_eq!(whole.spatial_momentum(), parts.spatial_momentum());
}

/// An accuracy is reached, with an estimate that bounds the error; one below round-off is refused.
#[test]
fn steps_for_an_accuracy() {
    let body = tilted(-0.3);
    let motion = GroupMotion::new(0.2, start()).unwrap();
    let method = |h: f64| GroupGauss::new(body, 2, h);
    let found = group_steps(&motion, 1.5, 1e-7, 2, method).unwrap();
    let mut end = motion.clone();
    end.advance(&method(found.h).unwrap(), found.steps).unwrap();
    let error = distance(&end.state(), &end_of(Top::Body(body), 8, 12));
    assert!(error < found.error && found.error <= 1e-7 && found.error > 1e-9, "{found:?} {error:e}");
    let refused = group_steps(&motion, 1.5, 1e-19, 2, method);
    assert!(matches!(refused, Err(GroupError::Accuracy { reached, .. }) if reached < 1e-14), "{refused:?}");
}

/// An accuracy near the round-off of the runs is either reached or refused with a larger difference.
#[test]
fn an_accuracy_that_is_reached_is_not_refused() {
    let body = tilted(0.0);
    let mut refusals = 0;
    for span in [1.5, 3.0] {
        let motion = GroupMotion::new(0.0, start()).unwrap();
        let method = |h: f64| GroupGauss::new(body, 4, h);
        for k in 0..20 {
            let accuracy = 10.0_f64.powf(-14.0 - 0.1 * f64::from(k));
            match group_steps(&motion, span, accuracy, 8, method) {
                Ok(found) => assert!(found.error <= accuracy, "{accuracy:e}: {found:?}"),
                Err(GroupError::Accuracy { reached, .. }) => {
                    refusals += 1;
                    assert!(reached > accuracy, "{accuracy:e} is not reached: {reached:e}");
                }
                Err(error) => panic!("{accuracy:e}: {error}"),
            }
        }
    }
    assert!(refusals > 0);
}

/// Runs that cannot be taken are refused by name; a failing step keeps what was computed.
#[test]
fn runs_that_fail() {
    let top = heavy_top(0.0);
    let method = GroupGauss::new(top, 2, 0.01).unwrap();
    let mut motion = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
    for times in [vec![0.2], vec![0.05, 0.04], vec![f64::NAN], vec![-0.1]] {
        let run = GroupRun { rows: GroupRows::At(times), ..GroupRun::new(10) };
        assert!(matches!(run.run(&mut motion, &method, &mut ()), Err(GroupError::Times { .. })));
    }
    // A drive that spins up the body until the step leaves the chart.
    struct Spun;
    impl GroupLagrangian<Rotations, 3> for Spun {
        fn value<T: Scalar>(&self, _t: T, _g: &Rotation<T>, xi: &SVector<T, 3>, z: T) -> T {
            xi.dot(xi) * 0.5 + z
        }
    }
    let start = GroupState { g: Rotations::identity(), momentum: SVector::from([1.0, 0.0, 0.0]), z: 0.0 };
    let mut motion = GroupMotion::new(0.0, start).unwrap();
    let run = GroupRun { rows: GroupRows::Every(1), ..GroupRun::new(100) };
    let mut kept = Kept::default();
    let status = run.run(&mut motion, &GroupGauss::new(&Spun, 2, 0.2).unwrap(), &mut kept).unwrap();
    let GroupStatus::Failed { step, t, cause: GroupError::BeyondChart { largest, .. } } = status else {
        panic!("{status}")
    };
    assert!(step > 5 && largest < 0.2 && kept.rows.len() == step + 1, "{status}");
    assert_eq!(kept.rows[step], (t, motion.state()));
    // The function of an event that is not defined is no sign change.
    let lost = GroupEvent::new(|t: f64, _: &GroupState<Rotations, 3>| (0.1 - t).sqrt());
    let run = GroupRun { events: vec![lost], ..GroupRun::new(100) };
    let mut motion = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
    let status = run.run(&mut motion, &method, &mut ()).unwrap();
    assert!(matches!(status, GroupStatus::Failed { cause: GroupError::NonFinite { .. }, .. }), "{status}");
    assert!(motion.t() <= 0.1 && motion.t() > 0.05, "{}", motion.t());
}
