//! Motions by accuracy of which two trial runs may agree although both are wrong.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    Formula, FormulaNames, InitialVelocity, Interrupt, Motion, Outcome, OutputTimes, Start, Status, StepControl, Steps,
    System,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn accurate(error: f64) -> StepControl {
    StepControl::Accuracy { error, by: None }
}

fn run(system: &System, start: ([f64; 2], [f64; 2]), t_end: f64, control: StepControl) -> Outcome {
    let outcome = system.run(&Motion::new(Start::new(0.0, start.0, start.1, 0.0), t_end, control), &mut ()).unwrap();
    assert_eq!(outcome.status, Status::Completed);
    outcome
}

/// The distance of (q, p) at the ends of two motions, relative to the size of the second.
fn distance(of: &Outcome, from: &Outcome) -> f64 {
    let pairs = of.q.iter().chain(&of.p).zip(from.q.iter().chain(&from.p));
    let [apart, size] = pairs.fold([0.0; 2], |[apart, size], (a, b)| [apart + (a - b).powi(2), size + b * b]);
    (apart / size).sqrt()
}

/// A motion in a plane along a line through the tip of a norm is that of `abs` along the line, whose kinks are known.
#[test]
fn a_motion_through_the_tip_of_a_norm() {
    // A well with a cone, and a spring that is pushed through its anchor.
    for (of_distance, q, v) in [("-1/(r + 1)", 1.0, 0.0), ("(r - 1)^2/2", 1.6, -1.6)] {
        let line = System::parse(&format!("x'^2/2 - ({})", of_distance.replace('r', "abs(x)")), &["x"], &[]).unwrap();
        let motion = Motion::new(Start::new(0.0, [q], [v], 0.0), 10.0, accurate(1e-12));
        let exact = line.run(&motion, &mut ()).unwrap().q[0];
        for norm in ["hypot(x, y)", "sqrt(x^2 + y^2)"] {
            let l = format!("(x'^2 + y'^2)/2 - ({})", of_distance.replace('r', norm));
            let system = System::parse(&l, &["x", "y"], &[]).unwrap();
            for [c, s] in [[1.0, 0.0], [0.6, 0.8]] {
                let end = run(&system, ([c * q, s * q], [c * v, s * v]), 10.0, accurate(1e-6));
                let apart = (end.q[0] - c * exact).hypot(end.q[1] - s * exact);
                // The accuracy is relative to the size of (q, p), which is about one.
                assert!(apart <= 2e-6, "{l}, {c}: {apart:e}");
            }
        }
    }
}

/// `x = 1 - t - t^2/2` until it vanishes at `t = sqrt(3) - 1`, with the opposite force beyond.
#[test]
fn divided_steps_see_a_kink_beyond_their_outermost_samples() {
    let system = System::parse("(x'^2 + y'^2)/2 - hypot(x, y)", &["x", "y"], &[]).unwrap();
    for max_defect in [1e-4, 1e-6, 1e-8, 1e-10] {
        let by = format!("divided_gauss_8_{max_defect:e}").parse().unwrap();
        for steps in 4..12 {
            let control = StepControl::Steps { by, steps: Steps::Count(steps) };
            let end = run(&system, ([1.0, 0.0], [-1.0, 0.0]), 2.0, control);
            // A part that contains the kink has an error of the size of its defect.
            let error = (end.v.as_ref().unwrap()[0] - (3.0 - 2.0 * f64::sqrt(3.0))).abs();
            assert!(error <= 4.0 * max_defect, "{steps} steps, {max_defect:e}: {error:e}");
        }
    }
}

/// Equal steps that pass a tip beside their nodes converge like the step: they are divided there after some hundred, not after
/// millions.
#[test]
fn a_motion_through_a_tip_is_planned_soon() {
    let system = System::parse("(x'^2 + y'^2)/2 + 1/(hypot(x, y) + 1)", &["x", "y"], &[]).unwrap();
    let asked = Arc::new(AtomicUsize::new(0));
    let counter = asked.clone();
    let interrupt = Interrupt::when(move || {
        counter.fetch_add(1, Ordering::Relaxed);
        false
    });
    let motion = Motion::new(Start::new(0.0, [1.0, 0.0], [0.0, 0.0], 0.0), 10.0, accurate(1e-9));
    let plan = system.plan(&Motion { interrupt: Some(interrupt), ..motion }).unwrap();
    assert!(plan.integrator.name.starts_with("divided_gauss"), "{}", plan.integrator.name);
    // It is asked every 16 steps of a trial run.
    let steps = 16 * asked.load(Ordering::Relaxed);
    assert!(steps <= 1 << 14, "{steps} steps");
}

/// A run of which only the end is seen may be one of its trial runs; with rows its steps are taken once more. Both are the
/// same motion to the last bit, within its accuracy of the motion for 1e-12.
#[test]
fn what_is_observed_does_not_change_the_motion() {
    let pendulums = "x'^2 + y'^2/2 + cos(x - y)*x'*y' - 2*(1 - cos(x)) - (1 - cos(y)) - 0.1*z";
    let hamiltonian = Formula::parse_hamiltonian("p_x^2/2 + x^4/4 + 0.05*z", &FormulaNames::new(&["x"], &[])).unwrap();
    let of = |l: &str, coordinates: &[&str]| System::parse(l, coordinates, &[]).unwrap();
    let of_hamiltonian = Start { velocity: InitialVelocity::Momentum(vec![0.5]), ..Start::new(0.0, [1.0], [0.5], 0.0) };
    let cases = [
        (of("x'^2/2 + cos(x) - 0.01*z", &["x"]), Start::new(0.0, [1.0], [1.0], 0.0), 200.0),
        (of("x'^2/2 - x^2/2 - 0.05*z^2", &["x"]), Start::new(0.0, [1.0], [0.0], 1.0), 60.0),
        (of("x'^2/2 - x^2/2 - 0.1*z", &["x"]), Start::new(0.0, [1.0], [0.0], 1.0), 40.0),
        (of("(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)", &["x", "y"]), Start::new(0.0, [0.8, 0.0], [0.0, 1.2], 0.0), 60.0),
        (of(pendulums, &["x", "y"]), Start::new(0.0, [0.9, 0.5], [0.0, 0.0], 0.0), 15.0),
        (of("x'^2/2 - x^2/2 + 0.3*x*cos(1.7*t)", &["x"]), Start::new(0.0, [1.0], [0.0], 0.0), 2.0),
        (System::new(&hamiltonian).unwrap(), of_hamiltonian, 40.0),
    ];
    for (system, start, t_end) in cases {
        let motion = |error: f64| Motion::new(start.clone(), t_end, accurate(error));
        let exact = system.run(&motion(1e-12), &mut ()).unwrap();
        for error in [1e-3, 1e-6, 1e-9, 1e-11] {
            let end = system.run(&motion(error), &mut ()).unwrap();
            let observed = Motion { nodes: true, rows: Some(OutputTimes::Every(1)), ..motion(error) };
            let with_rows = system.run(&observed, &mut ()).unwrap();
            let numbers = |of: &Outcome| {
                let all = of.q.iter().chain(&of.p).chain(&of.z).map(|x| x.to_bits()).collect::<Vec<u64>>();
                (all, of.steps, of.evaluations, of.status, of.unresolved)
            };
            assert_eq!(numbers(&end), numbers(&with_rows), "{start:?}, {error:e}");
            let found = distance(&end, &exact);
            assert!(found <= error, "{start:?}, {error:e}: {found:e}");
        }
    }
}

/// The iterations of a run with a requested error end at a small part of it, which costs fewer evaluations than round-off. The
/// motion is that of the same steps up to this part.
#[test]
fn iterations_end_at_a_part_of_the_error() {
    let pendulums = "x'^2 + y'^2/2 + cos(x - y)*x'*y' - 2*(1 - cos(x)) - (1 - cos(y)) - 0.1*z";
    let oscillator = Formula::parse_hamiltonian("p_x^2/2 + x^4/4 + 0.05*z", &FormulaNames::new(&["x"], &[])).unwrap();
    let of = |l: &str, coordinates: &[&str]| System::parse(l, coordinates, &[]).unwrap();
    let of_hamiltonian = Start { velocity: InitialVelocity::Momentum(vec![0.5]), ..Start::new(0.0, [1.0], [0.5], 0.0) };
    for (system, start, t_end) in [
        (of("x'^2/2 + cos(x) - 0.01*z", &["x"]), Start::new(0.0, [1.0], [1.0], 0.0), 300.0),
        (of("x'^2/2 - x^2/2 - 0.05*z^2", &["x"]), Start::new(0.0, [1.0], [0.0], 1.0), 100.0),
        (of(pendulums, &["x", "y"]), Start::new(0.0, [0.9, 0.5], [0.0, 0.0], 0.0), 10.0),
        (System::new(&oscillator).unwrap(), of_hamiltonian, 40.0),
    ] {
        let mut part = 1.0;
        for error in [1e-9, 1e-6, 1e-3] {
            let motion = Motion::new(start.clone(), t_end, accurate(error));
            let (plan, ours) = (system.plan(&motion).unwrap(), system.run(&motion, &mut ()).unwrap());
            let steps = StepControl::Steps { by: plan.by().unwrap(), steps: Steps::Count(plan.steps) };
            let given = system.run(&Motion::new(start.clone(), t_end, steps), &mut ()).unwrap();
            let found = distance(&ours, &given);
            assert!(found <= 0.01 * error, "{start:?}, {error:e}: {found:e}");
            let now = ours.evaluations as f64 / given.evaluations as f64;
            assert!(now < part, "{start:?}, {error:e}: {now} of the evaluations, {part} before");
            part = now;
        }
        assert!(part <= 0.75, "{start:?}: {part} of the evaluations");
    }
}

/// Motions of which searches have taken too few steps: one that decays, whose first steps have the largest defect, and one whose
/// errors scatter about their order.
#[test]
fn errors_that_do_not_fall_evenly() {
    let three = "0.777*x'^2/2 + 0.760*y'^2/2 + 1.484*w'^2/2 - (0.830*sqrt(1+x^2) + 0.952*y^2/2+0.463*exp(y) \
        + 1.875*(1-cos(w)) + 0.187*(x-y)^2/2 + 0.270*cos(y-w))";
    let of_three = Start::new(
        0.0,
        [0.6530006162239201, 0.6569429892441752, -0.8963112636236599],
        [-1.1548264163390682, 0.0417032876735699, 0.7562844867100793],
        0.0,
    );
    let decaying = "0.613*x'^2/2 - 0.658*sqrt(1+x^2) - 0.1306*z";
    let of_decaying = Start::new(0.0, [-1.1412106848024368], [0.6404324724014796], 0.0);
    for (l, coordinates, start, t_end, error, count) in [
        (decaying, vec!["x"], of_decaying, 291.3058076679698, 1.28e-6, 600),
        (three, vec!["x", "y", "w"], of_three, 341.6952031345293, 5.26e-10, 3200),
    ] {
        let system = System::parse(l, &coordinates, &[]).unwrap();
        let steps = StepControl::Steps { by: "gauss_12".parse().unwrap(), steps: Steps::Count(count) };
        let [found, exact] = [accurate(error), steps]
            .map(|control| system.run(&Motion::new(start.clone(), t_end, control), &mut ()).unwrap());
        let off = distance(&found, &exact);
        assert!(off <= error, "{l}: {off:e} of {error:e}");
    }
}
