//! Derivatives of motions whose formula is known at run time only.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    AnyIntegrator, Column, EndCovector, Ensemble, Event, Gradient, InputError, Interrupt, Motion, OutputTimes,
    RuntimeError, Start, Status, StepControl, Steps, System, Varied,
};

/// The final state of the pendulum at t = 100 from (1, 1, 0), and its derivatives in q0, v0 and gamma, by a Taylor method
/// with 40 digits.
const END: [f64; 3] = [-0.591939247134, -0.633067337150, -1.747387946531];
const SLOPES: [[f64; 3]; 3] = [
    [5.65210486970, -5.53295490161, -3.94604242032],
    [7.38154595869, -7.16085111397, -4.67301564412],
    [225.145071391822, -255.642934500038, -265.676953215921],
];

fn pendulum() -> System {
    System::parse("x'^2/2 - 1 + cos(x) + gamma*z", &["x"], &[("gamma", -0.01)]).unwrap()
}

fn motion(end: f64) -> Motion {
    let step_control = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 8 }, steps: Steps::Size(0.25) };
    Motion::new(Start::new(0.0, [1.0], [1.0], 0.0), end, step_control)
}

/// To the digits of the reference, relative to the largest number.
fn close(found: &[f64], expected: &[f64], tolerance: f64) -> bool {
    let size = expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance * size)
}

fn pulled(motion: &Motion, of: &EndCovector) -> Gradient {
    let mut loss = |_: &[_]| (0.0, vec![of.clone()]);
    pendulum().gradient(motion, &[motion.end], &mut loss, &mut ()).unwrap().loss.unwrap().1
}

#[test]
fn the_pendulum_has_its_derivatives_forward_and_backward() {
    let found = pendulum().sensitivity(&motion(100.0), &["x", "x'", "gamma"], &[50.0, 100.0], &mut ()).unwrap();
    let end = &found.states[1];
    assert_eq!((found.status, found.states.len(), end.t), (Status::Completed, 2, 100.0));
    assert!(close(&[end.q[0], end.v[0], end.z], &END, 1e-11));
    for (column, expected) in found.rows[1].iter().zip(&SLOPES) {
        assert!(close(&[column.q[0], column.v[0], column.z], expected, 1e-11), "{column:?}");
    }
    let zero = EndCovector::zero(1);
    let unit = [
        EndCovector { q: [1.0].into(), ..zero.clone() },
        EndCovector { v: [1.0].into(), ..zero.clone() },
        EndCovector { z: 1.0, ..zero },
    ];
    for (i, of) in unit.iter().enumerate() {
        let Gradient { q, rate, parameters, .. } = pulled(&motion(100.0), of);
        assert!(close(&[q[0], rate[0], parameters[0]], &SLOPES.map(|slopes| slopes[i]), 1e-11));
    }
}

/// Rows and events of the motion do not matter.
#[test]
fn a_loss_of_the_end_has_its_gradient() {
    let (system, plain) = (pendulum(), motion(10.0));
    let text = "(x - 0.5)^2 + energy*gamma";
    let loss = system.formula().expression(text).unwrap();
    let event = Event::new(system.formula().expression("x").unwrap());
    let columns = vec![Column::Time, Column::parse(text, system.formula()).unwrap()];
    let observed = Motion { rows: Some(OutputTimes::Every(3)), columns, events: vec![event], ..plain.clone() };
    let (value, gradient) = system.end_gradient(&observed, &loss, &mut ()).unwrap().loss.unwrap();
    assert_eq!(system.end_gradient(&plain, &loss, &mut ()).unwrap().loss.unwrap(), (value, gradient.clone()));
    // Central differences of the runs, whose truncation is of the size 1e-10.
    let at = |gamma: f64| {
        let system = system.with_parameters(&[("gamma", gamma)]).unwrap();
        let columns = vec![Column::parse(text, system.formula()).unwrap()];
        system.record(&Motion { rows: Some(OutputTimes::At(vec![10.0])), columns, ..plain.clone() }).unwrap().1[0][0]
    };
    let h = 1e-5;
    assert!(close(&[gradient.parameters[0]], &[(at(-0.01 + h) - at(-0.01 - h)) / (2.0 * h)], 1e-7));
    assert!(close(&[value], &[at(-0.01)], 1e-14));
}

#[test]
fn invalid_requests_are_errors_with_the_remedy() {
    let (system, good) = (pendulum(), motion(1.0));
    let said =
        |motion: &Motion, name: &str| system.sensitivity(motion, &[name], &[1.0], &mut ()).unwrap_err().to_string();
    assert_eq!(said(&good, "gama"), "there is no variable `gama`; did you mean `gamma`?");
    assert!(said(&good, "omega").ends_with("the variables are x, x', gamma, z, t0, t_end"));
    assert!(said(&good, "p_x").contains("not by its momentum"));
    let by = "midpoint".parse().unwrap();
    let split = Motion { step_control: StepControl::Steps { by, steps: Steps::Count(10) }, ..good.clone() };
    let kinked = System::parse("x'^2/2 - abs(x)", &["x"], &[]).unwrap();
    let error = kinked.sensitivity(&split, &["x"], &[1.0], &mut ()).unwrap_err().to_string();
    assert!(error.contains("choose a Gauss method such as \"gauss_8\""), "{error}");
    let event = Event { terminal: true, ..Event::new(system.formula().expression("x").unwrap()) };
    let ends = Motion { events: vec![event], ..good.clone() };
    let error = system.lyapunov_exponents(&ends, &mut ()).unwrap_err().to_string();
    assert!(error.contains("terminal event"), "{error}");
    let undefined = system.formula().expression("sqrt(x - 10)").unwrap();
    let error = system.end_gradient(&good, &undefined, &mut ()).unwrap_err();
    assert!(matches!(error, RuntimeError::Sensitivity(_)), "{error}");
}

#[test]
fn a_motion_that_is_not_completed_has_its_status_and_no_gradient() {
    let falling = System::parse("x'^2/2 + 1/x", &["x"], &[]).unwrap();
    let step_control = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Count(50) };
    let motion = Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 5.0, step_control);
    let loss = falling.formula().expression("x").unwrap();
    let found = falling.end_gradient(&motion, &loss, &mut ()).unwrap();
    assert!(found.loss.is_none() && found.status != Status::Completed);
}

fn ensemble<'a>(
    start: &'a (dyn Fn(usize) -> Start + Sync),
    varied: Option<Varied<'a>>,
    threads: usize,
) -> Ensemble<'a> {
    Ensemble {
        count: 1100,
        start,
        t0: 0.0,
        varied,
        end: 2.0,
        step_control: StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Size(0.25) },
        rows: None,
        columns: &[],
        events: &[],
        threads: Some(threads),
    }
}

/// Members, more than are in memory at once, with parameters of their own have the gradients of their motions; one that
/// cannot start has an error.
#[test]
fn members_of_an_ensemble_have_gradients() {
    let system = System::parse("x'^2/2 - k*x^4/4 + gamma*z", &["x"], &[("k", 1.0), ("gamma", -0.1)]).unwrap();
    let start = |i: usize| Start::new(0.0, [if i == 7 { f64::NAN } else { 1.0 + 0.001 * i as f64 }], [0.5], 0.0);
    let values = |i: usize| vec![1.0 + 0.01 * (i % 5) as f64];
    let of = |threads| {
        let many = ensemble(&start, Some(Varied { names: &["k"], values: &values }), threads);
        let loss = system.formula().expression("x^2 + k*x'").unwrap();
        let gradients = system.ensemble_end_gradient(&many, &loss, None).unwrap();
        let sensitivities = system.ensemble_sensitivity(&many, &["x", "k"], &[1.0, 2.0], None).unwrap();
        (gradients, sensitivities)
    };
    let (gradients, sensitivities) = of(2);
    assert_eq!((gradients.len(), sensitivities.len()), (1100, 1100));
    assert!(matches!(gradients[7], Err(RuntimeError::Input(_))) && sensitivities[7].is_err(), "{:?}", gradients[7]);
    let (again, _) = of(1);
    for i in [0, 1, 3, 500, 1023, 1024, 1099] {
        let own = system.with_parameters(&[("k", values(i)[0])]).unwrap();
        let many = ensemble(&start, None, 1);
        let motion = Motion::new(start(i), many.end, many.step_control);
        let loss = own.formula().expression("x^2 + k*x'").unwrap();
        let expected = own.end_gradient(&motion, &loss, &mut ()).unwrap();
        assert_eq!(gradients[i].as_ref().unwrap(), &expected, "member {i}");
        assert_eq!(again[i].as_ref().unwrap(), &expected, "member {i}");
        let expected = own.sensitivity(&motion, &["x", "k"], &[1.0, 2.0], &mut ()).unwrap();
        assert_eq!(sensitivities[i].as_ref().unwrap(), &expected, "member {i}");
    }
    let unknown = Varied { names: &["kk"], values: &values };
    let loss = system.formula().expression("x").unwrap();
    let error = system.ensemble_end_gradient(&ensemble(&start, Some(unknown), 1), &loss, None).unwrap_err();
    assert!(matches!(error, RuntimeError::Formula(_)), "{error}");
    let interrupted = Interrupt::when(|| true);
    let error = system.ensemble_end_gradient(&ensemble(&start, None, 1), &loss, Some(&interrupted)).unwrap_err();
    assert!(matches!(error, RuntimeError::Input(InputError::Interrupted)), "{error}");
}

/// Threads of an ensemble have stacks for the numbers of systems with many coordinates.
#[test]
fn members_with_many_coordinates_have_gradients() {
    let names: Vec<String> = (0..16).map(|i| format!("x{i}")).collect();
    let kinetic: Vec<String> = names.iter().map(|x| format!("{x}'^2/2 - k*{x}^4/4")).collect();
    let coordinates: Vec<&str> = names.iter().map(String::as_str).collect();
    let system = System::parse(&kinetic.join(" + "), &coordinates, &[("k", 1.0)]).unwrap();
    let start = |i: usize| Start::new(0.0, [1.0 + 0.001 * i as f64; 16], [0.0; 16], 0.0);
    let many = Ensemble { count: 4, end: 0.5, ..ensemble(&start, None, 2) };
    let loss = system.formula().expression("x0^2 + x15'").unwrap();
    let found = system.ensemble_end_gradient(&many, &loss, None).unwrap();
    assert!(found.iter().all(|member| member.as_ref().is_ok_and(|member| member.loss.is_some())), "{found:?}");
}

/// The five coordinates of a formula, for which a type of six is compiled, have eleven exponents.
#[test]
fn lyapunov_exponents_are_those_of_the_formula() {
    let names = ["a", "b", "c", "d", "e"];
    let terms: Vec<String> = names.iter().enumerate().map(|(i, x)| format!("{x}'^2/2 - {i}*{x}^2/2")).collect();
    let text = format!("{} - 0.1*(a*b)^2 - 0.3*z", terms.join(" + "));
    let system = System::parse(&text, &names, &[]).unwrap();
    let step_control = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Size(0.1) };
    let motion = Motion::new(Start::new(0.0, [1.0; 5], [0.5; 5], 0.0), 20.0, step_control);
    let found = system.lyapunov_exponents(&motion, &mut ()).unwrap();
    assert_eq!((found.status, found.steps), (Status::Completed, 200));
    assert_eq!((found.exponents.len(), found.of_second_half.len(), found.pairs.len()), (11, 11, 5));
    // The tangent of each step has round-off of a few eps divided by the step.
    assert!(found.pairing_defect.unwrap() <= 1e-13 && found.volume_defect.unwrap() <= 1e-12, "{found:?}");
    assert!((found.rate + 0.3).abs() <= 1e-13);
    let forced = System::parse("x'^2/2 - x^2/2 - 0.1*z", &["x"], &[]).unwrap();
    let event = Event { terminal: true, ..Event::new(forced.formula().expression("x").unwrap()) };
    let motion = Motion { events: vec![event], ..Motion::new(Start::new(0.0, [1.0], [0.5], 0.0), 20.0, step_control) };
    assert!(forced.lyapunov_exponents(&motion, &mut ()).unwrap_err().to_string().contains("terminal event"));
}
