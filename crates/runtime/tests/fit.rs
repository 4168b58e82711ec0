//! Fits of motions whose formula is known at run time only.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    AnyIntegrator, FitError, FitStatus, InitialVelocity, Motion, MotionFit, OutputTimes, RunMonitor, RuntimeError,
    Series, Start, StepControl, Steps, System, Unknown,
};
use herglotz_runtime::{Column, FittedMotion};
use std::ops::ControlFlow;

/// A pendulum of length l under drag, with a drive whose strength is a parameter.
fn pendulum(l: f64, gamma: f64) -> System {
    let formula = "l^2*theta'^2/2 + l*cos(theta) + a*theta*sin(t) + gamma*z";
    System::parse(formula, &["theta"], &[("l", l), ("gamma", gamma), ("a", 0.2)]).unwrap()
}

fn motion(start: Start) -> Motion {
    let step_control = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 6 }, steps: Steps::Size(0.25) };
    Motion::new(start, 12.0, step_control)
}

/// The computed motion of a system as data.
fn series(system: &System, start: &Start, quantity: &str, times: &[f64]) -> Series {
    let column = Column::parse(quantity, system.formula()).unwrap();
    let recorded =
        Motion { rows: Some(OutputTimes::At(times.to_vec())), columns: vec![column], ..motion(start.clone()) };
    let values = system.record(&recorded).unwrap().1.into_iter().map(|row| row[0]).collect();
    Series { quantity: quantity.to_owned(), times: times.to_vec(), values, deviations: None, event: None }
}

fn times(count: u32) -> Vec<f64> {
    (1..=count).map(|i| 12.0 * f64::from(i) / f64::from(count)).collect()
}

fn assert_found(fitted: &FittedMotion, expected: &[f64], tolerance: f64) {
    assert!(fitted.fit.status.is_converged(), "{}", fitted.fit);
    for (found, expected) in fitted.fit.parameters.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{}", fitted.fit);
    }
}

/// Data of the computed motion are reproduced to round-off, for all kinds of quantities and unknowns.
#[test]
fn quantities_and_unknowns_of_all_kinds() {
    let (truth, guess) = (pendulum(1.2, -0.1), pendulum(1.1, -0.05));
    let start = Start::new(0.0, [1.0], [0.3], 0.1);
    let near = Start::new(0.0, [0.9], [0.2], 0.0);
    // An expression that depends on a parameter explicitly, and all parts of the state.
    let quantities = ["theta", "theta'", "p_theta", "z", "energy", "height = -l*cos(theta)"];
    let data = quantities.map(|quantity| series(&truth, &start, quantity, &times(17)));
    let unknowns = ["l", "start.theta", "gamma", "theta'", "z"].map(Unknown::free);
    let request = MotionFit::new(motion(near), unknowns, data);
    let fitted = guess.fit(&request, &mut ()).unwrap();
    // 102 exact values with round-off errors of 1e-15 and derivatives of order one.
    assert_found(&fitted, &[1.2, 1.0, -0.1, 0.3, 0.1], 1e-12);
    assert_eq!(fitted.parameters.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["l", "gamma"]);
    assert_eq!(fitted.motion.start.q[0], fitted.fit.parameters[1]);
    assert!(fitted.series.iter().all(|series| series.residuals.iter().all(|r| r.abs() < 1e-12)));
    // By multiple shooting it is the same.
    let shooting = MotionFit { nodes: vec![3.0, 6.5, 9.0], ..request };
    let again = guess.fit(&shooting, &mut ()).unwrap();
    assert_found(&again, &[1.2, 1.0, -0.1, 0.3, 0.1], 1e-9);
    assert!(again.largest_defect.unwrap() < 1e-9 && fitted.largest_defect.is_none());
}

/// The unknowns of a start that is given by its momentum.
#[test]
fn a_start_by_momentum() {
    let system = pendulum(1.2, -0.1);
    let by_momentum = |p: f64| Start { t: 0.0, q: vec![1.0], velocity: InitialVelocity::Momentum(vec![p]), z: 0.0 };
    let data = series(&system, &by_momentum(0.4), "theta", &times(20));
    let request = MotionFit::new(motion(by_momentum(0.2)), ["p_theta"].map(Unknown::free), [data]);
    let fitted = system.fit(&request, &mut ()).unwrap();
    assert_found(&fitted, &[0.4], 1e-13);
    let request = MotionFit { unknowns: vec![Unknown::free("theta'")], ..request };
    let error = system.fit(&request, &mut ()).unwrap_err();
    assert!(error.to_string().contains("the start, which is given by momenta"), "{error}");
}

/// The best of several starts, of which others end in local minima.
#[test]
fn the_best_of_several_starts() {
    let system = System::parse("x'^2/2 - k*x^2/2", &["x"], &[("k", 9.0)]).unwrap();
    let start = Start::new(0.0, [1.0], [0.0], 0.0);
    let times = times(60);
    let values = times.iter().map(|t| f64::cos(2.0 * t)).collect();
    let data = Series { quantity: "x".to_owned(), times, values, deviations: None, event: None };
    let request = MotionFit::new(motion(start), [Unknown::free("k")], [data]);
    let one = system.fit(&request, &mut ()).unwrap();
    assert!((one.fit.parameters[0] - 4.0).abs() > 1.0, "{}", one.fit);
    let several = MotionFit { starts: vec![vec![9.0], vec![3.6], vec![1.0]], ..request };
    let several = system.fit(&several, &mut ()).unwrap();
    assert_eq!((several.best_start, several.starts.len()), (1, 3));
    // gauss_6 with 0.25 has a truncation error of 1e-13 here, and the slope of the last value is 3.
    assert_found(&several, &[4.0], 1e-10);
}

/// Steps for an accuracy are chosen once.
#[test]
fn steps_for_an_accuracy() {
    let system = pendulum(1.2, -0.1);
    let start = Start::new(0.0, [1.0], [0.3], 0.0);
    let data = series(&system, &start, "theta", &times(20));
    let step_control = StepControl::Accuracy { error: 1e-10, by: None };
    let request = MotionFit::new(Motion { step_control, ..motion(start) }, [Unknown::free("gamma")], [data]);
    let fitted = pendulum(1.2, -0.05).fit(&request, &mut ()).unwrap();
    assert_found(&fitted, &[-0.1], 1e-9);
    let StepControl::Steps { by: AnyIntegrator::Gauss { stages: 8 }, steps: Steps::Size(h) } =
        fitted.motion.step_control
    else {
        panic!("{:?}", fitted.motion.step_control)
    };
    assert!((0.2..4.0).contains(&h), "{h}");
}

#[test]
fn invalid_fits_are_refused() {
    let system = pendulum(1.2, -0.1);
    let start = Start::new(1.0, [1.0], [0.3], 0.0);
    let data = || Series {
        quantity: "theta".into(),
        times: vec![2.0, 3.0],
        values: vec![0.5, 0.1],
        deviations: None,
        event: None,
    };
    let request = |unknowns: &[&str], data: Series| {
        let unknowns: Vec<Unknown> = unknowns.iter().map(|name| Unknown::free(*name)).collect();
        MotionFit::new(motion(start.clone()), unknowns, [data])
    };
    let message = |request: &MotionFit| system.fit(request, &mut ()).unwrap_err().to_string();
    assert_eq!(message(&request(&["gama"], data())), "there is no variable `gama`; did you mean `gamma`?");
    assert!(message(&request(&["t_end"], data())).starts_with("t_end cannot be an unknown of a fit"));
    assert_eq!(message(&request(&[], data())), "the model has no parameters; there is nothing to fit");
    let early = Series { times: vec![0.5, 2.0], ..data() };
    assert!(message(&request(&["gamma"], early)).starts_with("the time 0 is 0.5; times must be finite"));
    let at_start = Series { times: vec![1.0, 1.0], ..data() };
    assert!(message(&request(&["gamma"], at_start)).starts_with("no value was observed after the start, at t0 = 1"));
    let short = Series { values: vec![0.5], ..data() };
    assert_eq!(message(&request(&["gamma"], short)), "values of a series: there are 1, but there must be 2");
    let nan = Series { values: vec![0.5, f64::NAN], ..data() };
    assert!(message(&request(&["gamma"], nan)).starts_with("the measured value 1 is NaN"));
    let factor = Series { quantity: "sigma".into(), ..data() };
    assert!(message(&request(&["gamma"], factor)).contains("contains `sigma` or `log_factor`"));
    let few = message(&request(&["gamma", "theta", "theta'"], data()));
    assert!(few.contains("2 measured values cannot determine 3 parameters: the Jacobian has rank 2 of 3"), "{few}");
    // The strength of gravity and the length enter as a ratio.
    let system = System::parse("m*x'^2/2 - k*x^2/2", &["x"], &[("m", 1.0), ("k", 1.0)]).unwrap();
    let request = request(
        &["m", "k"],
        Series {
            quantity: "x".into(),
            times: vec![2.0, 3.0, 4.0],
            values: vec![0.2, -0.5, -0.9],
            deviations: None,
            event: None,
        },
    );
    let fitted = system.fit(&request, &mut ()).unwrap();
    assert!(matches!(&fitted.fit.status, FitStatus::Undetermined(null) if null.rank == 1), "{}", fitted.fit);
}

/// A monitor ends a fit.
#[test]
fn an_interrupted_fit_is_an_error() {
    struct Impatient;
    impl RunMonitor for Impatient {
        fn poll(&mut self, _part: f64) -> ControlFlow<()> {
            ControlFlow::Break(())
        }
    }
    let system = pendulum(1.2, -0.1);
    let start = Start::new(0.0, [1.0], [0.3], 0.0);
    let request =
        MotionFit::new(motion(start.clone()), [Unknown::free("gamma")], [series(&system, &start, "theta", &times(20))]);
    let error = system.fit(&request, &mut Impatient).unwrap_err();
    assert!(matches!(error, RuntimeError::Fit(FitError::Model { .. })), "{error}");
}
