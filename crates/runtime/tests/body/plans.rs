//! Plans of motions of rigid bodies, and the momenta of their symmetries.

use super::{free, motion};
use herglotz_runtime::{Body, BodyEvent, BodyMotion, OutputTimes, Plan, StepControl};

/// The heavy top of the literature.
fn heavy() -> Body {
    Body {
        inertia: Body::principal([0.234375, 0.46875, 0.234375]),
        mass: 15.0,
        centre: [0.0, 1.0, 0.0],
        gravity: [0.0, 0.0, -9.81],
        gamma: 0.0,
        torque: None,
    }
}

/// Whether a plan computes something, with its reason.
fn entry<'p>(plan: &'p Plan, what: &str) -> (bool, &'p str) {
    let found = plan.items.iter().find(|entry| entry.what == what).unwrap();
    (found.computed, found.why.as_ref())
}

/// A plan has the steps and the error of the run, and says what is computed.
#[test]
fn plans_are_those_of_runs() {
    let accuracy = StepControl::Accuracy { error: 1e-9, by: Some("gauss_4".parse().unwrap()) };
    let request = BodyMotion { step_control: accuracy, ..motion("gauss_4", 1) };
    let (plan, outcome) = (free().plan(&request).unwrap(), free().run(&request, &mut ()).unwrap());
    assert_eq!((plan.steps, plan.step_size, plan.error), (outcome.steps, outcome.step_size, outcome.error_estimate));
    assert_eq!((plan.integrator.name.as_ref(), plan.integrator.order, plan.by()), ("gauss_4", 8, Some(outcome.by)));
    assert!(plan.integrator.source.contains("Hairer") && plan.text.starts_with(&format!("{} steps of", plan.steps)));
    assert!(entry(&plan, "trial runs").0 && entry(&plan, "drag").0);
    for what in ["gravity", "rows", "events"] {
        assert!(!entry(&plan, what).0, "{what}");
    }
    let request = BodyMotion {
        rows: Some(OutputTimes::At(vec![0.5, 1.0])),
        events: vec![BodyEvent::parse("tip_z").unwrap()],
        ..motion("sofroniou_spaletta_10", 1000)
    };
    let plan = heavy().plan(&request).unwrap();
    assert!(plan.integrator.order == 10 && plan.integrator.explicit && !plan.integrator.source.is_empty());
    assert!(plan.error.is_none() && !entry(&plan, "trial runs").0 && !entry(&plan, "drag").0);
    assert!(entry(&plan, "gravity").0 && entry(&plan, "rows").1.contains("2 times"), "{}", plan.text);
    assert!(entry(&plan, "events").1.starts_with("1 function,"), "{}", plan.text);
    // Invalid input is refused as in a run.
    assert!(heavy().plan(&motion("midpoint", 10)).is_err());
}

/// The momenta of symmetries: in space, and about an axis of the body.
#[test]
fn momenta_of_symmetries() {
    assert_eq!(free().momenta().unwrap(), ["M1", "M2", "M3"]);
    assert_eq!(heavy().momenta().unwrap(), ["M3", "Pi2"]);
    let tilted = Body { gravity: [1.0, 0.0, -9.81], ..heavy() };
    assert_eq!(tilted.momenta().unwrap(), ["gravity . M", "Pi2"]);
    let off_axis = Body { centre: [0.1, 1.0, 0.0], ..heavy() };
    assert_eq!(off_axis.momenta().unwrap(), ["M3"]);
    let ball = Body { inertia: Body::principal([2.0; 3]), ..Body::default() };
    assert_eq!(ball.momenta().unwrap(), ["M1", "M2", "M3", "Pi1", "Pi2", "Pi3"]);
    // Those of the heavy top scale by e^(gamma t).
    let damped = Body { gamma: -0.1, ..heavy() };
    let request = BodyMotion { omega: [0.0, 150.0, -4.61538], end: 1.0, ..motion("sofroniou_spaletta_10", 200) };
    let start = damped.run(&BodyMotion { end: 1e-9, ..request.clone() }, &mut ()).unwrap();
    let end = damped.run(&request, &mut ()).unwrap();
    for (before, after) in [(start.spatial_momentum[2], end.spatial_momentum[2]), (start.momentum[1], end.momentum[1])]
    {
        // The start is 1e-9 later; a rounding error for each of 200 steps.
        assert!((after / before / (-0.1_f64 * (1.0 - 1e-9)).exp() - 1.0).abs() < 1e-13, "{before}, {after}");
    }
}
