//! Motions of rigid bodies that are interrupted, saved and resumed.

use super::{free, motion};
use herglotz_runtime::{
    Body, BodyEvent, BodyMotion, BodyOutcome, BodyResumeState, Crossing, GroupStatus, InputError, OutputTimes,
    RunMonitor, RuntimeError,
};
use std::ops::ControlFlow;

/// Steps of 1/64, so that the steps at which the monitor is polled end at whole times.
const STEPS: usize = 640;

/// Records a run; saves it at each poll, or ends it at a part of the run.
#[derive(Default)]
struct Monitor {
    rows: Vec<Vec<f64>>,
    crossings: Vec<Crossing>,
    saves: bool,
    ends_at: Option<f64>,
    /// The states with the numbers of rows and sign changes before them.
    saved: Vec<(BodyResumeState, usize, usize)>,
}

impl Monitor {
    fn keep(&mut self, at: BodyResumeState) {
        // The state passes through its encoding.
        let at = BodyResumeState::from_bytes(&at.to_bytes()).unwrap();
        self.saved.push((at, self.rows.len(), self.crossings.len()));
    }
}

impl RunMonitor for Monitor {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.rows.push(numbers.to_vec());
        ControlFlow::Continue(())
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.crossings.push(crossing.clone());
        ControlFlow::Continue(())
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        if self.ends_at.is_some_and(|at| part >= at) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn wants_checkpoint(&mut self) -> bool {
        self.saves
    }

    fn body_interrupted(&mut self, at: BodyResumeState) {
        self.keep(at);
    }

    fn body_checkpoint(&mut self, taken: usize, at: BodyResumeState) -> ControlFlow<()> {
        assert_eq!(taken, at.taken());
        self.keep(at);
        ControlFlow::Continue(())
    }
}

/// A top with drag, whose figure axis is not symmetric.
fn top() -> Body {
    Body {
        inertia: Body::principal([1.0, 0.8, 0.5]),
        mass: 1.0,
        centre: [0.0, 0.0, 0.5],
        gravity: [0.0, 0.0, -1.0],
        gamma: -0.1,
        torque: None,
    }
}

/// Sign changes within steps; one at the end of a step at which the monitor is polled, and one just after such a step.
fn events() -> Vec<BodyEvent> {
    let functions = ["omega3", "Pi2 - 0.1", "t - 5", "t - 3.00000000000001"];
    functions.iter().map(|function| BodyEvent::parse(function).unwrap()).collect()
}

fn run(request: &BodyMotion, from: Option<BodyResumeState>, monitor: &mut Monitor) -> BodyOutcome {
    match from {
        Some(from) => top().resume(request, from, monitor).unwrap(),
        None => top().run(request, monitor).unwrap(),
    }
}

/// A run that is saved at each poll, and the rest of it from each of these states, are the run without interruption to
/// the last bit: for rows at steps and at times, forward and backward in time.
#[test]
fn resumed_motions_are_those_that_were_not_interrupted() {
    let times: Vec<f64> = (0..=300).map(|k| f64::from(k) / 30.0).collect();
    let backward: Vec<f64> = times.iter().rev().copied().collect();
    let at = |times: &[f64]| Some(OutputTimes::At(times.to_vec()));
    let every = |steps| Some(OutputTimes::Every(steps));
    for (name, rows) in [
        ("gauss_3", every(7)),
        ("strang", None),
        ("strang", every(7)),
        ("strang", every(64)),
        ("strang", every(100_000)),
        ("strang", at(&times)),
        ("strang", at(&[0.0, 2.0, 10.0])),
        ("strang", at(&backward)),
    ] {
        let is_backward = rows == at(&backward);
        let (t, end) = if is_backward { (10.0, 0.0) } else { (0.0, 10.0) };
        let request = BodyMotion { t, end, rows: rows.clone(), events: events(), ..motion(name, STEPS) };
        let mut whole = Monitor::default();
        let outcome = run(&request, None, &mut whole);
        assert_eq!((outcome.status, outcome.steps), (GroupStatus::Completed, STEPS));
        // Both events of time are found once, and the others as well.
        for event in 0..4 {
            let count = whole.crossings.iter().filter(|crossing| crossing.event == event).count();
            assert!(if event < 2 { count > 0 } else { count == 1 }, "{name}, {rows:?}: {count} of event {event}");
        }
        let mut saving = Monitor { saves: true, ..Monitor::default() };
        assert_eq!(run(&request, None, &mut saving), outcome, "{name}, {rows:?}");
        assert_eq!((&saving.rows, &saving.crossings), (&whole.rows, &whole.crossings), "{name}, {rows:?}");
        assert_eq!(saving.saved.len(), STEPS / 64 - 1, "{name}, {rows:?}");
        for (state, row, crossing) in saving.saved {
            let mut rest = Monitor::default();
            let taken = state.taken();
            assert_eq!(run(&request, Some(state), &mut rest), outcome, "{name}, {rows:?} from {taken}");
            assert_eq!(rest.rows, whole.rows[row..], "{name}, {rows:?} from {taken}");
            assert_eq!(rest.crossings, whole.crossings[crossing..], "{name}, {rows:?} from {taken}");
        }
        // Ended twice, by a monitor.
        let mut ended = Monitor { ends_at: Some(0.25), ..Monitor::default() };
        let status = run(&request, None, &mut ended).status;
        assert!(matches!(status, GroupStatus::Stopped { .. }), "{status}");
        let (first, ..) = ended.saved.pop().unwrap();
        let mut second = Monitor { ends_at: Some(0.75), ..Monitor::default() };
        run(&request, Some(first), &mut second);
        let (last, ..) = second.saved.pop().unwrap();
        let mut rest = Monitor::default();
        assert_eq!(run(&request, Some(last), &mut rest), outcome, "{name}, {rows:?}");
        assert_eq!([ended.rows, second.rows, rest.rows].concat(), whole.rows, "{name}, {rows:?}");
        assert_eq!([ended.crossings, second.crossings, rest.crossings].concat(), whole.crossings, "{name}, {rows:?}");
    }
}

/// A run is saved at a later step where the function of an event is nearly zero: the sign change just after t = 3.
#[test]
fn a_run_is_saved_away_from_sign_changes() {
    let request = BodyMotion { events: events(), ..motion("strang", STEPS) };
    let mut saving = Monitor { saves: true, ..Monitor::default() };
    run(&request, None, &mut saving);
    let taken: Vec<usize> = saving.saved.iter().map(|(state, ..)| state.taken()).collect();
    assert_eq!(taken, [64, 128, 193, 256, 321, 384, 448, 512, 576]);
}

/// States of other runs and damaged ones are refused.
#[test]
fn other_states_are_refused() {
    let request = motion("strang", STEPS);
    let mut half = Monitor { ends_at: Some(0.5), ..Monitor::default() };
    free().run(&request, &mut half).unwrap();
    let (state, ..) = half.saved.pop().unwrap();
    let another = |body: Body, motion: BodyMotion| {
        let error = body.resume(&motion, state.clone(), &mut ()).unwrap_err();
        assert!(matches!(error, RuntimeError::Input(InputError::AnotherRun)), "{error}");
    };
    another(Body { gamma: -0.2, ..free() }, request.clone());
    another(free(), motion("strang", STEPS + 1));
    another(free(), motion("gauss_2", STEPS));
    another(free(), BodyMotion { z: 1.0, ..request.clone() });
    another(free(), BodyMotion { rows: Some(OutputTimes::Every(1)), ..request.clone() });
    let mut bytes = state.to_bytes();
    bytes[40] ^= 1;
    let refused = |bytes: &[u8]| BodyResumeState::from_bytes(bytes).unwrap_err().to_string();
    assert!(refused(&bytes).contains("damaged"));
    assert!(refused(&bytes[..100]).contains("damaged"));
    assert!(refused(b"something else altogether").contains("not a checkpoint"));
}
