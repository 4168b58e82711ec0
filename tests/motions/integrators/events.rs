//! Events of consecutive runs: each change of sign is counted once, in exactly one of the runs.

use crate::common::observers::StopsAt;
use crate::lagrangians::{One, one};
use contact_examples::systems::{HarmonicOscillator, Pendulum, UniformField};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, VelocityPoint};
use discrete_herglotz::{
    AnyIntegrator, Checkpoint, Crossing, Event, Events, Problem, ResumeState, Rows, Start, Status, Steps, Until,
    rules::Method,
};
use proptest::prelude::*;
use std::f64::consts::PI;

/// An oscillation of frequency one about a place.
#[derive(Clone, Copy, Debug)]
pub struct About(f64);

impl Lagrangian<1> for About {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let x = q[0] - self.0;
        (v[0] * v[0] - x * x) * 0.5
    }
}

/// A damped oscillation under a force that depends on time.
#[derive(Clone, Copy, Debug)]
pub struct Driven {
    force: f64,
    frequency: f64,
}

impl Driven {
    /// The time derivative of the function of a crossing: of the momentum for event 1, of the position for others.
    fn rate(&self, c: &Crossing) -> f64 {
        match c.event {
            1 => self.force * (self.frequency * c.t).cos() - c.state.q[0] - 0.02 * c.state.p[0],
            _ => c.state.p[0],
        }
    }
}

impl Lagrangian<1> for Driven {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        (v[0] * v[0] - q[0] * q[0]) * 0.5 + (t * self.frequency).cos() * q[0] * self.force - z * 0.02
    }
}

/// A run from a start to a time, with its end and the crossings of events.
fn run_to<'f>(
    system: &One,
    (t0, start): (f64, impl Into<Start<1>>),
    (by, steps): (AnyIntegrator, Steps),
    to: f64,
    events: impl IntoIterator<Item = Event<'f>>,
) -> (discrete_herglotz::Outcome, Vec<Crossing>) {
    let mut events = Events::new(events);
    let problem = Problem::new(system, t0, start).unwrap();
    let outcome = problem.by(by).steps(steps).observe(&mut events).run(Until::Time(to)).unwrap();
    (outcome, events.crossings)
}

/// A loop that continues from each crossing finds the next one, for any place of the surface, with the time continued
/// or reset, forward and backward, and for a function that jumps as well as for a smooth one.
#[test]
fn a_run_from_a_crossing_finds_the_next() {
    let integrators = [
        AnyIntegrator::Gauss { stages: 4 },
        AnyIntegrator::Gauss { stages: 16 },
        AnyIntegrator::Discrete(Method::Midpoint),
        AnyIntegrator::Discrete(Method::LeftMidpoint),
    ];
    for by in integrators {
        for (place, h, way) in [(0.0, 0.1, 1.0), (0.0, 1e-3, 1.0), (0.0, 0.1, -1.0), (1.0, 0.05, 1.0), (1e6, 0.1, 1.0)]
        {
            for (anew, jump, terminal) in
                [(false, false, false), (true, false, true), (false, true, false), (true, true, true)]
            {
                // Away from q = 0 a jump cannot be distinguished from the rounding of its argument.
                if jump && place != 0.0 {
                    continue;
                }
                let system = One::from(About(place));
                let (mut t, mut start) = (0.0, Start::from(VelocityPoint::new([place + 1.0], [0.0], 0.0)));
                for k in 0..12 {
                    let event = Event::new(|_, x| {
                        let g = x.q[0] - place;
                        if jump { if g > 0.0 { 1.0 } else { -1.0 } } else { g }
                    });
                    let event = if terminal { event.terminal() } else { event };
                    let (_, found) = run_to(&system, (t, start), (by, Steps::Size(h)), t + 4.0 * way, [event]);
                    let name = format!("{by} about {place} by {h}, anew {anew}, jump {jump}: the {k}th from {t}");
                    assert_eq!(found.len(), 1, "{name}: {found:?}");
                    // Half a period, a quarter at first, up to the error of midpoint steps of a tenth, 1e-3 of it, and
                    // the rounding of 1e6.
                    let passed = (found[0].t - t).abs();
                    let expected = if k == 0 { 0.5 * PI } else { PI };
                    assert!((passed - expected).abs() <= 5e-3, "{name}: after {passed}");
                    (t, start) = (if anew { 0.0 } else { found[0].t }, found[0].state.clone().into());
                }
            }
        }
    }
}

/// A throw from a place below the floor by a rounding: it returns to the floor after twice the speed over the
/// acceleration, in long and short steps.
#[test]
fn a_start_within_rounding_crosses_by_its_rate() {
    let ball = One::from(UniformField { field: [-9.81], gamma: 0.0 });
    for below in [-2e-16, 0.0, 2e-16, -1e-17] {
        for (count, h) in [(1, 20.0), (20, 1.0), (2000, 0.01)] {
            let floor = || Event::new(|_, x| x.q[0]);
            let start = VelocityPoint::new([below], [3.5], 0.0);
            let way = (AnyIntegrator::Gauss { stages: 8 }, Steps::Count(count));
            for event in [floor().terminal(), floor().falling().terminal()] {
                let (ended, found) = run_to(&ball, (0.0, start), way, 20.0, [event]);
                let name = format!("{below} by {h}: {ended:?}");
                assert!(matches!(ended.status, Status::Stopped { by: "an event", .. }) && found.len() == 1, "{name}");
                // The quotient has two roundings, and the step has length 20.
                assert!((ended.t - 7.0 / 9.81).abs() <= 8.0 * f64::EPSILON * 20.0, "{name}");
            }
        }
    }
    // From rest on the floor it falls, and does not cross the floor.
    let rest = VelocityPoint::new([0.0], [0.0], 0.0);
    let way = (AnyIntegrator::Gauss { stages: 8 }, Steps::Count(20));
    let (ended, found) = run_to(&ball, (0.0, rest), way, 2.0, [Event::new(|_, x| x.q[0])]);
    assert_eq!((ended.status, found), (Status::Completed, vec![]));
    // A start off the surface by more than rounding crosses it.
    let off = VelocityPoint::new([-1e-12], [3.5], 0.0);
    let (_, found) = run_to(&ball, (0.0, off), way, 0.5, [Event::new(|_, x| x.q[0])]);
    assert_eq!(found.len(), 1);
}

/// An event exactly where one run ends and the next begins belongs to the first one; also where an observer ends the
/// run and it is resumed.
#[test]
fn a_seam_on_a_surface_belongs_to_the_run_that_ends() {
    let system = one(HarmonicOscillator { gamma: 0.0 });
    let start = VelocityPoint::new([1.0], [0.0], 0.0);
    let way = (AnyIntegrator::Gauss { stages: 8 }, Steps::Count(8));
    let at_one = || Event::new(|t, _| t - 1.0);
    let (ended, found) = run_to(&system, (0.0, start), way, 1.0, [at_one(), at_one().rising(), at_one().falling()]);
    assert_eq!(found.iter().map(|c| (c.event, c.t)).collect::<Vec<_>>(), [(0, 1.0), (1, 1.0)]);
    assert_eq!(run_to(&system, (1.0, &ended), way, 2.0, [at_one()]).1, []);
    // The function touches zero where the runs meet.
    let touches = || Event::new(|t, _| (t - 1.0).powi(2));
    assert_eq!(run_to(&system, (0.0, start), way, 1.0, [touches()]).1, []);
    assert_eq!(run_to(&system, (1.0, &ended), way, 2.0, [touches()]).1, []);

    let path = std::env::temp_dir().join(format!("seam_on_a_surface_{}", std::process::id()));
    let problem = Problem::new(&system, 0.0, start).unwrap();
    let run = || problem.by(way.0).steps(Steps::Count(16));
    let mut saved = Checkpoint::every(8, &path).unwrap();
    let mut enough = StopsAt(8, "a test");
    let (mut first, mut second) = (Events::new([at_one()]), Events::new([at_one()]));
    let cut = run().observe(&mut first).observe(&mut saved).observe(&mut enough).run(Until::Time(2.0)).unwrap();
    let resumed = run().observe(&mut second).resume(ResumeState::read(&path).unwrap()).run(Until::Time(2.0)).unwrap();
    std::fs::remove_file(path).unwrap();
    assert_eq!((cut.t, resumed.status), (1.0, Status::Completed));
    assert_eq!((first.crossings.len(), second.crossings.len()), (1, 0));
}

/// Events at the same time are reported in the order of their index, including those after the terminal one; later
/// events are not reported.
#[test]
fn all_events_of_an_instant_are_reported() {
    let system = one(HarmonicOscillator { gamma: 0.0 });
    let start = VelocityPoint::new([1.0], [0.0], 0.0);
    for (stages, steps) in [(4, 7), (8, 3), (16, 1)] {
        let all = || {
            [
                Event::new(|_, x| x.q[0].sin()),
                Event::new(|_, x| x.q[0]).terminal(),
                Event::new(|_, x| -3.0 * x.q[0]),
                Event::new(|_, x| x.q[0] + 1e-3),
                Event::new(|_, x| x.q[0] * (2.0 + x.p[0])).terminal(),
            ]
        };
        let way = (AnyIntegrator::Gauss { stages }, Steps::Count(steps));
        let (ended, found) = run_to(&system, (0.0, start), way, 3.0, all());
        assert_eq!(found.iter().map(|c| c.event).collect::<Vec<_>>(), [0, 1, 2, 4], "{stages}");
        assert_eq!(ended.t, found[1].t);
        // The next run reports the remaining events, and then those at the next time.
        let (_, found) = run_to(&system, (ended.t, &ended), way, ended.t + 3.5, all());
        assert_eq!(found.iter().map(|c| c.event).collect::<Vec<_>>(), [3, 3, 0, 1, 2, 4], "{stages}: {found:?}");
    }
}

/// A fall towards the end of the potential: `v^2/2 - x^(5/2)` for x >= 0.
#[derive(Clone, Copy, Debug)]
pub struct EndsAtZero;

impl Lagrangian<1> for EndsAtZero {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0].sqrt().powi(5)
    }
}

/// `v^2/2 + 1/x`: an attractive centre, beyond which the motion is not defined.
#[derive(Clone, Copy, Debug)]
pub struct Well;

impl Lagrangian<1> for Well {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].recip() - z * 0.1
    }
}

/// A terminal event before the motion, or L, ceases to be defined: with an accuracy it is found with the energy of the
/// start, for any span and integrator.
#[test]
fn a_run_for_an_accuracy_may_end_in_an_event_before_its_domain_does() {
    let (ending, well) = (One::from(EndsAtZero), One::from(Well));
    let floor = |at: f64| Event::new(move |_, x| x.q[0] - at).terminal();
    for (to, at) in [(10.0, 1e-3), (1e3, 1e-3), (10.0, 1e-6), (10.0, 0.5)] {
        for v in [-1.0, 0.0, 0.5] {
            let problem = Problem::new(&ending, 0.0, VelocityPoint::new([1.0], [v], 0.0)).unwrap();
            for by in [None, Some(AnyIntegrator::Gauss { stages: 8 }), Some(AnyIntegrator::Gauss { stages: 16 })] {
                let mut events = Events::new([floor(at)]);
                let run = by.map_or_else(|| problem.accuracy(1e-9), |by| problem.by(by).accuracy(1e-9));
                let name = format!("to {to}, at {at}, v = {v}, {by:?}");
                let ended =
                    run.observe(&mut events).run(Until::Time(to)).unwrap_or_else(|error| panic!("{name}: {error}"));
                assert!(matches!(ended.status, Status::Stopped { by: "an event", .. }), "{name}: {ended:?}");
                assert_eq!((events.crossings.len(), ended.unresolved), (1, None), "{name}: {ended:?}");
                // The position is accurate to the rounding of a step of size one, the momentum to the accuracy.
                let expected = -(v * v + 2.0 - 2.0 * at.powf(2.5)).sqrt();
                assert!((ended.q[0] - at).abs() <= 8.0 * f64::EPSILON, "{name}: {ended:?}");
                assert!((ended.p[0] - expected).abs() <= 1e-9 * expected.abs(), "{name}: {ended:?}, {expected}");
            }
        }
    }
    // With dissipation, towards a pole: against a finer run to the same place.
    let problem = Problem::new(&well, 0.0, VelocityPoint::new([1.0], [0.1], 0.0)).unwrap();
    let [coarse, fine] = [1e-6, 1e-10].map(|wanted| {
        let mut events = Events::new([floor(0.01)]);
        problem.accuracy(wanted).observe(&mut events).run(Until::Time(50.0)).unwrap()
    });
    assert!(matches!(coarse.status, Status::Stopped { by: "an event", .. }), "{coarse:?}");
    assert!((coarse.p[0] - fine.p[0]).abs() <= 1e-6 * fine.p[0].abs(), "{coarse:?}, {fine:?}");
    // Without the event the motion does not reach the end of the span.
    assert!(problem.accuracy(1e-6).run(Until::Time(50.0)).is_err());
    // An event that does not occur changes nothing.
    let oscillator = one(HarmonicOscillator { gamma: 0.0 });
    let problem = Problem::new(&oscillator, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let mut events = Events::new([floor(2.0)]);
    let with = problem.accuracy(1e-9).observe(&mut events).run(Until::Time(30.0)).unwrap();
    assert_eq!((with.q, with.status), (problem.accuracy(1e-9).run(Until::Time(30.0)).unwrap().q, Status::Completed));
}

/// With given steps too: a step that cannot be completed is taken up to the event. Observers see it like any other
/// step.
#[test]
fn a_step_that_cannot_be_taken_may_end_in_an_event() {
    let system = One::from(EndsAtZero);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [-1.0], 0.0)).unwrap();
    let times: Vec<f64> = (0..64).map(|k| 0.01 * f64::from(k)).collect();
    for count in [20, 30, 50] {
        let mut events = Events::new([Event::new(|_, x| x.q[0] - 1e-3).terminal()]);
        let mut rows = Rows::at(times.iter().copied()).unwrap();
        let run = problem.by(AnyIntegrator::Gauss { stages: 8 }).steps(Steps::Count(count));
        let ended = run.observe(&mut rows).observe(&mut events).run(Until::Time(3.0)).unwrap();
        assert!(matches!(ended.status, Status::Stopped { by: "an event", .. }), "{count}: {ended:?}");
        assert!((ended.q[0] - 1e-3).abs() <= 8.0 * f64::EPSILON, "{count}: {ended:?}");
        let until = rows.rows.iter().filter(|row| row.t <= ended.t).count();
        assert_eq!(until, times.iter().filter(|t| **t <= ended.t).count(), "{count}: {ended:?}");
    }
}

/// A function that is not defined beyond its surface: the change of sign before is found, whether it ends the run or
/// not.
#[test]
fn a_crossing_before_the_function_ends_is_found() {
    let ball = One::from(UniformField { field: [-9.81], gamma: 0.0 });
    let root = || Event::new(|_, x| x.q[0].sqrt() - 0.5);
    let start = VelocityPoint::new([3.0], [0.0], 0.0);
    let expected = f64::sqrt(2.0 * 2.75 / 9.81);
    for count in [1, 3, 40] {
        let way = (AnyIntegrator::Gauss { stages: 8 }, Steps::Count(count));
        for (event, status) in [(root().terminal(), "an event"), (root().falling(), "")] {
            let (ended, found) = run_to(&ball, (0.0, start), way, 5.0, [event]);
            assert_eq!(found.len(), 1, "{count}: {ended:?}");
            // Some roundings of a time of size one, and of a step of length 5.
            assert!((found[0].t - expected).abs() <= 4.0 * 5.0 * f64::EPSILON, "{count}: {found:?}, {expected}");
            match ended.status {
                Status::Stopped { by, .. } => assert_eq!(by, status),
                other => assert!(status.is_empty() && matches!(other, Status::Failed { .. }), "{other:?}"),
            }
        }
    }
    let problem = Problem::new(&ball, 0.0, start).unwrap();
    let mut events = Events::new([root().terminal()]);
    let ended = problem.accuracy(1e-9).observe(&mut events).run(Until::Time(5.0)).unwrap();
    assert!((ended.t - expected).abs() <= 1e-9 && (ended.q[0] - 0.25).abs() <= 1e-9, "{ended:?}");
}

/// The crossings of a run from a time and a state to another time, and those of the run in parts that end at `cuts` (fractions of
/// the span) and at those crossings that `own` marks; nothing where round-off determines the time of a crossing.
fn whole_and_divided(
    driven: Driven,
    [x, v]: [f64; 2],
    [begin, end]: [f64; 2],
    (cuts, own): (&[f64], &[bool]),
    stages: usize,
) -> Option<[Vec<Crossing>; 2]> {
    let system = One::from(driven);
    let way = (AnyIntegrator::Gauss { stages }, Steps::Size(0.05));
    let all = || {
        [
            Event::new(|_, x| x.q[0]),
            Event::new(|_, x| x.p[0]),
            Event::new(|_, x| x.q[0] - 0.5).rising(),
            Event::new(|_, x| 2.0 * x.q[0]).falling(),
        ]
    };
    let start = VelocityPoint::new([x], [v], 0.0);
    let (_, whole) = run_to(&system, (begin, start), way, end, all());
    if whole.iter().any(|c| driven.rate(c).abs() <= 0.05) {
        return None;
    }
    let mut cuts: Vec<f64> = cuts.iter().map(|cut| begin + cut * (end - begin)).collect();
    cuts.extend(whole.iter().zip(own).filter(|(_, own)| **own).map(|(c, _)| c.t));
    cuts.push(end);
    cuts.sort_by(|a: &f64, b| if end < begin { b.total_cmp(a) } else { a.total_cmp(b) });
    cuts.dedup();
    let (mut t, mut from, mut divided) = (begin, Start::from(start), Vec::new());
    for cut in cuts {
        // Parts shorter than the rounding of ten steps are left out.
        if (cut - t).abs() < 1e-10 {
            continue;
        }
        let (ended, found) = run_to(&system, (t, from), way, cut, all());
        divided.extend(found);
        (t, from) = (ended.t, (&ended).into());
    }
    Some([whole, divided])
}

/// The same crossings, at the same times up to round-off.
fn assert_same_crossings(driven: Driven, [whole, divided]: &[Vec<Crossing>; 2]) {
    let names = |found: &[Crossing]| found.iter().map(|c| c.event).collect::<Vec<_>>();
    assert_eq!(names(whole), names(divided), "{whole:?} and {divided:?}");
    for (a, b) in whole.iter().zip(divided) {
        // The rounding of 400 steps of a motion of size 5, over the rate, and the rounding of the time.
        let bound = f64::EPSILON * (400.0 * 5.0 / driven.rate(a).abs() + 16.0 * a.t.abs());
        assert!((a.t - b.t).abs() <= bound, "{} and {}, not {}", a.t, b.t, bound);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    /// A run that is divided anywhere, and at its crossings, has the crossings of the whole run.
    #[test]
    fn divided_runs_have_the_crossings_of_the_whole(
        (force, frequency) in (0.0..2.0, 0.1..3.0),
        (x, v) in (-2.0..2.0, -2.0..2.0),
        (begin, span) in (prop_oneof![Just(0.0), -100.0..100.0], 5.0..20.0),
        back in any::<bool>(),
        cuts in prop::collection::vec(0.0..1.0, 0..6),
        own in prop::collection::vec(any::<bool>(), 40),
        stages in 6usize..12,
    ) {
        let driven = Driven { force, frequency };
        let end: f64 = if back { begin - span } else { begin + span };
        let found = whole_and_divided(driven, [x, v], [begin, end], (&cuts, &own), stages);
        prop_assume!(found.is_some());
        if let Some(found) = found {
            assert_same_crossings(driven, &found);
        }
    }
}

/// A part of one step that starts at the end of a long run, at a crossing; and a last step with a crossing inside and
/// another one at its end.
#[test]
fn crossings_at_the_ends_of_parts_are_counted_once() {
    let driven = Driven { force: 0.875817501567399, frequency: 2.610115294190502 };
    let start = [0.15583433971893015, 0.15253369911376333];
    let span = [-15.129160369938665, -15.129160369938665 + 18.673984875207836];
    let own: Vec<bool> = (0..20).map(|k| k == 0 || k == 19).collect();
    let long = whole_and_divided(driven, start, span, (&[0.8213724923495461], &own), 6);
    assert_same_crossings(driven, &long.unwrap());

    let driven = Driven { force: 1.8477680552298104, frequency: 2.4318356291628227 };
    let start = [1.1262415033159536, 0.5068299217854273];
    let own: Vec<bool> = (0..10).map(|k| [0, 3, 4, 7, 9].contains(&k)).collect();
    let last = whole_and_divided(driven, start, [0.0, -9.441969573156172], (&[], &own), 7);
    assert_same_crossings(driven, &last.unwrap());
}

/// The state of a crossing is a state of the motion: a row at its time has the same state, up to the rounding of the
/// time and of a step, however the crossing was found; and where no function depends on the action, it is the same
/// without the action, up to the error of the polynomials within a step of collocation, which are divided for the action too.
#[test]
fn a_crossing_is_a_state_of_the_motion() {
    let pendulum = one(Pendulum { gamma: -0.02 });
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.2], 0.3)).unwrap();
    let until = Until::Time(40.0);
    for (by, h) in [
        ("gauss_2", 0.1),
        ("gauss_4", 0.5),
        ("gauss_8", 1.0),
        ("gauss_16", 2.5),
        ("midpoint", 0.02),
        ("strang", 0.02),
        ("blanes_moan_6", 0.2),
    ] {
        let is_collocation = by.starts_with("gauss");
        let by: AnyIntegrator = by.parse().unwrap();
        // The error of the first step. That of the polynomials is a tenth of the error of their step, which along the motion is
        // less than ten times that of the first.
        let first = |by: AnyIntegrator, count| {
            problem.by(by).steps(Steps::Count(count)).run(Until::After(h)).unwrap().state().q[0]
        };
        let of_step = (first(by, 1) - first("gauss_16".parse().unwrap(), 8)).abs();
        let of_polynomials = if is_collocation { of_step } else { 0.0 };
        for at in [0.0, 0.4, -0.7] {
            let run = || problem.by(by).steps(Steps::Size(h));
            let of = || Event::new(move |_, x| x.q[0] - at);
            let (mut whole, mut bare) = (Events::new([of()]), Events::new([of()]).without_action());
            run().observe(&mut whole).run(until).unwrap();
            run().without_action().observe(&mut bare).run(until).unwrap();
            let mut rows = Rows::at(whole.crossings.iter().map(|crossing| crossing.t)).unwrap();
            run().observe(&mut rows).run(until).unwrap();
            assert!(whole.crossings.len() >= 8 && whole.crossings.len() == bare.crossings.len(), "{by}");
            for ((crossing, other), row) in whole.crossings.iter().zip(&bare.crossings).zip(&rows.rows) {
                let (state, bare) = (&crossing.state, &other.state);
                // 16 roundings of a time of 40 at speeds up to 2, and of states of size one.
                let off = [(&state.q - &row.q).norm(), (&state.p - &row.p).norm(), (state.z - row.z.unwrap()).abs()];
                let most = 16.0 * f64::EPSILON * (40.0 + 1.0);
                assert!(off.iter().all(|off| *off <= most), "{by}, {at}, t = {}: {off:?}", crossing.t);
                assert!((state.q[0] - at).abs() <= 2.0 * most, "{by}, {at}: {:e}", state.q[0] - at);
                let apart = [(crossing.t - other.t).abs(), (&state.q - &bare.q).norm(), (&state.p - &bare.p).norm()];
                assert!(apart.iter().all(|apart| *apart <= most + of_polynomials), "{by}, {at}: {apart:?}");
            }
        }
    }
}
