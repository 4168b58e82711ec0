//! Contact Hamiltonians by formula: motions, rows, events, ensembles, geometry, scenes, and refusals.

use herglotz::Scene;
use herglotz::runtime::{
    AnyIntegrator, BoundaryProblem, Column, Ensemble, Event, Formula, FormulaNames, InitialVelocity, InputError,
    MemberEnd, Motion, OutputTimes, RuntimeError, Start, Status, StepControl, Steps, System, Varied,
};
use std::ops::ControlFlow;

type Result<T = ()> = std::result::Result<T, Box<dyn std::error::Error>>;

fn system(text: &str, coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<System> {
    Ok(System::new(&Formula::parse_hamiltonian(text, &FormulaNames::new(coordinates, parameters))?)?)
}

fn at(q: &[f64], p: &[f64], z: f64) -> Start {
    Start { t: 0.0, q: q.into(), velocity: InitialVelocity::Momentum(p.into()), z }
}

fn gauss(count: usize) -> StepControl {
    StepControl::Steps { by: AnyIntegrator::Gauss { stages: 8 }, steps: Steps::Count(count) }
}

#[test]
fn a_regular_hamiltonian_moves_like_its_lagrangian() -> Result {
    let h = system("p_x^2/(2*m) + cos(x) + g*z^2", &["x"], &[("m", 2.0), ("g", 0.05)])?;
    let l = System::parse("m*x'^2/2 - cos(x) - g*z^2", &["x"], &[("m", 2.0), ("g", 0.05)])?;
    let of = |system: &System| -> Result<_> {
        let motion = Motion {
            rows: Some(OutputTimes::At(vec![0.0, 3.0, 10.0])),
            columns: ["t", "x", "x'", "p_x", "z", "energy", "x'*p_x - energy"]
                .map(|text| Column::parse(text, system.formula()))
                .into_iter()
                .collect::<std::result::Result<_, _>>()?,
            events: vec![Event::new(system.formula().expression("x' - 0.1")?)],
            conformal_factor: true,
            ..Motion::new(at(&[1.0], &[0.3], 0.2), 10.0, gauss(40))
        };
        let (outcome, rows) = system.record(&motion)?;
        assert_eq!(outcome.status, Status::Completed);
        Ok((outcome, rows))
    };
    let ((h, rows), (l, of_lagrangian)) = (of(&h)?, of(&l)?);
    // Both are steps of order 16; the error of forty steps is below 1e-13.
    for (a, b) in rows.iter().flatten().zip(of_lagrangian.iter().flatten()) {
        assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{rows:?} {of_lagrangian:?}");
    }
    let factors = h.log_factor.zip(l.log_factor);
    assert!(factors.is_some_and(|(a, b)| (a - b).abs() < 1e-12), "{factors:?}");
    Ok(())
}

#[test]
fn a_hamiltonian_that_is_linear_in_p_runs_from_momenta() -> Result {
    // q' = -q^3, so that q = 1/sqrt(1 + 2 t), and p q^3 e^(-k t) is conserved.
    let decay = system("-p_x*x^3 + k*z", &["x"], &[("k", 0.5)])?;
    let motion = Motion::new(at(&[1.0], &[2.0], 0.0), 2.0, StepControl::Accuracy { error: 1e-11, by: None });
    let outcome = decay.run(&motion, &mut ())?;
    let q = 1.0 / 5.0_f64.sqrt();
    assert!((outcome.q[0] - q).abs() < 1e-10 && (outcome.p[0] * q.powi(3) - 2.0 * (-1.0_f64).exp()).abs() < 1e-9);
    let plan = decay.plan(&motion)?;
    assert!(plan.integrator.name.starts_with("gauss_"), "{}", plan.text);
    let check = decay.check(&Motion::new(motion.start, 2.0, gauss(20)), 4)?;
    assert!(check.is_contact() && check.statements.is_empty(), "{}", check.contact_defect());
    Ok(())
}

/// The pieces of a separable formula are found: its splittings have their orders, and converge to the motion of Gauss
/// collocation.
#[test]
fn a_separable_hamiltonian_runs_by_splittings() -> Result {
    let h = system("p_x^2/2 + p_x^4/20 - cos(x - sin(t)/5) + g*z + z^2/20", &["x"], &[("g", 0.1)])?;
    let end = |step_control: StepControl| -> Result<f64> {
        Ok(h.run(&Motion::new(at(&[1.0], &[0.3], 0.2), 3.0, step_control), &mut ())?.q[0])
    };
    let exact = end(gauss(60))?;
    for (name, count, order) in [("strang", 100, 2.0), ("mclachlan_4", 50, 4.0)] {
        let by: AnyIntegrator = name.parse()?;
        let error =
            |count| -> Result<f64> { Ok((end(StepControl::Steps { by, steps: Steps::Count(count) })? - exact).abs()) };
        let slope = (error(count)? / error(2 * count)?).log2();
        assert!((slope - order).abs() < 0.15, "{name}: {slope}");
    }
    let motion = Motion::new(
        at(&[1.0], &[0.3], 0.2),
        3.0,
        StepControl::Accuracy { error: 1e-9, by: Some("kahan_li_8".parse()?) },
    );
    assert!((h.run(&motion, &mut ())?.q[0] - exact).abs() < 1e-9);
    Ok(())
}

#[test]
fn three_coordinates_run_in_four() -> Result {
    let names = FormulaNames { action: "s", ..FormulaNames::new(&["x", "y", "z"], &[]) };
    let ray = System::new(&Formula::parse_hamiltonian("sqrt(p_x^2 + p_y^2 + p_z^2)", &names)?)?;
    let outcome = ray.run(&Motion::new(at(&[0.0; 3], &[2.0, 1.0, 2.0], 0.0), 3.0, gauss(3)), &mut ())?;
    let expected = [2.0, 1.0, 2.0];
    assert!(outcome.q.iter().zip(expected).all(|(q, e)| (q - e).abs() < 1e-14), "{:?}", outcome.q);
    assert_eq!(ray.formula().action(), "s");
    Ok(())
}

#[test]
fn members_of_an_ensemble_are_single_motions() -> Result {
    let van_der_pol = system("p_x*y + p_y*(mu*(1 - x^2)*y - x) + z", &["x", "y"], &[("mu", 1.0)])?;
    let start = |i: usize| at(&[1.0 + 0.5 * i as f64, 0.0], &[1.0, 0.0], 0.0);
    let mut found = Vec::new();
    let mut keep = |member: MemberEnd| {
        found.push(member.ending);
        ControlFlow::Continue(())
    };
    let ensemble = Ensemble {
        count: 3,
        t0: 0.0,
        end: 2.0,
        start: &start,
        step_control: gauss(20),
        varied: Some(Varied { names: &["mu"], values: &|i| vec![0.5 * i as f64] }),
        rows: None,
        columns: &[],
        events: &[],
        threads: Some(1),
    };
    let tally = van_der_pol.ensemble(&ensemble, &mut keep)?;
    assert_eq!((tally.members, tally.completed), (3, 3));
    for (i, ending) in found.into_iter().enumerate() {
        let of_member = van_der_pol.with_parameters(&[("mu", 0.5 * i as f64)])?;
        let single = of_member.run(&Motion::new(start(i), 2.0, gauss(20)), &mut ())?;
        let ending = ending?;
        assert_eq!((ending.q, ending.p, Some(ending.z)), (single.q, single.p, single.z));
    }
    Ok(())
}

#[test]
fn the_geometry_has_the_field_and_the_brackets() -> Result {
    let h = system("p_x^2/2 + x^2/2 + 0.1*z", &["x"], &[])?;
    let found = h.hamiltonian_geometry(&at(&[1.0], &[2.0], 3.0))?;
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
    assert!(near(&found.field, &[2.0, -1.2, 4.0 - 2.8]), "{found:?}");
    assert!(near(&found.lie_derivative, &[0.2, 0.0, -0.1]) && near(&found.eta, &[-2.0, 0.0, 1.0]), "{found:?}");
    assert!(near(&found.brackets, &[2.1, -1.0, 1.5]) && found.rate == -0.1, "{found:?}");
    // From a velocity, where it has a momentum.
    let same = h.hamiltonian_geometry(&Start::new(0.0, [1.0], [2.0], 3.0))?;
    assert!(near(&same.field, &found.field));
    assert!(h.geometry(&at(&[1.0], &[2.0], 3.0)).is_err());
    assert!(System::parse("x'^2/2", &["x"], &[])?.hamiltonian_geometry(&at(&[1.0], &[2.0], 3.0)).is_err());
    Ok(())
}

#[test]
fn what_a_hamiltonian_cannot_do_is_refused() -> Result {
    let h = system("p_x*ln(x)", &["x"], &[])?;
    let motion = |start: Start, step_control: StepControl| Motion::new(start, 1.0, step_control);
    let refused = |motion: &Motion| h.plan(motion).err();
    let by_velocity = refused(&motion(Start::new(0.0, [2.0], [1.0], 0.0), gauss(4)));
    assert!(matches!(by_velocity, Some(RuntimeError::Input(InputError::NoMomentum))), "{by_velocity:?}");
    let undefined = refused(&motion(at(&[-1.0], &[1.0], 0.0), gauss(4)));
    assert!(matches!(undefined, Some(RuntimeError::HamiltonianUndefined)), "{undefined:?}");
    for name in ["midpoint", "kahan_li_8", "strang", "transformed_gauss_4"] {
        let by: AnyIntegrator = name.parse()?;
        let steps = StepControl::Steps { by, steps: Steps::Count(4) };
        let other = refused(&motion(at(&[2.0], &[1.0], 0.0), steps));
        assert!(matches!(other, Some(RuntimeError::Input(InputError::Hypothesis { .. }))), "{other:?}");
        assert!(h.check_integrator(by).is_err() && h.check_integrator(AnyIntegrator::Gauss { stages: 4 }).is_ok());
    }
    let of_velocities = h.ensemble(
        &Ensemble {
            count: 2,
            t0: 0.0,
            end: 1.0,
            start: &|_| at(&[2.0], &[1.0], 0.0),
            step_control: StepControl::Steps { by: "midpoint".parse()?, steps: Steps::Count(4) },
            varied: None,
            rows: None,
            columns: &[],
            events: &[],
            threads: Some(1),
        },
        &mut |_: MemberEnd| ControlFlow::Continue(()),
    );
    assert!(of_velocities.is_err());
    let many = Formula::parse_hamiltonian("p[0]*q[4]", &FormulaNames::new(&["x[5]"], &[]))?;
    assert!(matches!(System::new(&many), Err(RuntimeError::HamiltonianDimension { found: 5, most: 4 })));
    let path = h.path(&BoundaryProblem::new([vec![2.0], vec![3.0]], (0.0, 1.0), "gauss_2".parse()?, 10));
    assert!(matches!(path, Err(RuntimeError::OfLagrangians { .. })));
    // The exponents of (q, p, z) are those of the discrete motion, whose sum is two times the rate, 0.
    let exponents = h.lyapunov_exponents(&motion(at(&[2.0], &[1.0], 0.0), gauss(4)), &mut ())?;
    assert!(exponents.volume_defect.is_some_and(|defect| defect < 1e-12), "{exponents:?}");
    Ok(())
}

/// A scene with a Hamiltonian.
const SCENE: &str = r#"
[system]
coordinates = ["x", "y"]
momenta = ["l", "m"]
hamiltonian = "l^2/2 + m*x + g*z"
parameters = { g = 0.5 }
[start]
x = 1.0
y = 0.0
l = 2.0
m = 3.0
[run]
time = 2.0
accuracy = 1e-9
[want]
events = [{ when = "x' - 2*l" }]
[sweep]
start.l = [1.0, 2.0]
"#;

#[test]
fn scenes_have_hamiltonians() -> Result {
    let scene = Scene::read(SCENE)?;
    let names: Vec<&str> = scene.columns.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["t", "x", "y", "l", "m", "z"]);
    assert_eq!(scene.columns_of_events(), ["t", "x", "y", "x'", "y'", "l", "m", "z"]);
    assert_eq!(scene.members().count(), 2);
    let (outcome, _) = scene.system.record(&scene.motion())?;
    // m' = -m/2.
    assert!((outcome.p[1] - 3.0 * (-1.0_f64).exp()).abs() < 1e-8, "{:?}", outcome.p);
    let drag = SCENE.replace("momenta = [\"l\", \"m\"]\n", "").replace("l^2/2 + m*x", "p_x^2/2 + p_y*x");
    let drag = Scene::read(
        &drag
            .replace("\nl =", "\np_x =")
            .replace("\nm =", "\np_y =")
            .replace("2*l", "2*p_x")
            .replace("start.l", "start.p_x"),
    )?;
    assert!(drag.system.plan(&drag.motion())?.text.starts_with("z is the action and acts as drag"));
    Ok(())
}

#[test]
fn invalid_scenes_are_refused_with_the_remedy() {
    let refused = [
        ("hamiltonian =", "lagrangian = \"x'^2\"\nhamiltonian =", "give a `lagrangian` or a `hamiltonian`, not both"),
        ("momenta = [\"l\", \"m\"]", "momenta = [\"l\"]", "there are names of 1 momenta for 2 coordinates"),
        ("momenta = [\"l\", \"m\"]", "momenta = []", "there are names of 0 momenta for 2 coordinates"),
        ("momenta = [\"l\", \"m\"]", "momenta = [\"l\", \"x\"]", "the name \"x\" is given twice"),
        ("momenta = [\"l\", \"m\"]", "momenta = [\"l\", \"z\"]", "the name \"z\" is that of the action"),
        (
            "momenta = [\"l\", \"m\"]",
            "momenta = [\"l\", \"m\"]\naction = \"x\"",
            "the name \"x\" is that of the action",
        ),
        ("hamiltonian = \"l^2/2 + m*x + g*z\"", "lagrangian = \"x'^2 + y'^2 + g*z\"", "`momenta` are names for"),
        ("l^2/2", "x'^2/2", "a Hamiltonian depends on momenta, not on velocities; write `l`"),
        ("m = 3.0\n", "", "the momentum `m` has no value at the start; add `m = 0.0` to [start]"),
        ("l = 2.0", "v = 2.0", "unknown name `v` in the start"),
        ("accuracy = 1e-9", "integrator = \"midpoint\"\nstep = 0.1", "a Hamiltonian runs by `gauss_1` to `gauss_16`"),
        ("[run]", "[force]\nx = \"1\"\n[run]", "the formula is a Hamiltonian, which has no forces"),
        ("\"x' - 2*l\"", "\"x\", then = { x = \"1\" }", "the formula is a Hamiltonian, which has no resets"),
        ("coordinates = [\"x\", \"y\"]", "catalogue = \"pendulum\"", "give a `catalogue` or a `lagrangian`"),
    ];
    for (from, to, message) in refused {
        let text = SCENE.replacen(from, to, 1);
        assert_ne!(text, SCENE, "{from}");
        let said = Scene::read(&text).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(said.contains(message), "{to}: {said}");
    }
}
