//! All sign changes of an event function within one step, and a status where they cannot be told apart.

use crate::lagrangians::{One, SwitchingOne, one};
use contact_examples::systems::{FreeParticle, HarmonicOscillator, OneCoordinate};
use contact_geom::nalgebra::SVector;
use contact_geom::{Hints, Lagrangian, Scalar, VelocityPoint};
use discrete_herglotz::{
    AnyIntegrator, Event, Events, GaussCollocation, Outcome, Problem, Status, StepError, Steps, Until, rules::Method,
};
use std::f64::consts::PI;

/// `v^2/2 + (6t + 12) x`: the motion from `x = -120` with `v = 92` at t = -8 is `(t + 6)(t + 2)(t - 2)`.
#[derive(Clone, Copy, Debug)]
pub struct Cubic;

impl Lagrangian<1> for Cubic {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 + (t * 6.0 + 12.0) * q[0]
    }
}

const LINE: One = One::Catalogue(OneCoordinate::FreeParticle(FreeParticle { gamma: 0.0 }));

/// The outcome of a run, and the times of the sign changes of one event.
fn times_of(
    system: &One,
    (t0, x, v): (f64, f64, f64),
    (stages, steps, to): (usize, usize, f64),
    event: Event<'_>,
) -> (Outcome, Vec<f64>) {
    let mut events = Events::new([event]);
    let problem = Problem::new(system, t0, VelocityPoint::new([x], [v], 0.0)).unwrap();
    let run = problem.by(GaussCollocation { stages }).steps(Steps::Count(steps));
    let outcome = run.observe(&mut events).run(Until::Time(to)).unwrap();
    (outcome, events.crossings.iter().map(|crossing| crossing.t).collect())
}

/// The times agree with expected ones, to a bound.
fn assert_times(name: &str, found: &[f64], expected: &[f64], bound: f64) {
    assert_eq!(found.len(), expected.len(), "{name}: {found:?}, not {expected:?}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= bound, "{name}: {found:?}, not {expected:?}");
    }
}

#[test]
fn three_sign_changes_of_a_motion_in_one_step() {
    let position = || Event::new(|_, x| x.q[0]);
    // The curve of a step with two stages is a parabola.
    let cubic = One::from(Cubic);
    for stages in 3..=16 {
        let of = |event| times_of(&cubic, (-8.0, -120.0, 92.0), (stages, 1, 4.0), event);
        let name = format!("{stages} stages");
        // Roundings of a step of length 12 over speeds of 16 and more.
        assert_times(&name, &of(position()).1, &[-6.0, -2.0, 2.0], 1e-12);
        assert_times(&name, &of(position().falling()).1, &[-2.0], 1e-12);
        let (ended, found) = of(position().terminal());
        assert_times(&name, &found, &[-6.0], 1e-12);
        assert!(ended.t == found[0] && matches!(ended.status, Status::Stopped { by: "an event", .. }), "{ended:?}");
    }
    let (_, back) = times_of(&cubic, (4.0, 120.0, 92.0), (4, 1, -8.0), position());
    assert_times("backward", &back, &[2.0, -2.0, -6.0], 1e-12);
}

#[test]
fn three_sign_changes_of_a_function_in_one_step() {
    let product = |x: f64| (2.5 - x) * (5.0 - x) * -x;
    for stages in 1..=16 {
        let event = Event::new(|_, x| product(x.q[0]));
        let (_, found) = times_of(&LINE, (0.0, -1.0, 1.0), (stages, 1, 8.0), event);
        assert_times(&format!("{stages} stages"), &found, &[1.0, 3.5, 6.0], 1e-13);
    }
    // Without dense output.
    for by in [AnyIntegrator::Discrete(Method::Midpoint), "strang".parse().unwrap()] {
        let mut events = Events::new([Event::new(|_, x| product(x.q[0]))]);
        let problem = Problem::new(&LINE, 0.0, VelocityPoint::new([-1.0], [1.0], 0.0)).unwrap();
        problem.by(by).steps(Steps::Count(1)).observe(&mut events).run(Until::Time(8.0)).unwrap();
        let found: Vec<f64> = events.crossings.iter().map(|crossing| crossing.t).collect();
        assert_times(&by.to_string(), &found, &[1.0, 3.5, 6.0], 1e-13);
    }
}

#[test]
fn an_oscillation_over_several_periods_of_one_step() {
    let angle = (-0.9f64).acos();
    for way in [1.0, -1.0] {
        for stages in [1, 2, 4, 8, 16] {
            for span in [7.0, 20.0, 30.0, 61.7] {
                let event = Event::new(|t: f64, _| t.cos() + 0.9);
                let (outcome, found) = times_of(&LINE, (0.0, 0.0, 1.0), (stages, 1, way * span), event);
                let all = (0..).flat_map(|k| [angle, 2.0 * PI - angle].map(|x| x + 2.0 * PI * f64::from(k)));
                let expected: Vec<f64> = all.take_while(|t| *t < span).map(|t| way * t).collect();
                let name = format!("{stages} stages, to {}", way * span);
                assert_times(&name, &found, &expected, 1e-12);
                assert_eq!(outcome.status, Status::Completed, "{name}");
            }
        }
        let event = Event::new(|t: f64, _| (20.0 * t).sin());
        let (_, found) = times_of(&LINE, (0.05 * way, 0.0, 1.0), (4, 1, way * 10.05), event);
        let expected: Vec<f64> = (1..64).map(|k| way * f64::from(k) * PI / 20.0).collect();
        assert_times("sin(20 t)", &found, &expected, 1e-12);
    }
}

/// A surface that is almost tangent to the motion: two sign changes if it is crossed by 1e-8, none if it is missed by
/// it.
#[test]
fn an_almost_tangent_surface() {
    for stages in [2, 4, 8, 16] {
        for depth in [1e-4, 1e-8, 1e-12] {
            // The place is no node, nor a fraction of the step that a bisection meets.
            let near = |offset: f64| Event::new(move |_, x| (x.q[0] - 0.1234).powi(2) + offset);
            let of = |offset| times_of(&LINE, (0.0, -1.0, 1.0), (stages, 1, 2.5), near(offset));
            let name = format!("{stages} stages, {depth:e}");
            let half = f64::sqrt(depth);
            // The rounding of the function over its slope.
            assert_times(&name, &of(-depth).1, &[1.1234 - half, 1.1234 + half], 1e-13 + 1e-15 / half);
            assert_times(&name, &of(depth).1, &[], 0.0);
        }
    }
    // In the middle of a step of a motion that the curve of the step has only to 1e-6.
    let oscillator = one(HarmonicOscillator { gamma: 0.0 });
    let of = |offset: f64| {
        let event = Event::new(move |_, x| x.q[0] + 1.0 + offset);
        times_of(&oscillator, (0.0, 1.0, 0.0), (8, 3, 6.0), event)
    };
    let half = f64::acos(1.0 - 1e-8);
    assert_times("oscillator", &of(-1e-8).1, &[PI - half, PI + half], 1e-9);
    assert_times("oscillator", &of(1e-8).1, &[], 0.0);
    // It touches its turning point.
    assert_times("oscillator", &of(0.0).1, &[], 0.0);
}

/// Kinks and jumps are found by bisection, functions in single precision up to their noise.
#[test]
fn functions_that_are_not_smooth() {
    for stages in [2, 4, 8, 16] {
        let of = |g: fn(f64) -> f64| {
            let event = Event::new(|_, x| g(x.q[0]));
            let (outcome, found) = times_of(&LINE, (0.0, 0.0, 1.0), (stages, 1, 1.0), event);
            assert_eq!(outcome.status, Status::Completed, "{stages} stages");
            found
        };
        let name = format!("{stages} stages");
        let third = 1.0 / 3.0;
        assert_times(&name, &of(|x| (x - 1.0 / 3.0).abs() - 1e-3), &[third - 1e-3, third + 1e-3], 1e-15);
        assert_times(&name, &of(|x| (x - 1.0 / 3.0).abs() + 1e-3), &[], 0.0);
        assert_times(&name, &of(|x| (x - 1.0 / 3.0).abs()), &[], 0.0);
        assert_times(&name, &of(|x| (x - 0.3).signum()), &[0.3], 1e-15);
        assert_times(&name, &of(|x| (x - 0.3).signum() * (x - 0.6).signum()), &[0.3, 0.6], 1e-15);
        assert_times(&name, &of(|x| if x < 0.3 { 1.0 } else { 100.0 }), &[], 0.0);
        assert_times(&name, &of(|x| (6.7 * x).fract() - 0.5), &saw(), 1e-15);
        assert_times(&name, &of(|x| f64::from(x as f32) - 0.7), &[0.7], 1e-7);
        assert_times(&name, &of(|x| f64::from(x as f32) + 0.7), &[], 0.0);
    }
    // A conserved quantity is zero up to round-off: whatever is found, the run continues.
    let energy = Event::new(|_, x| (x.q[0].powi(2) + x.p[0].powi(2)) * 0.5 - 0.5);
    let (outcome, _) = times_of(&one(HarmonicOscillator { gamma: 0.0 }), (0.0, 1.0, 0.0), (8, 400, 40.0), energy);
    assert_eq!(outcome.status, Status::Completed);
}

/// The sign changes of a saw with 6.7 teeth: in the middle of each tooth, and between two of them.
fn saw() -> Vec<f64> {
    (1..14).map(|k| f64::from(k) / 13.4).collect()
}

#[test]
fn a_function_that_is_too_fast_is_a_status() {
    for way in [1.0, -1.0] {
        for (stages, steps) in [(1, 1), (4, 1), (8, 1), (16, 1), (4, 10)] {
            let event = Event::new(|t: f64, _| (1e6 * t).sin() + 0.3);
            let (outcome, found) = times_of(&LINE, (0.0, 0.0, 1.0), (stages, steps, way * 10.0), event);
            let Status::Failed { cause: cause @ StepError::EventUnresolved { t }, step: 1, .. } = outcome.status else {
                panic!("{outcome:?}")
            };
            assert!((0.0..=10.0).contains(&(way * t)), "{cause}");
            // What was found is right: the sines are -0.3 in turns.
            let before = (-0.3f64).asin();
            for (k, t) in found.iter().enumerate() {
                let (k, t) = (k as f64, way * t);
                let angle = PI * (k + 1.0) - before * if k % 2.0 == 0.0 { 1.0 } else { -1.0 };
                let angle = if way > 0.0 { angle } else { PI * k + before * if k % 2.0 == 0.0 { -1.0 } else { 1.0 } };
                assert!((1e6 * t - angle).abs() <= 1e-6, "{k}: {t}, {angle}");
            }
        }
    }
    // Another event is found up to there, and a terminal one before ends the run.
    let fast = || Event::new(|t: f64, _| if t < 1.0 { 1.0 } else { (1e6 * (t - 1.0)).cos() });
    for terminal in [false, true] {
        let [early, late] = [0.5, 9.0].map(|at| Event::new(move |t: f64, _| t - at));
        let mut events = Events::new([late, fast(), if terminal { early.terminal() } else { early }]);
        let problem = Problem::new(&LINE, 0.0, VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
        let run = problem.by(GaussCollocation { stages: 4 }).steps(Steps::Count(1)).observe(&mut events);
        let outcome = run.run(Until::Time(10.0)).unwrap();
        let found: Vec<_> = events.crossings.iter().filter(|c| c.event != 1).map(|c| (c.event, c.t)).collect();
        assert_eq!(found, [(2, 0.5)], "{outcome:?}");
        match outcome.status {
            Status::Stopped { by: "an event", .. } if terminal => assert_eq!(outcome.t, 0.5),
            Status::Failed { cause: StepError::EventUnresolved { t }, .. } if !terminal => assert!(t >= 0.9, "{t}"),
            other => panic!("{other:?}"),
        }
    }
}

/// A throw upward in a field of one, with a further force of 100 downward above x = 0.4999, just below the vertex.
#[derive(Clone, Copy, Debug)]
pub struct Ceiling;

const CEILING: f64 = 0.4999;

impl Lagrangian<1> for Ceiling {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };

    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0] - (q[0] - CEILING).max(T::from(0.0)) * 100.0
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0] - CEILING);
    }
}

/// A kink of the Lagrangian that the motion crosses twice within a hundredth of a step: both crossings divide the step.
#[test]
fn a_kink_beyond_which_the_motion_is_for_a_short_time() {
    // It reaches the ceiling with this speed, and is above it for a hundredth of the time without the further force.
    let speed = f64::sqrt(2.0 * (0.5 - CEILING));
    let above = 2.0 * speed / 101.0;
    let after = 2.0 - (1.0 - speed) - above;
    let expected = CEILING - speed * after - 0.5 * after * after;
    let ceiling = SwitchingOne::from(Ceiling);
    for stages in [1, 2, 4, 8, 16] {
        let problem = Problem::new(&ceiling, 0.0, VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
        let run = problem.by(GaussCollocation { stages }).steps(Steps::Count(1));
        let outcome = run.run(Until::Time(2.0)).unwrap();
        assert!((outcome.q[0] - expected).abs() <= 1e-12, "{stages} stages: {}, not {expected}", outcome.q[0]);
    }
}
