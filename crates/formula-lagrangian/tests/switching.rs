//! Kinks and jumps of formulas: steps end on them, so that accuracy holds across.

use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, Outcome, Problem, Status, Steps, Until};
use formula_lagrangian::Formula;
use std::f64::consts::PI;

/// The motion of one coordinate x from a position and a velocity, to an accuracy.
fn by_accuracy(text: &str, [x, v]: [f64; 2], span: f64, wanted: f64) -> Outcome<1> {
    let lagrangian = Formula::parse(text, &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([x], [v], 0.0)).unwrap();
    problem.accuracy(wanted).run(Until::Time(span)).unwrap()
}

/// The same by given steps.
fn by_steps(text: &str, [x, v]: [f64; 2], span: f64, by: &str, steps: usize) -> Outcome<1> {
    let lagrangian = Formula::parse(text, &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([x], [v], 0.0)).unwrap();
    problem.by(by.parse::<AnyIntegrator>().unwrap()).steps(Steps::Count(steps)).run(Until::Time(span)).unwrap()
}

/// Texts, starts, spans, and where the motion is at the end.
fn solved() -> Vec<(&'static str, [f64; 2], f64, [f64; 2])> {
    let forced = "x'^2/2 - x^2/2 + if(t > 0.75, 1, 0)*x";
    vec![
        // Half periods of frequency 1 and 3, then 1 and 2.
        ("x'^2/2 - if(x > 0, x^2/2, 4.5*x^2)", [1.0, 0.0], 4.0 * PI / 3.0, [1.0, 0.0]),
        ("x'^2/2 - if(x > 0, x^2/2, 2*x^2)", [1.0, 0.0], 9.0 * PI, [1.0, 0.0]),
        (forced, [0.0, 0.0], 2.0, [1.0 - 1.25_f64.cos(), 1.25_f64.sin()]),
        // A parabola in each direction: a quarter takes sqrt(2).
        ("x'^2/2 - abs(x)", [1.0, 0.0], 8.0 * 2.0_f64.sqrt(), [1.0, 0.0]),
        // Walls and steps of the potential: reflected, slowed down, sped up.
        ("x'^2/2 - 5*if(x > 0.7, 1, 0)", [0.0, 1.0], 2.0, [-0.6, -1.0]),
        ("x'^2/2 - 0.3*if(x > 0.7, 1, 0)", [0.0, 1.0], 2.0, [0.7 + 1.3 * 0.4_f64.sqrt(), 0.4_f64.sqrt()]),
        ("x'^2/2 + 0.3*if(x > 0.7, 1, 0)", [0.0, 1.0], 2.0, [0.7 + 1.3 * 1.6_f64.sqrt(), 1.6_f64.sqrt()]),
    ]
}

#[test]
fn accuracy_holds_across_kinks_and_jumps() {
    for (text, start, span, [x, v]) in solved() {
        for wanted in [1e-6, 1e-9, 1e-11] {
            let found = by_accuracy(text, start, span, wanted);
            let off = (found.q[0] - x).hypot(found.p[0] - v) / x.hypot(v);
            assert!(off <= wanted, "{text} to {wanted:e}: {off:e} in {} steps", found.steps);
            assert_eq!((found.status, found.suspicion), (Status::Completed, None), "{text}");
        }
    }
}

/// By given steps too, whatever the integrator: to the error of the same steps where the motion is smooth.
#[test]
fn given_steps_end_on_kinks_and_jumps() {
    for (text, start, span, [x, v]) in solved() {
        // Frequencies are at most 3; the errors of all steps add up in time.
        for (by, per_unit, bound) in
            [("gauss_8", 2.0, 1e-11), ("gauss_2", 40.0, 1e-6), ("kahan_li_8", 20.0, 1e-6), ("midpoint", 300.0, 1e-3)]
        {
            let found = by_steps(text, start, span, by, (per_unit * span).ceil() as usize);
            let off = (found.q[0] - x).hypot(found.p[0] - v);
            assert!(off <= bound, "{text} by {by}: {off:e}");
            assert_eq!((found.status, found.suspicion), (Status::Completed, None), "{text} by {by}");
        }
    }
}
