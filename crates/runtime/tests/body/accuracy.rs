//! The accuracy of motions of rigid bodies: pulses of a torque, the budget of trial runs, and interruption.

use super::{free, motion};
use herglotz_runtime::{Body, BodyMotion, BodyTorque, GroupStatus, InputError, Interrupt, RuntimeError, StepControl};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

pub fn accurate(omega: [f64; 3], end: f64, error: f64) -> BodyMotion {
    BodyMotion::new([1.0, 0.0, 0.0, 0.0], omega, end, StepControl::Accuracy { error, by: None })
}

fn with_torque(first: &str) -> Body {
    let torque = Some(BodyTorque::parse([first, "0", "0"]).unwrap());
    Body { inertia: Body::principal([1.0, 2.0, 3.0]), torque, ..Body::default() }
}

/// An interrupt that is never wanted, and counts how often it is asked.
fn counting() -> (Interrupt, Arc<AtomicUsize>) {
    let count = Arc::new(AtomicUsize::new(0));
    let counter = count.clone();
    let ask = move || {
        counter.fetch_add(1, Ordering::Relaxed);
        false
    };
    (Interrupt::when(ask), count)
}

/// A pulse of a torque has its impulse, however short it is: steps end at its times.
#[test]
fn a_pulse_of_a_torque_is_met() {
    for width in [0.001_f64, 0.005, 0.1] {
        let (from, to) = (0.37, 0.37 + width);
        let body = with_torque(&format!("if(t > {from}, if(t < {to}, {}, 0), 0)", 1.0 / width));
        // The body turns about its first axis by the integral of the angular velocity.
        let turn = 0.5 * width + (1.0 - to);
        let by_steps = BodyMotion { omega: [0.0; 3], end: 1.0, ..motion("gauss_4", 7) };
        for request in [accurate([0.0; 3], 1.0, 1e-4), accurate([0.0; 3], 1.0, 1e-10), by_steps] {
            let found = body.run(&request, &mut ()).unwrap();
            let off = [found.omega[0] - 1.0, found.attitude[1] - (0.5 * turn).sin()];
            // The pulse begins and ends at numbers that are rounded once.
            assert!(off.iter().all(|off| off.abs() < 1e-12), "{width}: {off:?} with {} steps", found.steps);
            assert!(found.steps <= 64, "{} steps", found.steps);
            // Backward in time, from the end.
            let (attitude, omega) = (found.attitude, found.omega);
            let back = body.run(&BodyMotion { t: 1.0, end: 0.0, attitude, omega, ..request }, &mut ()).unwrap();
            assert!(back.omega[0].abs() < 1e-12, "{width}: {:?}", back.omega);
        }
    }
}

/// Derivatives are those of the steps that end there.
#[test]
fn derivatives_over_a_pulse() {
    let body = with_torque("if(t > 0.37, if(t < 0.38, 40 + omega2, 0), 0)");
    let request = BodyMotion { omega: [0.1, 0.4, -0.3], end: 1.0, ..motion("gauss_4", 7) };
    let found = body.derivatives(&request).unwrap();
    let momentum = |by: f64| {
        let moved = BodyMotion { omega: [0.1, 0.4 + by, -0.3], ..request.clone() };
        body.run(&moved, &mut ()).unwrap().momentum
    };
    let [after, before] = [1e-4, -1e-4].map(momentum);
    for i in 0..3 {
        let difference = (after[i] - before[i]) / 2e-4;
        // The third derivative times 1e-8 / 6.
        assert!((found.in_start[(3 + i, 4)] - difference).abs() < 1e-6, "{i}: {difference}");
    }
}

/// A motion whose trial runs do not agree is refused after some seconds, not after minutes.
#[test]
fn the_trial_runs_have_a_budget() {
    // Near the separatrix of the middle axis; and an angular velocity that becomes infinite.
    let tumbling = Body { inertia: Body::principal([3.0, 5.0, 7.0]), ..Body::default() };
    let cases = [
        (tumbling, accurate([1e-9, 1.0, 1e-9], 400.0, 1e-9), "accuracy"),
        (with_torque("omega1^2"), accurate([1.0, 0.0, 0.0], 2.0, 1e-9), "step"),
    ];
    for (body, request, argument) in cases {
        let (interrupt, asked) = counting();
        let refused = body.run(&BodyMotion { interrupt: Some(interrupt), ..request }, &mut ());
        let Err(RuntimeError::Argument { .. }) = &refused else { panic!("{refused:?}") };
        let said = refused.unwrap_err().to_string();
        assert!(said.contains(argument), "{said}");
        // It is asked every 64 steps.
        let steps = 64 * asked.load(Ordering::Relaxed);
        assert!(steps <= 1 << 20, "{steps} steps: {said}");
    }
}

/// Trial runs, the search of a motion between two attitudes, and derivatives end where an interrupt is requested.
#[test]
fn an_interrupt_is_heard() {
    let wanted = || Some(Interrupt::when(|| true));
    let long = BodyMotion { interrupt: wanted(), ..accurate([1.0, 0.5, 0.3], 1e5, 1e-9) };
    let outcome = free().run(&long, &mut ()).unwrap();
    assert_eq!((outcome.status, outcome.steps), (GroupStatus::Stopped { t: 0.0 }, 0));
    let interrupted = |error: RuntimeError| matches!(error, RuntimeError::Input(InputError::Interrupted));
    assert!(interrupted(free().plan(&long).unwrap_err()));
    let many = BodyMotion { interrupt: wanted(), ..motion("gauss_4", 100_000) };
    assert!(interrupted(free().derivatives(&many).unwrap_err()));
    assert!(interrupted(free().between(&many, [0.6, 0.0, 0.8, 0.0]).unwrap_err()));
}
