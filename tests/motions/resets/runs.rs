//! Runs with resets: rows, events, resumed runs, ensembles.

use crate::common::observers::StopsAt;
use crate::lagrangians::{SwitchingOne, SwitchingTwo};
use crate::resets::Floor;
use contact_examples::systems::UniformField;
use contact_geom::numbers::dot;
use contact_geom::switching::{Control, Impact, Impacts};
use contact_geom::{Hints, Lagrangian, Scalar, VelocityPoint, nalgebra::SVector};
use discrete_herglotz::{
    AnyIntegrator, Checkpoint, Event, Events, Problem, Resets, ResumeState, Rows, Status, StepError, Steps, Until,
};

/// A ball between a floor and a ceiling of a corner, with drag.
fn ball() -> SwitchingTwo {
    Impacts::new(UniformField { field: [0.2, -1.0], gamma: -0.05 }, Floor, Impact::Restitution(0.9)).into()
}

const START: ([f64; 2], [f64; 2]) = ([0.0, 1.0], [0.5, 0.0]);

#[test]
fn rows_between_steps_are_those_of_the_motion_across_impacts() {
    let (ball, times) = (ball(), (1..40).map(|k| 0.25 * f64::from(k)));
    let problem = Problem::new(&ball, 0.0, VelocityPoint::new(START.0, START.1, 0.0)).unwrap();
    let mut rows = Rows::at(times.clone()).unwrap();
    problem
        .by(AnyIntegrator::Gauss { stages: 6 })
        .steps(Steps::Size(2.0))
        .observe(&mut rows)
        .run(Until::Time(10.0))
        .unwrap();
    let mut exact = Rows::at(times).unwrap();
    problem
        .by(AnyIntegrator::Gauss { stages: 6 })
        .steps(Steps::Size(0.25))
        .observe(&mut exact)
        .run(Until::Time(10.0))
        .unwrap();
    assert_eq!(rows.rows.len(), 39);
    for (a, b) in rows.rows.iter().zip(&exact.rows) {
        assert!((&a.q - &b.q).norm() <= 1e-13 && a.q[1] >= -1e-15, "t = {}: {:e}", a.t, (&a.q - &b.q).norm());
    }
}

/// An event on the height 0.3 in steps that contain impacts: each passage is found once.
#[test]
fn events_are_found_in_every_piece_of_a_step() {
    let ball = ball();
    let problem = Problem::new(&ball, 0.0, VelocityPoint::new(START.0, START.1, 0.0)).unwrap();
    let crossings = |h: f64| {
        let mut events = Events::new([Event::new(|_, x| x.q[1] - 0.3)]);
        problem
            .by(AnyIntegrator::Gauss { stages: 6 })
            .steps(Steps::Size(h))
            .observe(&mut events)
            .run(Until::Time(10.0))
            .unwrap();
        events.crossings.iter().map(|c| c.t).collect::<Vec<_>>()
    };
    let exact = crossings(0.05);
    assert!(exact.len() >= 6);
    for h in [0.5, 2.0, 5.0] {
        let found = crossings(h);
        assert_eq!(found.len(), exact.len(), "h = {h}: {found:?} for {exact:?}");
        assert!(found.iter().zip(&exact).all(|(a, b)| (a - b).abs() <= 1e-12), "h = {h}");
    }
}

#[test]
fn runs_are_resumed_across_impacts_bit_by_bit() {
    let ball = ball();
    let problem = Problem::new(&ball, 0.0, VelocityPoint::new(START.0, START.1, 0.0)).unwrap();
    for name in ["gauss_4", "strang", "midpoint", "blanes_casas_8"] {
        let run = || problem.by(name.parse::<AnyIntegrator>().unwrap()).steps(Steps::Size(0.37));
        let whole = run().run(Until::Time(8.0)).unwrap();
        for every in [1, 4, 7] {
            let path = std::env::temp_dir().join(format!("resets_{name}_{every}_{}", std::process::id()));
            // Half way: 22 steps are taken in all.
            let mut stop = StopsAt(12, "a test");
            let mut checkpoint = Checkpoint::every(every, &path).unwrap();
            run().observe(&mut checkpoint).observe(&mut stop).run(Until::Time(8.0)).unwrap();
            let resumed = run().resume(ResumeState::read(&path).unwrap()).run(Until::Time(8.0)).unwrap();
            let _ = std::fs::remove_file(&path);
            assert_eq!((&resumed.q, &resumed.p, resumed.z), (&whole.q, &whole.p, whole.z), "{name}, every {every}");
        }
    }
}

/// The impacts of an elastic ball conserve the energy up to its drag, and the run checks that: no step is flagged, and
/// the conformal factor is that of the drag.
#[test]
fn elastic_impacts_keep_the_checks_of_the_energy() {
    let ball = SwitchingOne::from(Impacts::new(UniformField { field: [-1.0], gamma: -0.05 }, Floor, Impact::Elastic));
    let problem = Problem::new(&ball, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let outcome =
        problem.by(AnyIntegrator::Gauss { stages: 3 }).steps(Steps::Size(0.1)).run(Until::Time(30.0)).unwrap();
    assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None));
    let v = outcome.v.unwrap()[0];
    let energy = 0.5 * v * v + outcome.q[0] + 0.05 * outcome.z.unwrap();
    assert!((energy - f64::exp(-0.05 * 30.0)).abs() <= 1e-12, "{:e}", energy - f64::exp(-1.5));
}

/// Walls at which the state is replaced: a list of cases of what happens at one instant.
pub struct Walls {
    /// What a reset assigns, by its index.
    reset: fn(usize, &VelocityPoint<2>) -> Option<VelocityPoint<2>>,
}

impl Lagrangian<2> for Walls {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };

    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        dot(v, v) * 0.5
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<2>, values: &mut Vec<f64>) {
        values.extend(x.q.iter());
    }
    fn at_switch(&self, index: usize, _t: f64, x: &VelocityPoint<2>, rising: bool) -> Control<2> {
        let to = if rising { None } else { (self.reset)(index, x) };
        to.map_or(Control::Continue, Control::Replace)
    }
}

fn through(walls: Walls, start: ([f64; 2], [f64; 2]), h: f64, t: f64) -> (Status, [f64; 2], usize) {
    let system = SwitchingTwo::from(walls);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new(start.0, start.1, 0.0)).unwrap();
    let mut resets = Resets::new();
    let run = problem.by(AnyIntegrator::Gauss { stages: 2 }).steps(Steps::Size(h)).observe(&mut resets);
    let outcome = run.run(Until::Time(t)).unwrap();
    (outcome.status, outcome.q.fixed::<2>().into(), resets.resets.len())
}

fn mirrored(index: usize, x: &VelocityPoint<2>) -> Option<VelocityPoint<2>> {
    let mut to = *x;
    to.v[index] = -to.v[index];
    Some(to)
}

/// A corner: both walls are met at the same instant, and both resets occur.
#[test]
fn two_resets_at_one_instant_both_occur() {
    for (start, h) in
        [(([1.0, 1.0], [-1.0, -1.0]), 0.3), (([1.0, 2.0], [-1.0, -2.0]), 0.7), (([1.0, 1.0], [-1.0, -1.0]), 1.0)]
    {
        let (status, q, resets) = through(Walls { reset: mirrored }, start, h, 2.1);
        assert_eq!((status, resets), (Status::Completed, 2), "{start:?}");
        assert!((q[0] + 1.1 * start.1[0]).abs() <= 1e-14 && (q[1] + 1.1 * start.1[1]).abs() <= 1e-14, "{q:?}");
    }
}

/// A wall that is met at the end of a step, and at the start of the run.
#[test]
fn a_reset_at_the_end_of_a_step_occurs_once() {
    for h in [0.25, 0.5, 1.0] {
        let (status, q, resets) = through(Walls { reset: mirrored }, ([1.0, 1.0], [-1.0, 0.0]), h, 3.0);
        assert_eq!((status, resets), (Status::Completed, 1), "h = {h}");
        assert!((q[0] - 2.0).abs() <= 1e-14);
    }
    // The end of the run: the reset is left to its continuation.
    let (status, q, resets) = through(Walls { reset: mirrored }, ([1.0, 1.0], [-1.0, 0.0]), 0.25, 1.0);
    assert!(status == Status::Completed && q[0].abs() <= 1e-15 && resets == 0);
    // A start on the wall that leaves it.
    let (_, q, resets) = through(Walls { reset: mirrored }, ([0.0, 1.0], [1.0, 0.0]), 0.25, 1.0);
    assert!((q[0] - 1.0).abs() <= 1e-15 && resets == 0);
    // A start on the wall that goes into it begins with the reset.
    let (_, q, resets) = through(Walls { reset: mirrored }, ([0.0, 1.0], [-1.0, 0.0]), 0.25, 1.0);
    assert!((q[0] - 1.0).abs() <= 1e-15 && resets == 1);
}

/// The reset of one wall puts the motion on the other wall, whose reset follows.
#[test]
fn a_reset_may_trigger_another_one() {
    let onto_the_other = |index: usize, x: &VelocityPoint<2>| match index {
        0 => Some(VelocityPoint::new([0.5, 0.0], [0.25, -1.0], x.z)),
        _ => mirrored(index, x),
    };
    let (status, q, resets) = through(Walls { reset: onto_the_other }, ([1.0, 1.0], [-1.0, 0.0]), 0.3, 2.0);
    // The state after the first reset is on the second wall, and would go beyond it.
    assert_eq!((status, resets), (Status::Completed, 2));
    assert!((q[0] - 0.75).abs() <= 1e-14 && (q[1] - 1.0).abs() <= 1e-14, "{q:?}");
    // Slightly before the second wall, its reset follows within the same step.
    let before_the_other = |index: usize, x: &VelocityPoint<2>| match index {
        0 => Some(VelocityPoint::new([0.5, 1e-9], [0.25, -1.0], x.z)),
        _ => mirrored(index, x),
    };
    let (status, q, resets) = through(Walls { reset: before_the_other }, ([1.0, 1.0], [-1.0, 0.0]), 0.3, 2.0);
    assert_eq!((status, resets), (Status::Completed, 2));
    assert!((q[1] - (1.0 - 1e-9)).abs() <= 1e-14, "{q:?}");
}

#[test]
fn impossible_resets_end_with_a_status() {
    let cause = |reset: fn(usize, &VelocityPoint<2>) -> Option<VelocityPoint<2>>| match through(
        Walls { reset },
        ([1.0, 1.0], [-1.0, 0.0]),
        0.3,
        2.0,
    )
    .0
    {
        Status::Failed { cause, .. } => cause,
        other => panic!("{other}"),
    };
    let beyond = cause(|_, x| Some(VelocityPoint { q: [-0.5, 1.0].into(), ..*x }));
    assert!(matches!(beyond, StepError::ResetBeyond { t } if (t - 1.0).abs() < 1e-14), "{beyond}");
    let undefined = cause(|_, x| Some(VelocityPoint { v: [f64::NAN, 1.0].into(), ..*x }));
    assert!(matches!(undefined, StepError::ResetUndefined { t } if (t - 1.0).abs() < 1e-14), "{undefined}");
}

/// The motions of an ensemble are those of single runs.
#[test]
fn ensembles_have_impacts() {
    let ball = ball();
    let starts: Vec<_> = (0..5).map(|k| VelocityPoint::new([0.0, 1.0 + 0.2 * f64::from(k)], [0.5, 0.0], 0.0)).collect();
    for name in ["gauss_4", "strang"] {
        let integrator: AnyIntegrator = name.parse().unwrap();
        let ensemble = Problem::new(&ball, 0.0, starts[0]).unwrap().ensemble(starts.len(), |index| starts[index]);
        let mut ends = Vec::new();
        let members = ensemble.by(integrator).steps(Steps::Size(0.2));
        members.run(Until::Time(6.0), |member| ends.push(member.ending.as_ref().unwrap().state.clone())).unwrap();
        for (start, end) in starts.iter().zip(ends) {
            let problem = Problem::new(&ball, 0.0, *start).unwrap();
            let single = problem.by(integrator).steps(Steps::Size(0.2)).run(Until::Time(6.0)).unwrap();
            assert_eq!((end.q, end.p), (single.q, single.p), "{name}");
        }
    }
}
