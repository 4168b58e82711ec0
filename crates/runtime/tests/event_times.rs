//! Derivatives of the times of events, and fits to times of events, against differences of runs.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    AnyIntegrator, Crossing, Direction, Event, EventAt, Motion, MotionFit, RunMonitor, RuntimeError, Series,
    SignChanges, Start, StepControl, Steps, System, Unknown,
};
use std::ops::ControlFlow;

struct Keep(Vec<EventAt>);

impl RunMonitor for Keep {
    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.0.push(EventAt { event: crossing.event, t: crossing.t });
        ControlFlow::Continue(())
    }
}

pub(crate) fn crossings(system: &System, motion: &Motion) -> Vec<EventAt> {
    let mut kept = Keep(Vec::new());
    system.run(motion, &mut kept).unwrap();
    kept.0
}

/// A ball in drag over a floor that moves, with a reset, a plain event, and one whose function has a parameter.
struct Ball {
    formula: herglotz_runtime::Formula,
}

const PARAMETERS: [(&str, f64); 4] = [("e", 0.8), ("g", 2.0), ("gamma", -0.1), ("level", 0.3)];

impl Ball {
    fn new() -> Self {
        let formula = herglotz_runtime::Formula::parse("x'^2/2 - g*x + gamma*z", &["x"], &PARAMETERS).unwrap();
        let reset = formula_lagrangian::Reset {
            when: "x - sin(t)/10",
            direction: formula_lagrangian::Direction::Falling,
            then: &[("x'", "-e*x' + g/50")],
            rest: None,
        };
        Ball { formula: formula.with_reset(reset).unwrap() }
    }

    /// The system, and its motion from a start, with the values of the parameters.
    fn with(&self, values: [f64; 4], [x, v]: [f64; 2], end: f64) -> (System, Motion) {
        let mut formula = self.formula.clone();
        for ((name, _), value) in PARAMETERS.iter().zip(values) {
            formula.set(name, value).unwrap();
        }
        let event = |text: &str| Event::new(formula.expression(text).unwrap());
        let events = vec![
            Event { reset: Some(0), ..event("x - sin(t)/10") },
            event("x' + t/20 - level*x"),
            Event { direction: Direction::Falling, ..event("x - level") },
        ];
        let way = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 6 }, steps: Steps::Size(0.05) };
        let motion = Motion { events, ..Motion::new(Start::new(0.0, [x], [v], 0.0), end, way) };
        (System::new(&formula).unwrap(), motion)
    }
}

/// The times of all sign changes, in all parameters and in the start, forward and backward in time.
#[test]
fn times_of_events_against_differences() {
    let values = PARAMETERS.map(|(_, value)| value);
    for end in [5.0, -3.0] {
        let (ball, start) = (Ball::new(), [1.0, 0.4]);
        let (system, motion) = ball.with(values, start, end);
        let found = crossings(&system, &motion);
        assert!((0..3).all(|k| found.iter().any(|at| at.event == k)) || end < 0.0 && found.len() > 1, "{found:?}");
        let names = ["e", "g", "gamma", "level", "x", "x'"];
        let slopes = system.sensitivity_with_events(&motion, &names, &[end], &found, &mut ()).unwrap();
        assert_eq!((slopes.event_times.len(), slopes.rows.len()), (found.len(), 1));
        for (k, name) in names.iter().enumerate() {
            let times = |by: f64| {
                let (mut values, mut start) = (values, start);
                match k {
                    0..4 => values[k] += by,
                    _ => start[k - 4] += by,
                }
                let (system, motion) = ball.with(values, start, end);
                crossings(&system, &motion)
            };
            let d = 1e-5;
            for (i, (after, before)) in times(d).iter().zip(&times(-d)).enumerate() {
                let (expected, found) = ((after.t - before.t) / (2.0 * d), slopes.event_times[i][k]);
                // The differences have errors of d^2 and of the round-off of the times over d.
                assert!((found - expected).abs() <= 1e-8 * (1.0 + expected.abs()), "{name} {i}: {found}, {expected}");
            }
        }
    }
}

/// A motion that ends at an event: its end moves with it.
#[test]
fn an_end_at_an_event() {
    let values = PARAMETERS.map(|(_, value)| value);
    let ball = Ball::new();
    for accuracy in [false, true] {
        let run = |by: f64| {
            let mut values = values;
            values[1] += by;
            let (system, mut motion) = ball.with(values, [1.0, 0.3], 9.0);
            motion.events.truncate(2);
            motion.events[1] =
                Event { terminal: true, ..Event::new(system.formula().expression("x - level").unwrap()) };
            if accuracy {
                motion.step_control = StepControl::Accuracy { error: 1e-11, by: None };
            }
            (system, motion)
        };
        let (system, motion) = run(0.0);
        let found = crossings(&system, &motion);
        let [at] = found[..] else { panic!("{found:?}") };
        let slopes = system.sensitivity_with_events(&motion, &["g"], &[0.25, at.t], &[at], &mut ()).unwrap();
        assert_eq!(slopes.rows.len(), 2);
        let end = |by: f64| {
            let (system, motion) = run(by);
            system.run(&motion, &mut ()).unwrap()
        };
        let d = 1e-4;
        let (after, before) = (end(d), end(-d));
        let slope = |a: f64, b: f64| (a - b) / (2.0 * d);
        let row = &slopes.rows[1][0];
        let z = |of: &herglotz_runtime::Outcome| of.z.unwrap();
        let v = |of: &herglotz_runtime::Outcome| of.v.as_ref().unwrap()[0];
        let pairs = [
            (slopes.event_times[0][0], slope(after.t, before.t)),
            (row.q[0], 0.0),
            (row.v[0], slope(v(&after), v(&before))),
            (row.p[0], slope(after.p[0], before.p[0])),
            (row.z, slope(z(&after), z(&before))),
        ];
        for (found, expected) in pairs {
            assert!((found - expected).abs() <= 1e-7, "accuracy {accuracy}: {found} and {expected}");
        }
    }
}

/// The restitution, the field and the drag of a ball from the times of its bounces, of which one was not measured, with the
/// height at some times.
#[test]
fn a_fit_to_times_of_bounces() {
    let ball = Ball::new();
    let (system, motion) = ball.with([0.8, 2.0, -0.1, 0.3], [1.0, 0.3], 7.0);
    let times: Vec<f64> = crossings(&system, &motion).iter().filter(|at| at.event == 0).map(|at| at.t).collect();
    assert!(times.len() >= 5);
    let kept: Vec<usize> = (0..5).filter(|k| *k != 2).collect();
    let times: Vec<f64> = kept.iter().map(|k| times[*k]).collect();
    let bounces =
        Series { event: Some(SignChanges { event: 0, numbers: kept }), ..Series::of_event("bounce", 0, times.clone()) };
    let (guess, start) = ball.with([0.7, 2.2, -0.05, 0.3], [1.0, 0.3], 7.0);
    let request = MotionFit::new(start, ["e", "g", "gamma"].map(Unknown::free), [bounces]);
    let fitted = guess.fit(&request, &mut ()).unwrap();
    assert!(fitted.fit.status.is_converged(), "{}", fitted.fit);
    for (found, expected) in fitted.fit.parameters.iter().zip([0.8, 2.0, -0.1]) {
        assert!((found - expected).abs() <= 1e-7, "{found} and {expected}");
    }
    assert_eq!(fitted.series[0].values, times);
}

/// What cannot be differentiated, and what cannot be fitted, is refused with the reason.
#[test]
fn refusals() {
    let ball = Ball::new();
    let (system, motion) = ball.with(PARAMETERS.map(|(_, value)| value), [1.0, 0.0], 3.0);
    let of =
        |at: EventAt| system.sensitivity_with_events(&motion, &["e"], &[], &[at], &mut ()).unwrap_err().to_string();
    assert!(of(EventAt { event: 7, t: 1.0 }).contains("name the event 7; there are 3"));
    let no_reset = of(EventAt { event: 0, t: 0.5 });
    assert!(no_reset.contains("no occurrence of the reset of the event 0 at t = 0.5"), "{no_reset}");
    // x' + ... - level x is not zero there, but its rate is: refused only where the rate vanishes.
    let flat = System::parse("x'^2/2", &["x"], &[("c", 1.0)]).unwrap();
    let event = Event::new(flat.formula().expression("x - c").unwrap());
    let way = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 2 }, steps: Steps::Size(0.5) };
    let still = Motion { events: vec![event], ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 2.0, way) };
    let at = EventAt { event: 0, t: 1.0 };
    let grazing = flat.sensitivity_with_events(&still, &["c"], &[], &[at], &mut ()).unwrap_err();
    assert!(matches!(grazing, RuntimeError::Sensitivity(_)), "{grazing}");
    let fit = |series: Series, nodes: Vec<f64>| {
        let request = MotionFit { nodes, ..MotionFit::new(motion.clone(), [Unknown::free("e")], [series]) };
        system.fit(&request, &mut ()).unwrap_err().to_string()
    };
    let far = fit(Series::of_event("far", 9, [1.0, 2.0]), Vec::new());
    assert!(far.contains("the event 9, but the motion has 3"), "{far}");
    let many: Vec<f64> = (1..40).map(|k| f64::from(k) * 0.1).collect();
    let many = fit(Series::of_event("bounce", 0, many), Vec::new());
    assert!(many.contains("and the data have one with the number"), "{many}");
    let cut = fit(Series::of_event("bounce", 0, [1.0, 2.0]), vec![1.5]);
    assert!(cut.contains("fit them without nodes"), "{cut}");
}
