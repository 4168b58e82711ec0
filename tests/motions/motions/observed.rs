//! Output of runs by every integrator: rows at times, events, runs backward, stopped and resumed runs.

use crate::common::observers::{Each, StopsAt};
use crate::lagrangians::{one, two};
use crate::motions::run_of;
use contact_examples::systems::{HarmonicOscillator, Kepler, Pendulum, QuadraticInZ, System, UniformField};
use contact_geom::{
    Lagrangian, PhasePoint, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{
    AnyIntegrator, Checkpoint, CheckpointError, Event, Events, Problem, Progress, Quotient, ResumeState, Rows, Run,
    StepView, Steps, Until,
};
use discrete_herglotz::{InputError, Outcome, Status, gauss::Gauss, rules::Method};

/// Every integrator that accepts a system.
fn applicable<L: Lagrangian<N>, const N: usize>(system: &L) -> impl Iterator<Item = AnyIntegrator> {
    AnyIntegrator::all().into_iter().filter(|integrator| integrator.check(system).is_ok())
}

/// A number of steps up to a time; in transformed time, whose rate is about one, steps of the same size.
fn steps(integrator: AnyIntegrator, count: usize, span: f64) -> Steps {
    match integrator {
        AnyIntegrator::TransformedGauss { .. } => Steps::Size(span.abs() / count as f64),
        _ => Steps::Count(count),
    }
}

/// A run in a number of steps up to a time after the start.
fn run_in<'r, 'o, L: Lagrangian<N>, const N: usize>(
    problem: &'r Problem<'r, L, N>,
    integrator: AnyIntegrator,
    count: usize,
    span: f64,
) -> Run<'r, 'o, Problem<'r, L, N>> {
    problem.by(integrator).steps(steps(integrator, count, span))
}

fn symmetric(integrator: AnyIntegrator) -> bool {
    match integrator {
        AnyIntegrator::Discrete(method) => method.symmetric(),
        _ => true,
    }
}

fn distance<const N: usize>(a: &PhasePoint<N>, b: &PhasePoint<N>) -> f64 {
    max_or_nan(max_abs_or_nan((a.q - b.q).iter().chain((a.p - b.p).iter()).copied()), (a.z - b.z).abs())
}

/// Forward and backward: symmetric integrators return to the start up to round-off, others up to the error of their
/// order.
#[test]
fn there_and_back() {
    fn check<L: Lagrangian<N>, const N: usize>(system: &L, start: VelocityPoint<N>) -> usize {
        let problem = Problem::new(system, 0.5, start).unwrap();
        let mut count = 0;
        for integrator in applicable(system) {
            let by = |problem: &Problem<'_, L, N>, from: f64, to: f64| {
                problem.by(integrator).steps(steps(integrator, 40, to - from)).run(Until::Time(to)).unwrap()
            };
            let there = by(&problem, 0.5, 2.5);
            assert_eq!((there.status, there.t), (Status::Completed, 2.5), "{integrator}");
            let back = by(&Problem::new(system, there.t, &there).unwrap(), 2.5, 0.5);
            assert_eq!((back.status, back.unresolved), (Status::Completed, None), "{integrator}");
            assert!((back.t - 0.5).abs() <= 4.0 * f64::EPSILON, "{integrator}: {}", back.t);
            // The rounding of 80 steps; in transformed time the last steps of the two runs differ, so that the error of
            // the method remains.
            let transformed = matches!(integrator, AnyIntegrator::TransformedGauss { .. });
            let rounded = symmetric(integrator) && !transformed;
            let bound = if rounded { 1e-13 } else { 0.5 * f64::powi(0.3, integrator.order().min(24) as i32) + 1e-13 };
            let off = distance(&back.state().fixed(), problem.state());
            assert!(off <= bound, "{integrator}: {off:e}");
            assert!(rounded || off > 0.0, "{integrator}");
            count += 1;
        }
        count
    }
    let kepler = Kepler::<2> { mu: 1.0, gamma: -0.05 };
    assert!(check(&one(Pendulum { gamma: -0.1 }), VelocityPoint::new([1.0], [0.3], 0.2)) > 40);
    assert!(check(&one(QuadraticInZ { c: 0.3 }), VelocityPoint::new([1.0], [0.3], 0.2)) > 30);
    assert!(check(&kepler, kepler.initial()) > 50);
}

/// States between the ends of steps are as accurate as the steps, within a factor ten; the run is the same to the last
/// bit with and without observers.
#[test]
fn rows_at_times() {
    let (kepler, span) = (Kepler::<2> { mu: 1.0, gamma: -0.05 }, 2.0);
    let start = kepler.initial();
    let fine = |t: f64| run_of(&kepler, start, t, AnyIntegrator::Gauss { stages: 12 }, Steps::Count(40)).unwrap();
    let times: Vec<f64> = (0..=13).map(|k| span * f64::from(k) / 13.0).collect();
    let truth: Vec<_> = times.iter().map(|t| if *t == 0.0 { None } else { Some(fine(*t).state().fixed()) }).collect();
    let problem = Problem::new(&kepler, 0.0, start).unwrap();
    for integrator in applicable(&kepler) {
        let mut rows = Rows::at(times.iter().copied()).unwrap().with_velocity();
        let observed = run_in(&problem, integrator, 40, span).observe(&mut rows).run(Until::Time(span)).unwrap();
        assert_eq!(observed, run_in(&problem, integrator, 40, span).run(Until::Time(span)).unwrap(), "{integrator}");
        assert_eq!(rows.rows.iter().map(|row| row.t).collect::<Vec<_>>(), times, "{integrator}");
        let error = |row: &discrete_herglotz::Row, truth: &Option<PhasePoint<2>>| {
            let state = PhasePoint { q: row.q.fixed(), p: row.p.fixed(), z: row.z.unwrap() };
            assert_eq!(row.v.as_ref(), Some(&row.p));
            truth.map_or(0.0, |truth| distance(&state, &truth))
        };
        let errors: Vec<f64> = rows.rows.iter().zip(&truth).map(|(row, truth)| error(row, truth)).collect();
        let (at_end, worst) = (errors[13], max_abs_or_nan(errors.iter().copied()));
        assert!(worst <= 10.0 * at_end + 1e-13, "{integrator}: {worst:e}, at the end {at_end:e}");
    }
}

/// Rows by steps and at the end, with columns; a run backward records them in its own order.
#[test]
fn rows_every_so_many_steps() {
    let pendulum = one(Pendulum { gamma: -0.1 });
    let problem = Problem::new(&pendulum, 1.0, VelocityPoint::new([1.0], [0.3], 0.2)).unwrap();
    for (to, way) in [(2.0, 1.0), (0.0, -1.0)] {
        let mut rows = Rows::every(4).unwrap().column("t + q", |t, x| t + x.q[0]);
        let run = problem.by(AnyIntegrator::Discrete(Method::Midpoint)).steps(Steps::Count(10)).observe(&mut rows);
        let outcome = run.run(Until::Time(to)).unwrap();
        let times: Vec<f64> = rows.rows.iter().map(|row| row.t).collect();
        assert_eq!(times, [1.0, 1.0 + 0.4 * way, 1.0 + 0.8 * way, to]);
        assert_eq!(rows.rows[3].q, outcome.q);
        assert!(rows.rows.iter().all(|row| row.columns == [row.t + row.q[0]]));
    }
}

/// Velocity, energy and conformal factor at given times: the energy decays as the factor, also between the ends of
/// steps.
#[test]
fn columns_of_rows() {
    let system = one(QuadraticInZ::default());
    let problem = Problem::new(&system, 0.0, QuadraticInZ::default().initial()).unwrap();
    for integrator in applicable(&system) {
        let mut rows = Rows::at((0..=7).map(|k| f64::from(k) / 7.0)).unwrap();
        rows = rows.with_velocity().with_energy().with_conformal_factor();
        let names = ["t", "q0", "v0", "p0", "z", "energy", "log_factor"];
        run_in(&problem, integrator, 20, 1.0).observe(&mut rows).run(Until::Time(1.0)).unwrap();
        assert_eq!(rows.header(), names);
        let numbers: Vec<Vec<f64>> = rows.rows.iter().map(|row| row.numbers().collect()).collect();
        assert_eq!((numbers.len(), numbers[0][6]), (8, 0.0), "{integrator}");
        for row in &numbers {
            let &[t, q, v, p, z, energy, log_factor] = row.as_slice() else { panic!("{row:?}") };
            let x = VelocityPoint::new([q], [v], z);
            assert!((p - contact_geom::legendre(&system, t, &x).p[0]).abs() <= 4.0 * f64::EPSILON * p.abs());
            assert!((energy - (v * p - system.value(t, &x.q, &x.v, z))).abs() <= 8.0 * f64::EPSILON);
            // The error of the order of the steps; for order one the error of the energy is of the size of a step.
            let bound = 4.0 * f64::powi(0.15, integrator.order().min(16) as i32) + 1e-13;
            let off = energy / numbers[0][5] / log_factor.exp() - 1.0;
            assert!(off.abs() <= bound, "{integrator}, t = {t}: {off:e}");
        }
    }
}

/// Progress is reported at most a hundred times, from 0 to 1; also in transformed time, where the run counts its steps
/// itself.
#[test]
fn progress_is_reported() {
    let kepler = Kepler::<2>::default();
    let problem = Problem::new(&kepler, 0.0, kepler.initial()).unwrap();
    // In transformed time the number of steps is not known, and progress is reported after a number of steps.
    let (gauss, transformed) = (AnyIntegrator::Gauss { stages: 2 }, AnyIntegrator::TransformedGauss { stages: 2 });
    for (integrator, count, least) in [(gauss, 777, 98), (transformed, 7000, 6)] {
        let mut parts = Vec::new();
        let mut progress = Progress::new(|part| parts.push(part));
        run_in(&problem, integrator, count, 5.0).observe(&mut progress).run(Until::Time(5.0)).unwrap();
        assert!(parts.len() >= least && parts.len() <= 102, "{integrator}: {}", parts.len());
        assert_eq!((parts[0], parts[parts.len() - 1]), (0.0, 1.0));
        assert!(parts.windows(2).all(|pair| pair[0] < pair[1]), "{parts:?}");
    }
}

/// Two momenta of one motion have the same factor: their quotient is conserved, by steps of any method; other quotients
/// are not.
#[test]
fn quotients_are_conserved() {
    let system = two(UniformField { field: [0.0, 0.0], gamma: -0.3 });
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([0.0, 0.0], [0.3, 0.7], 0.0)).unwrap();
    for integrator in applicable(&system) {
        let mut momenta = Quotient::new(|_, x| x.p[0], |_, x| x.p[1]);
        let mut other = Quotient::new(|_, x| x.p[0], |_, x| x.p[1] * x.p[1]);
        run_in(&problem, integrator, 30, 3.0).observe(&mut momenta).observe(&mut other).run(Until::Time(3.0)).unwrap();
        assert_eq!(momenta.rows.len(), 31, "{integrator}");
        assert!(momenta.largest_change() <= 30.0 * f64::EPSILON, "{integrator}: {:e}", momenta.largest_change());
        assert!(other.largest_change() > 0.5, "{integrator}");
    }
}

/// Events by every integrator: as accurate as its steps, in both directions, and terminal ones end the run.
#[test]
fn events_by_every_integrator() {
    let pendulum = one(Pendulum { gamma: -0.1 });
    let start = VelocityPoint::new([1.0], [0.3], 0.2);
    let problem = Problem::new(&pendulum, 0.0, start).unwrap();
    let lowest = || Event::new(|_, x| x.q[0]);
    let mut first = None;
    let all: Vec<AnyIntegrator> = applicable(&pendulum).collect();
    // The reference is found by the first integrator.
    let gauss = AnyIntegrator::Gauss { stages: 8 };
    for integrator in [gauss].into_iter().chain(all) {
        let mut passes = Events::new([lowest(), lowest().rising(), lowest().falling()]);
        let outcome = run_in(&problem, integrator, 60, 12.0).observe(&mut passes).run(Until::Time(12.0)).unwrap();
        assert_eq!(outcome.status, Status::Completed, "{integrator}");
        let of = |event| passes.crossings.iter().filter(|c| c.event == event).map(|c| c.t).collect::<Vec<_>>();
        assert_eq!((of(0).len(), of(1).len(), of(2).len()), (4, 2, 2), "{integrator}");
        let truth = *first.get_or_insert(of(0)[3]);
        let bound = f64::powi(0.45, integrator.order().min(30) as i32) + 1e-13;
        assert!((of(0)[3] - truth).abs() <= bound, "{integrator}: {:e}", of(0)[3] - truth);
        // On the curve, to the rounding of the time: the speed is below one.
        for crossing in &passes.crossings {
            assert!(crossing.state.q[0].abs() <= 4.0 * f64::EPSILON * crossing.t, "{integrator}: {crossing:?}");
        }
        let mut end = Events::new([lowest().falling().terminal()]);
        let stopped = run_in(&problem, integrator, 60, 12.0).observe(&mut end).run(Until::Time(12.0)).unwrap();
        let crossing = &end.crossings[0];
        assert_eq!(stopped.status, Status::Stopped { step: stopped.steps, t: crossing.t, by: "an event" });
        assert_eq!((stopped.t, stopped.state()), (crossing.t, crossing.state.clone()), "{integrator}");
        // A run in other steps from the crossing to the next event.
        let onward = Problem::new(&pendulum, stopped.t, &stopped).unwrap();
        let mut next = Events::new([lowest().rising().terminal()]);
        let rest = 12.0 - stopped.t;
        run_in(&onward, integrator, 50, rest).observe(&mut next).run(Until::Time(12.0)).unwrap();
        assert!((next.crossings[0].t - of(1)[0]).abs() <= bound, "{integrator}");
    }
}

/// The factor of a run that an event ends within a step is that of a run to the time of the event.
#[test]
fn the_factor_of_a_stop_is_that_up_to_it() {
    let system = one(QuadraticInZ::default());
    let problem = Problem::new(&system, 0.0, QuadraticInZ::default().initial()).unwrap();
    for integrator in applicable(&system) {
        let mut events = Events::new([Event::new(|t, _| t - 0.53).terminal()]);
        let run = run_in(&problem, integrator, 20, 1.0).with_conformal_factor();
        let stopped = run.observe(&mut events).run(Until::Time(1.0)).unwrap();
        let mut rows = Rows::at([0.53]).unwrap().with_conformal_factor();
        run_in(&problem, integrator, 20, 1.0).observe(&mut rows).run(Until::Time(1.0)).unwrap();
        let (found, row) = (stopped.log_factor.unwrap(), rows.rows[0].log_factor.unwrap());
        // The time of the event is rounded, and the factor with it.
        assert!((found - row).abs() <= 8.0 * f64::EPSILON, "{integrator}: {found} and {row}");
        let whole = run_in(&problem, integrator, 20, 1.0).with_conformal_factor().run(Until::Time(1.0)).unwrap();
        assert!((found - whole.log_factor.unwrap()).abs() > 1e-2, "{integrator}");
    }
}

/// A function that is not finite ends the run; a function that is zero at the start has no sign before it changes.
#[test]
fn events_that_are_not_defined() {
    let pendulum = one(Pendulum { gamma: 0.0 });
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
    let run = |events: &mut Events<'_>| {
        problem
            .by(AnyIntegrator::Gauss { stages: 4 })
            .steps(Steps::Count(20))
            .observe(events)
            .run(Until::Time(4.0))
            .unwrap()
    };
    let mut events = Events::new([Event::new(|t, _| if t < 2.1 { 1.0 } else { f64::NAN })]);
    let outcome = run(&mut events);
    assert!(
        matches!(outcome.status, Status::Failed { cause: discrete_herglotz::StepError::Event { t }, .. } if t >= 2.1),
        "{outcome:?}"
    );
    // The events of another function earlier in the same step of 2.0 to 2.2 are kept.
    let undefined = || Event::new(|t, _| if t < 2.1 { 1.0 } else { f64::NAN });
    let mut with_another = Events::new([undefined(), Event::new(|t, _| t - 2.05)]);
    assert!(matches!(run(&mut with_another).status, Status::Failed { .. }));
    assert_eq!(with_another.crossings.iter().map(|c| (c.event, c.t)).collect::<Vec<_>>(), [(1, 2.05)]);
    let mut from_zero = Events::new([Event::new(|_, x| x.q[0])]);
    assert_eq!(run(&mut from_zero).status, Status::Completed);
    assert_eq!(from_zero.crossings.len(), 1);
    assert!(from_zero.crossings[0].t > 3.0);
    let mut at_start = Events::new([Event::new(|t, _| if t > 0.0 { 1.0 } else { f64::NAN })]);
    let outcome = run(&mut at_start);
    assert_eq!((outcome.steps, outcome.t), (0, 0.0));
    assert!(matches!(outcome.status, Status::Failed { cause: discrete_herglotz::StepError::Event { .. }, .. }));
}

/// An observer that stops a run, at the start or after some steps; its requests determine what is computed, and do not
/// change the motion.
#[test]
fn observers_ask_and_stop() {
    let kepler = Kepler::<2> { mu: 1.0, gamma: -0.05 };
    let problem = Problem::new(&kepler, 0.0, kepler.initial()).unwrap();
    for integrator in applicable(&kepler) {
        let plain = run_in(&problem, integrator, 20, 1.0).without_action().run(Until::Time(1.0)).unwrap();
        assert_eq!((plain.z, plain.log_factor), (None, None));
        let mut seen = Vec::new();
        let mut watch = Each(|at: &StepView<'_>| seen.push((at.k, at.t, at.energy().unwrap())));
        let watched: Outcome =
            run_in(&problem, integrator, 20, 1.0).without_action().observe(&mut watch).run(Until::Time(1.0)).unwrap();
        assert_eq!((plain.q, plain.p, plain.steps), (watched.q, watched.p, watched.steps), "{integrator}");
        assert!(watched.z.is_some() && seen.len() == watched.steps, "{integrator}");
        let mut stops = StopsAt(5, "the fifth step");
        let stopped = run_in(&problem, integrator, 20, 1.0)
            .with_conformal_factor()
            .observe(&mut stops)
            .run(Until::Time(1.0))
            .unwrap();
        assert_eq!(stopped.status, Status::Stopped { step: 5, t: seen[4].1, by: "the fifth step" });
        let factor = stopped.log_factor.unwrap() + 0.05 * stopped.t;
        let order = if let AnyIntegrator::Discrete(_) = integrator { 1e-3 } else { 1e-4 };
        assert!(factor.abs() <= order, "{integrator}: {factor:e}");
    }
}

/// Output times that are not in order, outside of the span, or not finite.
#[test]
fn what_cannot_be_observed_is_refused() {
    let pendulum = one(Pendulum { gamma: 0.0 });
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
    for times in [vec![1.0, 0.5, 2.0], vec![0.0, f64::NAN], vec![f64::INFINITY], vec![1.0, 1.0]] {
        assert!(matches!(Rows::at(times.clone()), Err(InputError::Times { .. })), "{times:?}");
    }
    let run = |times: &[f64], to| {
        let mut rows = Rows::at(times.iter().copied()).unwrap();
        problem
            .by(AnyIntegrator::Gauss { stages: 4 })
            .steps(Steps::Count(4))
            .observe(&mut rows)
            .run(Until::Time(to))
            .map(drop)
    };
    assert_eq!(run(&[0.5, 1.0], 1.0), Ok(()));
    assert_eq!(run(&[0.5, 1.5], 1.0), Err(InputError::Times { index: 1, t: 1.5 }));
    assert_eq!(run(&[0.5, 1.0], -1.0), Err(InputError::Times { index: 0, t: 0.5 }));
    assert_eq!(run(&[-0.25, -0.5], -1.0), Ok(()));
    // A run to its start has the start alone.
    assert_eq!((run(&[], 0.0), run(&[0.0], 0.0)), (Ok(()), Ok(())));
    assert_eq!(run(&[0.0, 0.5], 0.0), Err(InputError::Times { index: 0, t: 0.0 }));
    assert!(Gauss::new(&pendulum, 4, -0.1).is_ok());
}

/// A run that is interrupted anywhere and resumed is the same to the last bit, by every integrator, with its
/// compensated sums and extrapolated starts.
#[test]
fn interrupted_runs_are_resumed() {
    fn check<L: Lagrangian<N>, const N: usize>(system: &L, start: VelocityPoint<N>, name: &str) -> usize {
        let path = std::env::temp_dir().join(format!("interrupted_{name}_{}", std::process::id()));
        let problem = Problem::new(system, 0.0, start).unwrap();
        let mut places = 0;
        for integrator in applicable(system) {
            let whole = run_in(&problem, integrator, 60, 6.0).with_conformal_factor().run(Until::Time(6.0)).unwrap();
            assert_eq!(whole.status, Status::Completed, "{integrator}");
            // Places that are not periodic.
            for place in [1, 2 + whole.steps * 5 / 13, whole.steps - 1] {
                let mut saved = Checkpoint::every(place, &path).unwrap();
                let mut interrupt = StopsAt(place, "a test");
                let run = run_in(&problem, integrator, 60, 6.0).with_conformal_factor();
                let stopped = run.observe(&mut saved).observe(&mut interrupt).run(Until::Time(6.0)).unwrap();
                assert_eq!((stopped.steps, saved.error.is_none()), (place, true), "{integrator}");
                let run = run_in(&problem, integrator, 60, 6.0).with_conformal_factor();
                let resumed = run.resume(ResumeState::read(&path).unwrap()).run(Until::Time(6.0)).unwrap();
                assert_eq!(resumed, whole, "{integrator} from {place}");
                places += 1;
            }
        }
        // The checkpoint of another run is refused.
        let other = run_in(&problem, AnyIntegrator::Discrete(Method::Midpoint), 61, 6.0);
        let refused = other.resume(ResumeState::read(&path).unwrap()).run(Until::Time(6.0));
        assert_eq!(refused, Err(InputError::AnotherRun));
        std::fs::remove_file(path).unwrap();
        places
    }
    let kepler = Kepler::<2> { mu: 1.0, gamma: -0.05 };
    let oscillator = one(HarmonicOscillator { gamma: -0.1 });
    let start = VelocityPoint::new([1.0], [0.3], 0.2);
    let places = check(&one(Pendulum { gamma: -0.1 }), start, "pendulum")
        + check(&oscillator, start, "oscillator")
        + check(&one(QuadraticInZ { c: 0.3 }), start, "square")
        + check(&kepler, kepler.initial(), "kepler");
    assert!(places > 400, "{places}");
}

/// The detection of unresolved steps is resumed with the run, wherever it is interrupted: its samples, and the result
/// at the end.
#[test]
fn unresolved_steps_are_resumed() {
    let system = Kepler::<2> { mu: 1.0, gamma: 0.0 };
    let path = std::env::temp_dir().join(format!("interrupted_marks_{}", std::process::id()));
    let mut flagged = 0;
    for e in [0.9, 0.99] {
        let start = VelocityPoint::new([1.0 + e, 0.0], [0.0, f64::sqrt((1.0 - e) / (1.0 + e))], 0.0);
        let problem = Problem::new(&system, 0.0, start).unwrap();
        for integrator in applicable(&system) {
            let run = || run_in(&problem, integrator, 40, std::f64::consts::TAU).with_conformal_factor();
            let until = Until::Time(std::f64::consts::TAU);
            let whole = run().run(until).unwrap();
            flagged += usize::from(whole.unresolved.is_some());
            for place in [1, 8, 16, 17, 32, whole.steps].into_iter().filter(|k| (1..=whole.steps).contains(k)) {
                let mut saved = Checkpoint::every(place, &path).unwrap();
                let mut interrupt = StopsAt(place, "a test");
                let stopped = run().observe(&mut saved).observe(&mut interrupt).run(until).unwrap();
                let resumed = run().resume(ResumeState::read(&path).unwrap()).run(until).unwrap();
                // As text, since a defect may be NaN.
                assert_eq!(format!("{resumed:?}"), format!("{whole:?}"), "{integrator} from {place}: {stopped:?}");
            }
        }
    }
    std::fs::remove_file(path).unwrap();
    assert!(flagged > 30, "{flagged}");
}

/// A file that does not exist, belongs to no run or to another version, or is truncated or changed.
#[test]
fn damaged_checkpoints_are_refused() {
    let pendulum = one(Pendulum { gamma: -0.1 });
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.3], 0.2)).unwrap();
    let path = std::env::temp_dir().join(format!("damaged_{}", std::process::id()));
    assert!(matches!(ResumeState::read(&path), Err(CheckpointError::Unreadable(_))));
    let mut saved = Checkpoint::every(5, &path).unwrap();
    run_in(&problem, AnyIntegrator::Gauss { stages: 8 }, 10, 1.0).observe(&mut saved).run(Until::Time(1.0)).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        ResumeState::read(&path)
    };
    assert!(read(&whole).is_ok());
    for cut in [0, 7, 8, 15, 16, whole.len() / 2, whole.len() - 8, whole.len() - 1] {
        let found = read(&whole[..cut]);
        let right = if cut < 8 {
            matches!(found, Err(CheckpointError::Foreign))
        } else {
            matches!(found, Err(CheckpointError::Damaged))
        };
        assert!(right, "{cut}: {found:?}");
    }
    for place in (16..whole.len()).step_by(5) {
        let mut other = whole.clone();
        other[place] ^= 1;
        assert!(matches!(read(&other), Err(CheckpointError::Damaged)), "{place}");
    }
    let mut newer = whole.clone();
    newer[8] = 5;
    assert!(matches!(read(&newer), Err(CheckpointError::Version { found: 5 })));
    std::fs::remove_file(path).unwrap();
    // A path that cannot be written to ends the run, with a status.
    let mut nowhere = Checkpoint::every(5, "/dev/null/checkpoint").unwrap();
    let run = run_in(&problem, AnyIntegrator::Gauss { stages: 8 }, 10, 1.0).observe(&mut nowhere);
    let ended = run.run(Until::Time(1.0)).unwrap();
    assert!(matches!(ended.status, Status::Stopped { step: 5, .. }) && nowhere.error.is_some());
}
