//! Paths between two ends, for a formula.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    AnyIntegrator, BoundaryProblem, FoundPath, Motion, PathStatus, RuntimeError, Start, StepControl, System,
};

const GAMMA: f64 = -0.2;

fn oscillator() -> System {
    System::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", GAMMA)]).unwrap()
}

fn search(system: &System, problem: &BoundaryProblem) -> FoundPath {
    system.path(problem).unwrap()
}

/// Compared with the closed-form solution of x'' = -x + gamma x' from 0 to 1; the action is compared with that of a run
/// from the initial state that was found.
#[test]
fn the_oscillator_between_two_positions() {
    let (system, t1) = (oscillator(), 3.0);
    let w = (1.0 - GAMMA * GAMMA / 4.0).sqrt();
    let a = 1.0 / (f64::exp(0.5 * GAMMA * (t1 - 1.0)) * (w * (t1 - 1.0)).sin());
    // The bounds follow from the orders of the methods: h^8 with a constant below one, and h^2/4 with a constant of
    // about one.
    for (name, error) in [("gauss_4", 1e-11), ("midpoint", 6e-4)] {
        let by: AnyIntegrator = name.parse().unwrap();
        let problem = BoundaryProblem { z0: 0.5, ..BoundaryProblem::new([vec![0.0], vec![1.0]], (1.0, t1), by, 40) };
        let found = search(&system, &problem);
        assert!(found.is_found() && found.unresolved.is_none() && found.regularity > 1e-3, "{found:?}");
        assert_eq!((found.t[0], found.t[40], found.q[0], found.q[40], found.z[0]), (1.0, t1, 0.0, 1.0, 0.5));
        for k in 0..=40 {
            let t = found.t[k] - 1.0;
            let (sin, cos) = (w * t).sin_cos();
            let (x, v) =
                (a * (0.5 * GAMMA * t).exp() * sin, a * (0.5 * GAMMA * t).exp() * (0.5 * GAMMA * sin + w * cos));
            assert!((found.q[k] - x).abs() < error && (found.v[k] - v).abs() < 10.0 * error, "{name}, {k}");
            // The momentum equals the velocity, up to the rounding of Newton's method.
            assert!((found.v[k] - found.p[k]).abs() < 1e-14, "{name}, {k}");
        }
        let start = Start::new(1.0, [0.0], [found.v[0]], 0.5);
        let motion = Motion::new(start, t1, StepControl::Accuracy { error: 1e-12, by: None });
        let z = system.run(&motion, &mut ()).unwrap().z.unwrap();
        assert!((found.z[40] - z).abs() < 10.0 * error && (found.action() - (z - 0.5)).abs() < 10.0 * error);
        // The truncation error is estimated for discrete Lagrangians of order one and two.
        assert_eq!(found.error_estimate.is_some(), name == "midpoint");
        assert!(found.error_estimate.is_none_or(|estimate| estimate > 1e-5 && estimate < 1e-2), "{found:?}");
    }
}

/// The additional coordinates of a kernel with a larger dimension are not visible, and a guess is the start of the
/// search.
#[test]
fn five_coordinates_and_a_guess() {
    let system = System::parse("sum(i, 0, 4, x'[i]^2/2 + cos(x[i])) - 0.1*z", &["x[5]"], &[]).unwrap();
    let by = AnyIntegrator::Gauss { stages: 4 };
    let ends = [vec![0.0; 5], vec![0.0; 5]];
    let straight = search(&system, &BoundaryProblem::new(ends.clone(), (0.0, 8.0), by, 80));
    assert!(straight.is_found() && straight.q.len() == 5 * 81 && straight.q.iter().all(|x| *x == 0.0));
    // With a suitable guess, the pendulum swings out and back within the time span.
    let arc = |k: usize| 2.0 * (std::f64::consts::PI * k as f64 / 80.0).sin();
    let guess = (0..=80).flat_map(|k| [arc(k), 0.0, 0.0, 0.0, -arc(k)]).collect();
    let swung =
        search(&system, &BoundaryProblem { guess: Some(guess), ..BoundaryProblem::new(ends, (0.0, 8.0), by, 80) });
    let middle = &swung.q[5 * 40..5 * 41];
    assert!(swung.is_found() && middle[0] > 0.5 && middle[0] == -middle[4] && middle[1..4] == [0.0; 3], "{middle:?}");
}

#[test]
fn what_cannot_be_searched_for_is_refused() {
    let (system, by) = (oscillator(), AnyIntegrator::Gauss { stages: 4 });
    let good = BoundaryProblem::new([vec![0.0], vec![1.0]], (0.0, 2.0), by, 40);
    let said = |problem: &BoundaryProblem| system.path(problem).unwrap_err().to_string();
    for (problem, why) in [
        (BoundaryProblem { steps: 1, ..good.clone() }, "at least 2"),
        (BoundaryProblem { steps: 0, ..good.clone() }, "at least 2"),
        (BoundaryProblem { ends: [vec![0.0], vec![1.0, 2.0]], ..good.clone() }, "`the end` has 2 numbers"),
        (BoundaryProblem { span: (0.0, f64::NAN), ..good.clone() }, "`t` is NaN"),
        (BoundaryProblem { span: (0.0, 0.0), ..good.clone() }, "step"),
        (BoundaryProblem { by: "strang".parse().unwrap(), ..good.clone() }, "such as \"gauss_4\""),
        (BoundaryProblem { guess: Some(vec![0.0; 3]), ..good.clone() }, "points"),
    ] {
        assert!(said(&problem).contains(why), "{problem:?}: {}", said(&problem));
    }
    let nine = System::parse("sum(i, 0, 8, x'[i]^2/2)", &["x[9]"], &[]).unwrap();
    let problem = BoundaryProblem { ends: [vec![0.0; 9], vec![1.0; 9]], ..good.clone() };
    assert!(matches!(nine.path(&problem), Err(RuntimeError::Argument { argument: "coordinates", .. })));
    // With ends half a period apart, no path is found, or it is flagged as unresolved.
    let free = system.with_parameters(&[("gamma", 0.0)]).unwrap();
    let by: AnyIntegrator = "midpoint".parse().unwrap();
    let conjugate = search(&free, &BoundaryProblem { by, span: (0.0, std::f64::consts::PI), ..good });
    assert!(conjugate.status != PathStatus::Found || conjugate.unresolved.is_some(), "{conjugate:?}");
}
