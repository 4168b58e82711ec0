//! What jumps, resets and events do to each other: against motions under piecewise constant forces, which are parabolas.

use super::{Seen, accurate};
use contact_geom::switching::Impact;
use discrete_herglotz::{AnyIntegrator, Status, StepError, Steps};
use formula_lagrangian::{Direction, Formula, Reset};
use herglotz_runtime::{Event, Interpolation, Motion, Start, StepControl, System, Table};

fn by_steps(stages: usize, h: f64) -> StepControl {
    StepControl::Steps { by: AnyIntegrator::Gauss { stages }, steps: Steps::Size(h) }
}

/// A force that is constant between times.
struct Held {
    times: Vec<f64>,
    values: Vec<f64>,
}

impl Held {
    /// `amplitude*sign(sin(25 t)) + offset`.
    fn square_wave(amplitude: f64, offset: f64) -> Held {
        let times = (0..26).map(|k| f64::from(k) * std::f64::consts::PI / 25.0).collect();
        let values = (0..26).map(|k| offset + if k % 2 == 0 { amplitude } else { -amplitude }).collect();
        Held { times, values }
    }

    /// Pseudo-random times and values, by a linear congruence.
    fn random(seed: u64, samples: usize, span: f64) -> Held {
        let mut state = seed;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mean = span / (samples - 1) as f64;
        let times = (0..samples)
            .map(|k| if k == 0 || k + 1 == samples { k as f64 * mean } else { (k as f64 - 0.3 * draw()) * mean })
            .collect();
        let values = (0..samples).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 } * (4.0 + 8.0 * draw())).collect();
        Held { times, values }
    }

    fn table(&self) -> Table {
        Table::new(&self.times, &self.values, Interpolation::Held).unwrap()
    }

    /// The zeros of the velocity, and the impacts on a floor at 0 if there is one, up to a time, with the position and the
    /// velocity there.
    fn motion(&self, [mut x, mut v]: [f64; 2], t_end: f64, elastic_floor: bool) -> (Vec<f64>, Vec<f64>, [f64; 2]) {
        let (mut turns, mut impacts) = (Vec::new(), Vec::new());
        for (k, a) in self.values.iter().enumerate() {
            let (mut t, until) = (self.times[k], self.times.get(k + 1).map_or(t_end, |next| next.min(t_end)));
            while t < until {
                let turn = t - v / a;
                // The first later time at which the parabola meets the floor from above.
                let (b, root) = (v / a, (v * v - 2.0 * a * x).sqrt() / a.abs());
                let falls = |dt: f64| dt > 1e-12 && v + a * dt < 0.0;
                let meets = [-b - root, -b + root].into_iter().filter(|dt| falls(*dt)).fold(f64::INFINITY, f64::min);
                let end = if elastic_floor { until.min(t + meets) } else { until };
                if turn > t && turn < end {
                    turns.push(turn);
                }
                let dt = end - t;
                (x, v) = (x + (v + 0.5 * a * dt) * dt, v + a * dt);
                if end < until {
                    impacts.push(end);
                    (x, v) = (0.0, -v);
                }
                t = end;
            }
        }
        (turns, impacts, [x, v])
    }
}

/// The times that were found are these, to a tolerance.
fn assert_times(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(found.len() == expected.len() && close, "{what}:\n{found:?}, not\n{expected:?}");
}

/// The events of each part of a step that is divided at jumps of the force: zeros of the velocity between them, of which
/// there is more than one in a step.
#[test]
fn events_between_the_jumps_within_a_step() {
    let wave = Held::square_wave(8.0, 0.0);
    let start = [0.0, -4.0 * std::f64::consts::PI / 25.0];
    let of_formula = Formula::parse("x'^2/2 + 8*sign(sin(25*t))*x", &["x"], &[]).unwrap();
    let mut cases = vec![("a square wave".to_owned(), of_formula, wave, start)];
    for seed in 1..=3 {
        let held = Held::random(seed, 31, 3.0);
        let formula = Formula::parse_with_tables("x'^2/2 + u(t)*x", &["x"], &[], &[("u", held.table())]).unwrap();
        cases.push((format!("held samples {seed}"), formula, held, [0.0, -0.3]));
    }
    let steps =
        [by_steps(8, 0.5), by_steps(4, 0.5), by_steps(4, 0.1), by_steps(1, 3.0), accurate(1e-9), accurate(1e-12)];
    for (what, formula, held, [x, v]) in &cases {
        let (turns, _, _) = held.motion([*x, *v], 3.0, false);
        let system = System::new(formula).unwrap();
        for by in steps {
            let event = Event::new(formula.expression("x'").unwrap());
            let motion = Motion { events: vec![event], ..Motion::new(Start::new(0.0, [*x], [*v], 0.0), 3.0, by) };
            let mut seen = Seen::default();
            let outcome = system.run(&motion, &mut seen).unwrap();
            let found: Vec<f64> = seen.crossings.iter().map(|crossing| crossing.t).collect();
            assert_eq!(outcome.status, Status::Completed);
            // Gauss collocation is exact between the jumps, and the velocities are of size 1.
            assert_times(&found, &turns, 1e-12, &format!("{what} by {by:?}"));
        }
        // A terminal event ends the run at the first of them.
        let event = Event { terminal: true, ..Event::new(formula.expression("x'").unwrap()) };
        let motion =
            Motion { events: vec![event], ..Motion::new(Start::new(0.0, [*x], [*v], 0.0), 3.0, accurate(1e-9)) };
        let outcome = system.run(&motion, &mut ()).unwrap();
        assert!((outcome.t - turns[0]).abs() <= 1e-12, "{what}: {} for {}", outcome.t, turns[0]);
    }
}

/// Impacts between the jumps of a force within one step.
#[test]
fn impacts_between_the_jumps_within_a_step() {
    let formula = |held: &Held| {
        let formula = Formula::parse_with_tables("x'^2/2 + u(t)*x", &["x"], &[], &[("u", held.table())]).unwrap();
        formula.with_impact("x", Impact::Elastic, None).unwrap()
    };
    let mut cases = Vec::new();
    for (x, v, offset) in [(0.02, -0.3, -3.0), (0.1, 0.0, -5.0), (0.3, -1.0, -1.0)] {
        let wave = Held::square_wave(8.0, offset);
        let text = format!("x'^2/2 + (8*sign(sin(25*t)) + {offset})*x");
        let by_formula = Formula::parse(&text, &["x"], &[]).unwrap().with_impact("x", Impact::Elastic, None).unwrap();
        cases.push((format!("a square wave {offset}"), by_formula, wave, [x, v]));
    }
    for seed in 1..=6 {
        let mut held = Held::random(seed, 31, 3.0);
        held.values.iter_mut().for_each(|value| *value -= 3.0);
        cases.push((format!("held samples {seed}"), formula(&held), held, [0.1, -0.3]));
    }
    let steps = [by_steps(8, 0.5), by_steps(4, 0.5), by_steps(4, 0.1), by_steps(1, 3.0), accurate(1e-9)];
    for (what, formula, held, [x, v]) in &cases {
        let (turns, impacts, end) = held.motion([*x, *v], 3.0, true);
        let system = System::new(formula).unwrap();
        for by in steps {
            let event = |reset| Event { reset, ..Event::new(formula.expression("x'").unwrap()) };
            let events = vec![event(None), event(Some(0))];
            let motion = Motion { events, ..Motion::new(Start::new(0.0, [*x], [*v], 0.0), 3.0, by) };
            let mut seen = Seen::default();
            let outcome = system.run(&motion, &mut seen).unwrap();
            let times = |event| seen.crossings.iter().filter(|c| c.event == event).map(|c| c.t).collect::<Vec<f64>>();
            let what = format!("{what} by {by:?}");
            assert_eq!(outcome.status, Status::Completed, "{what}");
            // The round-off grows at each impact, by the ratio of the forces at most.
            assert_times(&times(1), &impacts, 1e-9, &what);
            assert_times(&times(0), &turns, 1e-9, &what);
            assert!((outcome.q[0] - end[0]).abs() + (outcome.v.unwrap()[0] - end[1]).abs() <= 1e-8, "{what}");
        }
    }
}

/// The status and the end of a run, with the number of its resets: those of the first reset of the formula.
fn with_resets(formula: &Formula, start: Start, t_end: f64, by: StepControl) -> (herglotz_runtime::Outcome, usize) {
    let event = Event { reset: Some(0), ..Event::new(formula.expression("t").unwrap()) };
    let motion = Motion { events: vec![event], ..Motion::new(start, t_end, by) };
    let mut seen = Seen::default();
    let outcome = System::new(formula).unwrap().run(&motion, &mut seen).unwrap();
    (outcome, seen.crossings.len())
}

fn reset<'a>(when: &'a str, direction: Direction, then: &'a [(&'a str, &'a str)]) -> Reset<'a> {
    Reset { when, direction, then, rest: None }
}

/// A motion that starts on the surface of a reset, and goes beyond it, begins with the reset; one that leaves the surface
/// does not.
#[test]
fn a_reset_at_the_start_occurs() {
    let free = Formula::parse("x'^2/2", &["x"], &[]).unwrap();
    let bounce = free.with_impact("x", Impact::Elastic, None).unwrap();
    let backward = free.with_reset(reset("x", Direction::Rising, &[("x'", "-x'")])).unwrap();
    for by in [by_steps(2, 0.25), by_steps(8, 2.0), accurate(1e-9)] {
        let end = |formula: &Formula, v: f64, t_end: f64| {
            let (outcome, resets) = with_resets(formula, Start::new(0.0, [0.0], [v], 0.0), t_end, by);
            assert_eq!(outcome.status, Status::Completed);
            (outcome.q[0], resets)
        };
        assert_eq!(end(&bounce, -1.0, 2.0), (2.0, 1), "{by:?}");
        assert_eq!(end(&bounce, 1.0, 2.0), (2.0, 0), "{by:?}");
        // Rising in the direction of the run.
        assert_eq!(end(&backward, -1.0, -2.0), (-2.0, 1), "{by:?}");
        assert_eq!(end(&backward, 1.0, -2.0), (-2.0, 0), "{by:?}");
    }
    // Three balls that touch.
    let balls = Formula::parse("(x'^2 + y'^2 + u'^2)/2", &["x", "y", "u"], &[]).unwrap();
    let balls = balls.with_impact("y - x - 1", Impact::Elastic, None).unwrap();
    let balls = balls.with_impact("u - y - 1", Impact::Elastic, None).unwrap();
    for (v, after) in [
        ([3.0, 1.0, -1.0], [-1.0, 2.0, 5.0]),
        ([1.0, 0.0, 0.0], [0.0, 1.0, 3.0]),
        ([0.0, 0.0, -1.0], [-1.0, 1.0, 2.0]),
        ([0.3, 0.0, 0.0], [0.0, 1.0, 2.3]),
        ([0.7, 0.7, 0.7], [0.7, 1.7, 2.7]),
    ] {
        for by in [by_steps(2, 0.25), by_steps(4, 1.0), accurate(1e-9)] {
            let (outcome, _) = with_resets(&balls, Start::new(0.0, [0.0, 1.0, 2.0], v, 0.0), 1.0, by);
            assert_eq!(outcome.status, Status::Completed, "{v:?} by {by:?}");
            let off: f64 = outcome.q.iter().zip(after).map(|(a, b)| (a - b).abs()).sum();
            assert!(off <= 1e-14, "{v:?} by {by:?}: {:?} for {after:?}", outcome.q);
        }
    }
}

/// A reset where one run ends and another one continues it occurs in exactly one of them, whether it turns the motion
/// round or leaves it as it is.
#[test]
fn a_reset_between_two_runs_occurs_once() {
    let free = Formula::parse("x'^2/2", &["x"], &[]).unwrap();
    let kick = free.with_reset(reset("x", Direction::Falling, &[("z", "z + 1")])).unwrap();
    let bounce = free.with_impact("x", Impact::Elastic, None).unwrap();
    let timed = free.with_reset(reset("sin(t)", Direction::Rising, &[("x'", "x' + 1")])).unwrap();
    for case in 1..40 {
        let (v, t0) = (-0.1 * f64::from(case), 0.37 * f64::from(case % 3));
        for steps in 1..8 {
            let by = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 2 }, steps: Steps::Count(steps) };
            for (formula, sign) in [(&bounce, -1.0), (&kick, 1.0)] {
                // It arrives at the end of the first run, up to round-off.
                let (first, before) = with_resets(formula, Start::new(t0, [-v * 0.7], [v], 0.0), t0 + 0.7, by);
                let next = Start::new(first.t, [first.q[0]], [first.v.unwrap()[0]], first.z.unwrap());
                let (second, after) = with_resets(formula, next, t0 + 1.4, by);
                assert_eq!((first.status, second.status), (Status::Completed, Status::Completed));
                let what = format!("v = {v}, {steps} steps");
                assert_eq!(before + after, 1, "{what}");
                assert!((second.q[0] - 0.7 * sign * v).abs() <= 1e-14, "{what}: {}", second.q[0]);
            }
        }
    }
    let two_pi = 2.0 * std::f64::consts::PI;
    for count in [4, 5, 8] {
        let by = |periods: usize| StepControl::Steps {
            by: AnyIntegrator::Gauss { stages: 2 },
            steps: Steps::Count(count * periods),
        };
        let (whole, kicks) = with_resets(&timed, Start::new(0.0, [0.0], [0.0], 0.0), 3.0 * two_pi, by(3));
        let (mut sum, mut at) = (0, Start::new(0.0, [0.0], [0.0], 0.0));
        for period in 1..=3 {
            let (end, kicks) = with_resets(&timed, at, f64::from(period) * two_pi, by(1));
            (sum, at) = (sum + kicks, Start::new(end.t, [end.q[0]], [end.v.unwrap()[0]], end.z.unwrap()));
        }
        // At 0, 2 pi and 4 pi; that at 6 pi is left to the next run.
        assert_eq!((kicks, sum), (3, 3), "{count}");
        assert!((whole.q[0] - 6.0 * two_pi).abs() <= 1e-12, "{}", whole.q[0]);
    }
}

/// A motion that starts before the surface of a reset, however closely, has the reset: the run that ended there has not
/// made it. So has one beyond it by a rounding, which goes on as if it had not been turned back.
#[test]
fn a_reset_just_after_the_start_occurs() {
    let wall = 0.43871965452303385;
    let free = Formula::parse("x'^2/2", &["x"], &[("a", wall)]).unwrap();
    let bounce = free.with_impact("x - a", Impact::Elastic, None).unwrap();
    // Without the wall, the motion would return within the first step.
    let pushed = Formula::parse("x'^2/2 + x", &["x"], &[("a", wall)]).unwrap();
    let pushed = pushed.with_impact("x - a", Impact::Elastic, None).unwrap();
    let near = |ulps: i64| f64::from_bits(f64::to_bits(wall).checked_add_signed(ulps).unwrap());
    for ulps in (-80..80).chain([100, 150, 1000, 100_000]) {
        let x = near(ulps);
        let start = || Start::new(0.33, [x], [-1.4587765806592556], 0.0);
        // Beyond the wall, what is a rounding is so for the length of a step.
        let short = (ulps > -16).then(|| by_steps(2, 0.01));
        for by in [by_steps(4, 0.5), by_steps(8, 3.0), accurate(1e-9)].into_iter().chain(short) {
            let (outcome, resets) = with_resets(&bounce, start(), 3.33, by);
            let bounced = 2.0 * wall - x + 3.0 * 1.4587765806592556;
            // The round-off of 300 steps.
            assert!(resets == 1 && (outcome.q[0] - bounced).abs() <= 1e-12, "{ulps} ulps by {by:?}: {outcome:?}");
        }
        // At the wall, or beyond it by no more than the round-off of x.
        if !(-28..=0).contains(&ulps) {
            continue;
        }
        let start = Start::new(0.33, [x], [-0.3], 0.0);
        let (outcome, resets) = with_resets(&pushed, start, 3.33, by_steps(8, 1.0));
        let bounced = 2.0 * wall - x + 3.0 * 0.3 + 4.5;
        assert!(resets == 1 && (outcome.q[0] - bounced).abs() <= 1e-12, "{ulps} ulps, pushed: {outcome:?}");
    }
}

/// A body that comes to rest on the surface of a reset, and is pressed onto it, does not pass through: the run ends there
/// with a status that says so.
#[test]
fn a_body_at_rest_does_not_fall_through_its_floor() {
    let ball = Formula::parse("x'^2/2 - x", &["x"], &[]).unwrap();
    let still: &[(&str, &str)] = &[("x", "0"), ("x'", "0")];
    let stopped: &[(&str, &str)] = &[("x'", "0")];
    let bounce = Reset { rest: Some(stopped), ..reset("x", Direction::Falling, &[("x'", "-0.5*x'")]) };
    let floor = "x - 0.05*sin(20*t)";
    let on_moving = Formula::parse("x'^2/2 - 9.81*x", &["x"], &[]).unwrap();
    // A ball from the height 1 comes to rest at 3 sqrt(2); on the moving floor it meets the floor with restitution 0 where
    // the floor falls more slowly.
    let limit = 3.0 * f64::sqrt(2.0);
    let cases = [
        ("rest", ball.with_reset(bounce).unwrap(), 1.0, Some(limit)),
        ("rest of an impact", ball.with_impact("x", Impact::Restitution(0.5), Some(still)).unwrap(), 1.0, Some(limit)),
        ("no restitution", ball.with_impact("x", Impact::Restitution(0.0), None).unwrap(), 1.0, Some(f64::sqrt(2.0))),
        ("a start at rest", ball.with_impact("x", Impact::Elastic, None).unwrap(), 0.0, Some(0.0)),
        ("a moving floor", on_moving.with_impact(floor, Impact::Restitution(0.0), None).unwrap(), 0.09, None),
    ];
    for (what, formula, x, time) in cases {
        let start = || Start::new(0.0, [x], [0.0], 0.0);
        for by in [by_steps(2, 0.01), by_steps(4, 0.1), by_steps(8, 1.0), by_steps(6, 6.0)] {
            let (outcome, _) = with_resets(&formula, start(), 6.0, by);
            let Status::Failed { cause: StepError::Contact { t }, .. } = outcome.status else {
                panic!("{what} by {by:?}: {}, x = {:?}", outcome.status, outcome.q)
            };
            assert!(time.is_none_or(|time| (t - time).abs() <= 1e-9), "{what} by {by:?}: {t}");
            assert!(outcome.q[0] >= -0.06 && t < 4.3, "{what} by {by:?}: {t}, {:?}", outcome.q);
        }
        let system = System::new(&formula).unwrap();
        let refused = system.run(&Motion::new(start(), 6.0, accurate(1e-6)), &mut ()).err().unwrap().to_string();
        assert!(refused.contains("is pressed onto it"), "{what}: {refused}");
    }
}

/// The same by short steps, within a part of which a body at rest moves by less than the round-off of its position.
#[test]
fn a_body_at_rest_does_not_fall_through_its_floor_in_short_steps() {
    let ball = Formula::parse("x'^2/2 - x", &["x"], &[]).unwrap();
    let formula = ball.with_impact("x - 4.5", Impact::Restitution(0.0), None).unwrap();
    for h in [1e-2, 3e-3, 1e-3, 3e-4] {
        let (outcome, _) = with_resets(&formula, Start::new(0.0, [4.6], [0.0], 0.0), 1.0, by_steps(2, h));
        let contact = matches!(outcome.status, Status::Failed { cause: StepError::Contact { .. }, .. });
        assert!(contact && outcome.q[0] >= 4.5, "{h}: {}, {:?}", outcome.status, outcome.q);
    }
}

/// The function of a reset that is not defined beyond its zero is an error, as that of any event.
#[test]
fn a_reset_that_is_undefined_beyond_its_zero_is_an_error() {
    let free = Formula::parse("x'^2/2", &["x"], &[]).unwrap();
    for formula in [
        free.with_reset(reset("sqrt(x)", Direction::Falling, &[("x'", "-x'")])).unwrap(),
        free.with_impact("sqrt(x)", Impact::Elastic, None).unwrap(),
        free.with_reset(reset("sqrt(x) + 1", Direction::Falling, &[("x'", "-x'")])).unwrap(),
    ] {
        for by in [by_steps(2, 0.01), by_steps(4, 0.3), by_steps(8, 2.0)] {
            let (outcome, _) = with_resets(&formula, Start::new(0.0, [1.0], [-1.0], 0.0), 2.0, by);
            let Status::Failed { cause: StepError::Event { t }, .. } = outcome.status else {
                panic!("{by:?}: {}, x = {:?}", outcome.status, outcome.q)
            };
            assert!((t - 1.0).abs() <= 1e-12, "{by:?}: {t}");
        }
        let motion = Motion::new(Start::new(0.0, [1.0], [-1.0], 0.0), 2.0, accurate(1e-9));
        let refused = System::new(&formula).unwrap().run(&motion, &mut ()).err().unwrap().to_string();
        assert!(refused.contains("not finite at t = "), "{refused}");
    }
}

/// Steps with impacts that change the energy are not taken for unresolved ones: on a surface that moves, elastic, and
/// with a conformal factor.
#[test]
fn impacts_that_change_the_energy_are_resolved() {
    let ball = Formula::parse("x'^2/2 - x - 0.1*z", &["x"], &[]).unwrap();
    for (surface, law) in [
        ("x - 0.1*cos(2*t)", Impact::Elastic),
        ("x - 0.1*cos(2*t)", Impact::Conformal(0.8)),
        ("x", Impact::Conformal(0.8)),
        ("x", Impact::Elastic),
    ] {
        let system = System::new(&ball.with_impact(surface, law, None).unwrap()).unwrap();
        let run = |step_control| {
            let motion = Motion::new(Start::new(0.0, [1.0], [0.3], 0.0), 4.0, step_control);
            system.run(&motion, &mut ()).unwrap()
        };
        let (found, expected) = (run(by_steps(4, 0.05)), run(accurate(1e-11)));
        assert_eq!((found.status, found.unresolved), (Status::Completed, None), "{surface}, {law:?}");
        assert!((found.q[0] - expected.q[0]).abs() < 1e-9, "{surface}, {law:?}: {} {}", found.q[0], expected.q[0]);
    }
}
