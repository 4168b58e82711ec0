//! Lyapunov exponents of motions with many impacts in a step.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use contact_geom::switching::Impact;
use formula_lagrangian::Formula;
use herglotz_runtime::{AnyIntegrator, LyapunovExponents, Motion, Start, StepControl, Steps, System};

/// A free particle in a square with a disc.
fn billiard() -> System {
    let mut formula = Formula::parse("(x'^2 + y'^2)/2", &["x", "y"], &[]).unwrap();
    for wall in ["1 - x", "x + 1", "1 - y", "y + 1", "hypot(x, y) - 0.5"] {
        formula = formula.with_impact(wall, Impact::Elastic, None).unwrap();
    }
    System::new(&formula).unwrap()
}

fn exponents(system: &System, x: f64, step_control: StepControl) -> LyapunovExponents {
    let (x, v) = ([x, 0.2], [0.6, 0.8]);
    system.lyapunov_exponents(&Motion::new(Start::new(0.0, x, v, 0.0), 40.0, step_control), &mut ()).unwrap()
}

/// A free flight is exact whatever the steps, so that the exponents are those of the billiard for a few of them.
#[test]
fn a_step_may_span_all_impacts() {
    let system = billiard();
    let by = |count| StepControl::Steps { by: AnyIntegrator::Gauss { stages: 2 }, steps: Steps::Count(count) };
    // A motion in a billiard loses all digits as its tangent grows, by 1e18 here, so that motions by other steps differ as
    // much as those from other starts: the exponents over this time are within the range of a dozen of these, widened
    // by half.
    let others: Vec<f64> =
        (0..12).map(|i| exponents(&system, 0.7 + 0.01 * f64::from(i), by(400)).exponents[0]).collect();
    let [least, most] =
        [f64::min as fn(f64, f64) -> f64, f64::max].map(|of| others.iter().copied().reduce(of).unwrap());
    let margin = 0.5 * (most - least);
    for by in [by(1), by(2), StepControl::Accuracy { error: 1e-9, by: None }] {
        let found = exponents(&system, 0.7, by);
        // The sums of pairs are those of each part, with impacts that are differentiated by differences, to ten digits, of
        // which the flattest impact here keeps seven.
        assert!(found.pairing_defect.unwrap() <= 1e-6 && found.contradiction().is_none(), "{found:?}");
        assert!(found.of_second_half.iter().all(|x| x.is_finite()), "{found:?}");
        let first = found.exponents[0];
        assert!(first > least - margin && first < most + margin, "{found:?}, {others:?}");
        // The direction of the motion and that of its energy neither grow nor shrink: by 1/T at most.
        assert!(found.exponents[1].abs() <= 1.0 / 40.0, "{found:?}");
    }
}

/// The last digit of the start decides where a billiard ends: the run is flagged, and its plan has the error.
#[test]
fn the_end_of_a_billiard_is_flagged() {
    let system = billiard();
    let motion = |end| {
        let start = Start::new(0.0, [0.7, 0.2], [0.6, 0.8], 0.0);
        Motion::new(start, end, StepControl::Accuracy { error: 1e-9, by: None })
    };
    for (end, is_decided) in [(5.0, false), (40.0, true)] {
        let outcome = system.run(&motion(end), &mut ()).unwrap();
        let error = system.plan(&motion(end)).unwrap().error.unwrap();
        assert_eq!((outcome.unresolved.is_some(), error > 0.1), (is_decided, is_decided), "{end}: {error:e}");
    }
}
