//! Rigid bodies: a closed form, rows at all steps, events by formula, and invalid input.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

#[path = "body/accuracy.rs"]
mod accuracy;
#[path = "body/closed_form.rs"]
mod closed_form;
#[path = "body/ensembles.rs"]
mod ensembles;
#[path = "body/plans.rs"]
mod plans;
#[path = "body/resume.rs"]
mod resume;
#[path = "body/separatrix.rs"]
mod separatrix;

use herglotz_runtime::{
    Body, BodyEvent, BodyMotion, Crossing, Direction, GroupStatus, OutputTimes, RunMonitor, RuntimeError, StepControl,
    Steps,
};
use std::ops::ControlFlow;

fn free() -> Body {
    Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() }
}

fn motion(name: &str, steps: usize) -> BodyMotion {
    let step_control = StepControl::Steps { by: name.parse().unwrap(), steps: Steps::Count(steps) };
    BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 1.0 / 3.0], 10.0, step_control)
}

/// The damped free body of the closed form, by both kinds of integrators: a method of order 16 with 40 steps, and one of
/// order 10 with 400.
#[test]
fn a_damped_free_body() {
    for (name, steps) in [("gauss_8", 40), ("sofroniou_spaletta_10", 400)] {
        let request = BodyMotion { rows: Some(OutputTimes::Every(10)), ..motion(name, steps) };
        let (outcome, rows) = free().record(&request).unwrap();
        assert_eq!((outcome.status, outcome.steps, rows.len()), (GroupStatus::Completed, steps, steps / 10 + 1));
        let exact = [0.3288170813719329, -0.49415961406739636, -0.23171416126910247];
        for (x, exact) in outcome.momentum.iter().zip(exact) {
            assert!((x - exact).abs() < 1e-13, "{name}: {:?}", outcome.momentum);
        }
        assert_eq!(rows.last().unwrap().as_slice(), outcome.row());
        for row in &rows {
            // The momentum in space is (1, 1, 1) at the start.
            let factor = (-0.1 * row[0]).exp();
            assert!(row[11..14].iter().all(|m| (m - factor).abs() < 1e-14), "{name}: {row:?}");
        }
    }
}

struct Crossings(Vec<Crossing>);

impl RunMonitor for Crossings {
    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.0.push(crossing.clone());
        ControlFlow::Continue(())
    }
}

/// Events are formulas of the columns; a terminal one ends the motion there, also backward in time.
#[test]
fn events_by_formula() {
    let mut event = BodyEvent::parse("omega2*cos(0) - Pi1/10 + 0*z + 0*t").unwrap();
    (event.direction, event.terminal) = (Direction::Falling, true);
    let request = BodyMotion { events: vec![event.clone()], ..motion("gauss_6", 100) };
    let mut kept = Crossings(Vec::new());
    let outcome = free().run(&request, &mut kept).unwrap();
    assert!(matches!(outcome.status, GroupStatus::Event { event: 0, t } if t == kept.0[0].t && t < 10.0));
    assert!((outcome.omega[1] - 0.1 * outcome.momentum[0]).abs() < 1e-14 && kept.0.len() == 1);
    let back = BodyMotion { t: 10.0, end: 0.0, ..request };
    assert!(free().run(&back, &mut ()).unwrap().t >= 0.0);
}

/// Invalid input is refused by name.
#[test]
fn invalid_bodies() {
    let good = motion("gauss_4", 100);
    let refused = |body: Body, motion: BodyMotion, expected: &str| {
        let error = body.run(&motion, &mut ()).unwrap_err();
        let named = matches!(error, RuntimeError::Argument { .. } | RuntimeError::NotFinite { .. });
        assert!(named && error.to_string().contains(expected), "{error} for {expected}");
    };
    refused(Body { inertia: Body::principal([1.0, 1.0, 2.5]), ..free() }, good.clone(), "triangle inequality");
    refused(Body { inertia: [[1.0, 0.2, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]], ..free() }, good.clone(), "symmetric");
    refused(Body { centre: [0.0, 0.0, 1.0], ..free() }, good.clone(), "`mass`");
    refused(Body { gravity: [0.0, 0.0, -1.0], ..free() }, good.clone(), "`gravity`");
    refused(Body { gamma: f64::NAN, ..free() }, good.clone(), "`gamma`");
    refused(free(), BodyMotion { attitude: [1.0, 0.2, 0.0, 0.0], ..good.clone() }, "`attitude` is refused: the quat");
    refused(free(), BodyMotion { omega: [f64::INFINITY, 0.0, 0.0], ..good.clone() }, "`omega[0]` is inf");
    refused(free(), BodyMotion { omega: [100.0, 0.0, 0.0], ..good.clone() }, "at most 3.14");
    refused(free(), BodyMotion { end: 0.0, ..good.clone() }, "`t` ends at 0");
    refused(free(), motion("midpoint", 10), "`integrator` is \"midpoint\"");
    refused(free(), motion("blanes_moan_6", 10), "all different");
    let accuracy = StepControl::Accuracy { error: 1e-25, by: None };
    refused(free(), BodyMotion { step_control: accuracy, ..good }, "`accuracy` is refused");
    for function in ["energy", "omega1'", "p_Pi1", "sigma", "Pi4"] {
        assert!(BodyEvent::parse(function).is_err(), "{function}");
    }
}
